#pragma once

#include <string>

#include "gonio/devices/camera.h"

namespace gonio::gige_emulator {

/// The camera's description of itself, XML as the GenICam standard, GenApi schema 1.0: which
/// features there are and in which registers (registers.h).
std::string genicam_description(const devices::CameraInfo& sensor, const std::string& vendor,
                                const std::string& model);

}  // namespace gonio::gige_emulator
