#pragma once

#include <set>
#include <string>
#include <vector>

#include "gonio/acquisition/reduction.h"
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
  /// How bright the light was at a sentinel, against the first of its part; colours as Visit.
  struct Sentinel {
    std::size_t part = 0;
    double time_s = 0.0;
    brdf::Rgb relative;
  };
  std::vector<Visit> visits;  ///< in time
  /// Those of the parts in which they tell a change from noise; of other parts none.
  std::vector<Sentinel> sentinels;
  std::vector<std::string> warnings;  ///< visits that cannot be used
  std::vector<PartBridge> bridges;    ///< from each part to the next

  /// C over monitor at a time in a part: linear between visits, held outside; in a part with
  /// sentinels it follows them between its visits, so that a step lies where it was. Across an
  /// interruption it is linear only when the levels before and after agree: else it changed at an
  /// unknown time, or nobody knows by how much, and each part has its own.
  brdf::Rgb at(double time_s, std::size_t part) const;
  /// Last over first visit, minus 1, where it is largest.
  double drift() const;
  /// What may have happened to a point unseen, relative, k = 1: a change of the light at an unknown
  /// time, drift() or one while the session was interrupted (/ sqrt(12)), and what whites and
  /// sentinels are apart over an interruption that is not bridged: either may be right (/ sqrt(3)).
  double u_unseen() const;
  /// Whether nobody knows how the levels of a part compare with those of the first.
  bool is_unbridged(std::size_t part) const;

 private:
  /// Of the light by the sentinels of a part: linear between them, outside with their median slope,
  /// so that what lies between the whites and them drifts as the rest did. 1 without two.
  brdf::Rgb shape(double time_s, std::size_t part) const;
  /// C at a time that has no other visit beyond it in its part.
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
