#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gonio/calibration/geometry/lamp_arm.h"
#include "gonio/calibration/geometry/peak_scan.h"
#include "gonio/calibration/geometry/stage_axes.h"
#include "gonio/calibration/radiometry/glass_ratios.h"
#include "gonio/calibration/radiometry/verification.h"
#include "gonio/calibration/radiometry/white_view.h"
#include "gonio/calibration/result/estimate.h"
#include "gonio/calibration/sensor/axis_motion.h"
#include "gonio/calibration/sensor/lamp_stability.h"
#include "gonio/calibration/sensor/level_statistics.h"
#include "gonio/calibration/sensor/non_uniformity.h"

namespace gonio::calibration::routine {

/// What one axis did, as the lamp's image in the mirror shows it.
struct AxisRecord {
  std::string axis;
  std::vector<Angle> homings;  ///< where one place lay after each homing
  std::vector<sensor::Approach> approaches;
  std::vector<sensor::AngleReading> settling;  ///< after one long move
};

struct PeakScan {
  bool turned = false;  ///< the mirror, by half a turn in its mount
  std::vector<geometry::PeakSample> samples;
};

/// A pixel that is not to be used; `bits` of sensor::defect.
struct DefectivePixel {
  std::uint32_t index = 0;  ///< row-major
  std::uint8_t bits = 0;
};

/// What stacks of dark frames came to, without the maps.
struct DarkSummary {
  Estimate black_level_dn;
  Estimate dark_current_dn_per_s;
  Estimate temporal_noise_dn;
  double black_change_dn = 0.0;
  double bad_fraction = 0.0;
};

/// All that one step has seen, reduced from its frames to what its fit takes. A step fills what it
/// looks at and leaves the rest empty. Kept beside the archive, so that any result can be had again
/// from it, on another day and by another version.
struct Observations {
  /// Which homing of the axes it was seen after, counted in its folder: what two steps of one
  /// number have seen stands on the same zeros. 0: the step moved nothing.
  int homing = 0;
  std::vector<AxisRecord> axes;
  std::vector<sensor::LampReading> lamp;
  std::optional<DarkSummary> darks;
  std::vector<DefectivePixel> defects;
  std::vector<sensor::LevelStatistics> dark_levels;
  std::vector<sensor::LevelStatistics> levels;
  std::optional<sensor::NonUniformity> non_uniformity;
  std::vector<geometry::StageView> boards;
  std::vector<geometry::StageView> boards_turned;  ///< turned by half a turn in its mount
  std::vector<geometry::MirrorView> mirrors;
  std::vector<PeakScan> scans;
  std::vector<WhiteView> whites;  ///< also of the trap and the chart
  std::vector<GlassView> glasses;
  /// The white's, per channel, when trap or chart were looked at: what they sent is compared with a
  /// white in the light of that day.
  std::optional<std::array<double, 3>> constant;
  /// Linear sRGB of the chart's patches as its certificate said when it was looked at, which nobody
  /// may tell again on another day; empty when there was none.
  std::vector<Eigen::Vector3d> chart;
  /// What was looked for and not found, a line each. Never stored: such a step does not pass.
  std::vector<std::string> unseen;
};

/// JSON, format "gonio-calibration-observations"; numbers read back exactly.
std::string to_json(const std::string& step, const Observations& observations);

/// Throws DataFormatError (path, key, found, expected).
Observations observations_from_json(const std::string& text, const std::string& step,
                                    const std::filesystem::path& place);

}  // namespace gonio::calibration::routine
