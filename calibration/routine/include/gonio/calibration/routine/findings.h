#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/calibration/geometry/lamp_arm.h"
#include "gonio/calibration/geometry/sample_plane.h"
#include "gonio/calibration/geometry/zero_offsets.h"
#include "gonio/calibration/radiometry/colour_matrix.h"
#include "gonio/calibration/radiometry/lamp_field.h"
#include "gonio/calibration/radiometry/stray_light.h"
#include "gonio/calibration/radiometry/verification.h"
#include "gonio/calibration/routine/observations.h"
#include "gonio/calibration/routine/settings.h"
#include "gonio/calibration/sensor/axis_motion.h"
#include "gonio/calibration/sensor/darks.h"
#include "gonio/calibration/sensor/lamp_stability.h"
#include "gonio/calibration/sensor/linearity.h"
#include "gonio/calibration/sensor/photon_transfer.h"
#include "gonio/instrument/calibration_archive.h"
#include "gonio/instrument/instrument.h"

namespace gonio::calibration::routine {

/// Signal of the white in the reference pose over what geometry, fields and certificate predict.
struct WhiteConstant {
  std::array<double, 3> constant{};  ///< per channel, as FieldFit::constant
  std::array<double, 3> relative_sigma{};
  double disagreement = 0.0;  ///< largest relative difference of two takes
};

/// What the steps have found so far; one not taken is empty. Stage, lamp and zeros are those of the
/// homing they were seen after, and their covariances say nothing of another: see homing_scatter().
struct Findings {
  std::map<std::string, int> seen_after;        ///< Observations::homing, by step
  std::map<std::string, AngleEstimate> homing;  ///< scatter, by axis
  std::map<std::string, sensor::Repeatability> repeatability;
  std::map<std::string, sensor::Settling> settling;
  std::optional<sensor::LampStability> lamp;
  std::optional<DarkSummary> darks;
  std::optional<sensor::PhotonTransfer> photon_transfer;
  std::optional<sensor::NonUniformity> non_uniformity;
  std::optional<sensor::Linearity> linearity;
  std::vector<std::uint8_t> bad_pixels;  ///< of the whole image, not 0: not used; empty: not known
  std::optional<geometry::Intrinsics> intrinsics;
  std::optional<geometry::StageAxes> stage;
  std::optional<geometry::SamplePlane> sample_plane;
  std::optional<geometry::LampArm> lamp_arm;
  std::vector<geometry::Peak> peaks;
  std::optional<geometry::ZeroOffsets> zeros;
  std::optional<FieldFit> fields;
  std::optional<StrayLight> stray;
  std::optional<WhiteConstant> white;
  std::optional<ColourMatrix> colour;
  std::optional<Verification> verification;
};

/// Where an axis comes to stand about its reading: the largest of those found, or a usual one.
Angle joint_scatter(const Findings& findings);
/// Where an axis' zero comes to lie by one homing, as found or a usual one.
Angle homing_scatter(const Findings& findings, const std::string& axis);

/// What a step's observations come to, in terms of what is known already: fills its part of
/// `findings` and returns parameters, covariance, residuals, checks and notes of the result; who
/// made it from what and when is the caller's. A pure function: the same observations always give
/// the same result. Checks may have failed.
///
/// Errors   StepRefused as the fits; std::invalid_argument for a step that is none, or one it needs
///          of which nothing was found.
instrument::StepResult evaluate(const std::string& step, const Observations& observations,
                                const instrument::Instrument& nominal,
                                const RoutineSettings& settings, Findings& findings);

/// Takes out what a step has found, as if it had never been taken. Throws std::invalid_argument for
/// a step that is none.
void forget(std::string_view step, Findings& findings);

/// The nominal instrument with everything found in the place of what was assumed.
instrument::Instrument calibrated(const instrument::Instrument& nominal, const Findings& findings);

}  // namespace gonio::calibration::routine
