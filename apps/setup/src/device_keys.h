#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config_reader.h"
#include "gonio/setup/rig_devices.h"

namespace gonio::cli {

/// The tables [[bus]], [lamp], [monitor] and [camera_device] of a rig file whose driver is
/// "hardware".
void visit_devices(ConfigVisitor& v, RigDevices& devices);

/// The table [axis.NAME.device], within [axis.NAME].
void visit_axis_device(ConfigVisitor& v, AxisDevice& device);

/// Throws ConfigError (file:line key: found, expected): what is missing, a bus that is not there,
/// a unit twice on a bus.
void check_devices(const RigDevices& devices, const std::vector<std::string>& axis_names,
                   const ConfigReader& reader, const std::filesystem::path& place);

}  // namespace gonio::cli
