#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "gonio/acquisition/measurement_plan.h"
#include "gonio/acquisition/reduction.h"
#include "gonio/acquisition/session.h"
#include "gonio/instrument/instrument.h"
#include "gonio/rig/kinematics.h"
#include "gonio/setup/rig_devices.h"
#include "gonio/sim/sim_options.h"

namespace gonio::cli {

/// How thick the targets of a calibration are against the board, whose face the cradle's axes are
/// found with; outwards is positive.
struct TargetThickness {
  double mirror_raised_mm = 0.0;
  double u_mirror_raised_mm = 0.02;
  double sample_raised_mm = 0.0;
  double u_sample_raised_mm = 0.05;
  double black_glass_index = 1.52;  ///< refractive
};

/// Everything a rig file says, resolved: defaults filled in.
struct RigFile {
  enum class Driver { simulated, hardware };
  enum class Kind { la2, chains };

  Driver driver = Driver::simulated;
  Kind kind = Kind::la2;
  double camera_distance_mm = 350.0;  ///< LA-2 only
  double lamp_distance_mm = 500.0;
  std::string calibration;  ///< file, relative to the rig file; empty: nominal constants
  rig::RigDescription rig;
  rig::BranchSet branches;
  acquisition::SessionOptions session;
  acquisition::PairOptions pairs;  ///< measured besides the plan
  acquisition::ReductionOptions reduction;
  instrument::WhiteReference white;  ///< without its angular table, see white_of()
  std::string certificate;           ///< that table's file, relative to the rig file; empty: none
  TargetThickness targets;
  RigDevices devices;  ///< of a rig whose driver is hardware
  /// The simulated world, also the one behind an emulated rig's wires. Its rig and material are
  /// filled in by simulated_world().
  sim::SimOptions world;
  bool white_light = false;  ///< one white lamp channel instead of R, G, B
  Angle tilt_rms =
      Angle::from_degrees(sim::kNominalTiltDeg);  ///< of the sample's normal, per axis and session
  sim::AxisOptions axis_errors;                   ///< the same for every axis
  /// The world is sim::hidden_options() with the seed; what the file says of the rig, camera, white
  /// and simulated errors is then nominal and not true.
  bool hidden = false;
  std::string material;  ///< lies on the simulated rig when none is named; may be empty

  std::filesystem::path path;  ///< the file; empty for the built-in default
};

std::string_view to_string(RigFile::Driver driver);  ///< as the rig file calls it

/// The rig that is used when no rig file is given.
RigFile default_rig_file();

/// Throws ConfigError (file:line key: found, expected), FileError.
RigFile read_rig_file(const std::filesystem::path& path);
RigFile rig_file_from_text(const std::string& text, const std::filesystem::path& place);

/// The whole file as TOML that reads back to the same values.
std::string rig_file_text(RigFile rig, bool comments);

/// The same with comments and, commented out, a keep-out, for a person to start from.
std::string example_rig_text(const RigFile& rig);

}  // namespace gonio::cli
