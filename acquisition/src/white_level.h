#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "gonio/acquisition/reduction.h"
#include "light_curve.h"
#include "merged_frames.h"

namespace gonio::acquisition {

/// The constant C of the measurement equation, per colour, as the whites of a session give it.
struct WhiteLevel {
  struct Visit {
    std::size_t part = 0;
    double time_s = 0.0;
    brdf::Rgb constant;  ///< per unit of lamp monitor
    brdf::Rgb relative_sigma;
  };
  std::vector<Visit> visits;          ///< in time
  std::vector<std::string> warnings;  ///< visits that cannot be used
  std::vector<PartBridge> bridges;    ///< from each part with a white to the next such
  /// By part. Those of one light, which sentinels show to be the same or how it changed, share one
  /// stretch.
  std::vector<std::size_t> stretches;
  /// By part, of stretches whose sentinels tell more than noise. All of a stretch are in one unit.
  std::map<std::size_t, LightCurve> shapes;

  /// C over monitor at a time in a part: linear between visits, held outside; where sentinels tell
  /// a change it follows them, so that a step lies where it was. Over an interruption it is linear
  /// only when the levels before and after agree: else the light changed at an unknown time, or
  /// nobody knows by how much, and each part has its own.
  brdf::Rgb at(double time_s, std::size_t part) const;
  /// Last over first visit, minus 1, where it is largest.
  double drift() const;
  /// What may have happened to a point unseen, relative, k = 1: a change of the light at an unknown
  /// time, drift() or one while the session was interrupted (/ sqrt(12)), and what whites and
  /// sentinels are apart over an interruption that is not bridged: either may be right (/ sqrt(3)).
  double u_unseen() const;
  /// Whether nobody knows how the levels of a part compare with those of the first. A part without
  /// a white counts as known when its sentinels attach it to another, or when the light before and
  /// behind is the same.
  bool is_unbridged(std::size_t part) const;
  bool has_white(std::size_t part) const;

 private:
  /// Of the light by sentinels; 1 where they tell nothing.
  brdf::Rgb shape(double time_s, std::size_t part) const;
  bool share_light(std::size_t part, std::size_t other) const {
    return stretches[part] == stretches[other];
  }
  /// C at a time that has no other visit beyond it in its stretch.
  brdf::Rgb carried(const Visit& visit, double time_s, std::size_t part) const;
};

/// `parts`, `darks` as mean_darks(); a visit to the white that a kill has cut off does not count.
/// `monitored`: see monitored_channels(). Throws DataFormatError when the archive holds no usable
/// white frame.
WhiteLevel white_level(const SessionReader& archive, const instrument::Instrument& instrument,
                       const ReductionOptions& options, const ColourLayout& colours,
                       const SessionParts& parts, const std::vector<MeanDark>& darks,
                       const std::set<std::string>& monitored);

}  // namespace gonio::acquisition
