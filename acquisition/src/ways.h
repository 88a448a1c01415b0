#pragma once

#include <limits>

#include "gonio/rig/travel.h"

namespace gonio::acquisition {

inline constexpr double kNoWay = std::numeric_limits<double>::infinity();

/// kNoWay when keep-outs bar every known way.
inline double seconds_between(const rig::TravelModel& travel, const rig::Joints& from,
                              const rig::Joints& to) {
  const auto route = travel.route(from, to);
  return route ? route->seconds : kNoWay;
}

}  // namespace gonio::acquisition
