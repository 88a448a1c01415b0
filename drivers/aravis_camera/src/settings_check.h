#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "gonio/aravis_camera/camera_link.h"
#include "gonio/aravis_camera/options.h"

namespace gonio::aravis_camera {

/// How far what a camera grants may be from what was asked: it rounds to its own steps. What it
/// grants is what the frame carries.
inline constexpr double kExposureTolerance = 0.02;
inline constexpr double kExposureToleranceUs = 50.0;  // lines of a slow sensor

/// Where `state` is not what was asked for, as a line: "GainAuto is on". Empty when it is.
///
/// `exposure`      None: any.
/// `free_running`  Whether the camera should run without triggers.
std::string difference(const AravisCameraOptions& options, const CameraIdentity& identity,
                       const CameraState& state, std::optional<std::chrono::nanoseconds> exposure,
                       bool free_running);

}  // namespace gonio::aravis_camera
