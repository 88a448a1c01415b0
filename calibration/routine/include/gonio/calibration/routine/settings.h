#pragma once

#include <Eigen/Core>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/session.h"
#include "gonio/calibration/board/board_spec.h"
#include "gonio/calibration/geometry/lamp_arm.h"
#include "gonio/calibration/geometry/sample_plane.h"
#include "gonio/instrument/calibration_archive.h"

namespace gonio::calibration::routine {

/// The colour chart as its certificate says.
struct ChartSpec {
  int columns = 6;
  double patch_mm = 8.0;
  double gap_mm = 1.0;
  std::vector<Eigen::Vector3d> linear_srgb;  ///< per patch, row by row from the top left; white = 1
};

/// How much is looked at, and what the operator knows of the targets.
struct RoutineSettings {
  acquisition::SessionOptions session;  ///< retries, time-outs, exposures
  board::BoardSpec board;
  bool board_measured = false;  ///< somebody measured its squares: results keep their size
  ChartSpec chart;              ///< no patches: there is no chart, the colour matrix stays unity

  geometry::MirrorMount mirror;        ///< how the mirror lies where the board lay
  geometry::SampleDatum sample;        ///< how a sample does
  double target_half_width_mm = 25.0;  ///< of white, trap and mirror: the part that is used
  double black_glass_index = 1.52;     ///< refractive
  /// Of the room, as it was read; kept with what is taken.
  std::optional<double> temperature_deg_c;

  int homings = 10;
  int approaches = 4;  ///< per target and side
  std::chrono::seconds warm_up{3600};
  std::chrono::seconds lamp_interval{60};
  int dark_frames = 12;  ///< per exposure
  int light_levels = 20;
  int flat_frames = 12;  ///< of a stack for the pixels' own response
  double max_bad_pixel_fraction = 0.002;
  int white_frames = 4;
};

/// What the settings say of targets, as results keep it. A chart without patches is not told, nor a
/// board that nobody has measured.
instrument::TargetData target_data(const RoutineSettings& settings);

/// Unless the settings' board was measured: its squares as an earlier step was told them, if one
/// was. Throws std::invalid_argument for what is no length.
void keep_measured_board(const instrument::CalibrationArchive& archive, RoutineSettings& settings);

}  // namespace gonio::calibration::routine
