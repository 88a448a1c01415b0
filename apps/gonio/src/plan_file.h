#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gonio/acquisition/measurement_plan.h"
#include "gonio/rig/kinematics.h"

namespace gonio::cli {

/// plan.csv (docs/formats.md): directions in visiting order with poses.
///
/// `exposures_us`  One per point, or empty: the column is left out.
/// `comments`      Lines without '#'.
std::string plan_text(const rig::RigDescription& rig, const acquisition::MeasurementPlan& plan,
                      const std::vector<double>& exposures_us,
                      const std::vector<std::string>& comments);

/// Directions alone, in the order given.
std::string directions_text(const std::vector<brdf::HalfDiff>& directions,
                            const std::vector<std::string>& comments);

/// True when the file has a joint column for every axis of the rig and a branch: its poses and its
/// order are then used as they stand.
bool has_poses(const std::filesystem::path& path, const rig::RigDescription& rig);

/// Points of such a file, with travel and predicted times for this rig.
/// Throws DataFormatError also for joints that do not realise their direction on this rig, or do so
/// on another branch than the row says.
acquisition::MeasurementPlan read_poses(const std::filesystem::path& path,
                                        const rig::RigDescription& rig);

/// The column exposure_us of such a file in us, one per point; empty when it has none. Throws
/// DataFormatError.
std::vector<double> planned_exposures_us(const std::filesystem::path& path);

/// Points as plan_text() writes them, which are looked at like those of a file (read_poses()).
acquisition::MeasurementPlan realised_poses(const std::string& text,
                                            const std::filesystem::path& place,
                                            const rig::RigDescription& rig);

/// The points as plan_text() wrote them, from a session's archive. That they realise their
/// directions was found out then; `place` names the text in errors.
acquisition::MeasurementPlan stored_poses(const std::string& text,
                                          const std::filesystem::path& place,
                                          const rig::RigDescription& rig);

}  // namespace gonio::cli
