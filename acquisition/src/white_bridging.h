#pragma once

#include <cstddef>
#include <vector>

#include "gonio/acquisition/trust_notes.h"
#include "white_level.h"

namespace gonio::acquisition {

/// One visit to the sentinel: its level in all colours. Variances are of its noise and its pose.
struct PartSentinel {
  std::size_t part = 0;
  LightCurve::Reading reading;
};

/// In time; those that lack a channel are left out.
std::vector<PartSentinel> part_sentinels(const std::vector<SentinelVisit>& visits,
                                         const ColourLayout& colours, const SessionParts& parts);

/// Finds bridges, stretches and shapes of a level that has nothing but its visits, one at least.
/// Bridges lead from the last white of each part to the first of the next that has one, all by the
/// whites as they were measured. Whites are moved only where a bridge is applied: a session that
/// was interrupted and nothing else is the uninterrupted one. `parts`: how many. `u_monitor`: of
/// one reading of the lamp monitor, relative.
void bridge_whites(const std::vector<PartSentinel>& sentinels, std::size_t parts, double u_monitor,
                   WhiteLevel& level);

}  // namespace gonio::acquisition
