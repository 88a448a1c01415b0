#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/measurement_plan.h"
#include "gonio/basis/basis.h"
#include "gonio/rig/kinematics.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// Poses and order for a list of directions, with times for this rig.
acquisition::MeasurementPlan plan_poses(const RigFile& rig, const rig::Inverse& inverse,
                                        const std::vector<samples::Direction>& directions,
                                        std::uint64_t seed);

/// Expected time of one point, travel aside, whose shortest exposure is known.
double point_seconds(const RigFile& rig, double shortest_s);

/// Expected time of a session besides its points: homing and the two whites.
double overhead_seconds(const RigFile& rig);

/// "(39.17, 60.08, 89.1) deg".
std::string to_text(const brdf::HalfDiff& direction);

/// The shortest exposure that a bracket will take of an average training material, from the mean
/// of the basis; clamped to what the session may use.
double expected_exposure_us(const RigFile& rig, const basis::BasisRows& rows,
                            const brdf::HalfDiff& direction);

/// BRDF times cos theta_i, in 1/sr, of what expected_exposure_us() would give this exposure.
double radiance_of_exposure(const RigFile& rig, double exposure_us);

}  // namespace gonio::cli
