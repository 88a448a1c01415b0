#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "gonio/brdf/brdf_model.h"

namespace gonio::acquisition {

/// By how much a level changed over an interruption, as one of those says that were measured on
/// both sides of it.
struct LevelChange {
  brdf::Rgb relative;  ///< after over before, minus 1
  /// Of what it shares with no other: noise and, of a sentinel, the pose. Relative, k = 1, squared.
  brdf::Rgb variance;
};

/// How the light of a part of a session compares with that of the last one before that has a white:
/// by the whites on both sides, and by the sentinels where both parts have some.
struct PartBridge {
  std::size_t from = 0;                    ///< the part it leads from
  std::size_t part = 0;                    ///< that it leads to; those between have no white
  double at_s = 0.0;                       ///< the white after it, session clock
  brdf::Rgb relative = brdf::Rgb::Zero();  ///< by all of them, after over before, minus 1
  // Both in the colour that says most:
  double change_relative = 0.0;
  double u_relative = 0.0;   ///< k = 1
  bool by_sentinel = false;  ///< by whites and sentinels; else by whites alone
  // What the whites say less what the sentinels say, in the colour that says most:
  double disagreement_relative = 0.0;
  double u_disagreement_relative = 0.0;  ///< k = 1; 0 without sentinels

  /// Whether a part lies between both.
  bool spans(std::size_t between) const { return from < between && between < part; }
  /// Whites and sentinels contradict each other: white or sample changed, not the light alone.
  bool is_refused() const;
  /// Whether it tells a change of the light from noise. Then each part has its own level, and the
  /// whites on both sides are this factor apart.
  bool is_applied() const;
};

/// Weighted means by inverse variance. `u_monitor`: of one reading of the lamp monitor, relative.
/// Whites and sentinels are divided by the same monitor: what it is off by moves both alike, so
/// that it counts once in their mean and not at all in their difference.
PartBridge bridge_parts(const LevelChange& white, const std::optional<LevelChange>& sentinel,
                        double u_monitor);

/// One line for people: what changed, by which means, and what is done about it.
std::string to_text(const PartBridge& bridge);

}  // namespace gonio::acquisition
