#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "gonio/acquisition/session.h"
#include "gonio/instrument/instrument.h"
#include "gonio/setup/rig_file.h"
#include "gonio/sim/sim_goniometer.h"

namespace gonio::cli {

/// The white reference as its certificate has it: the rig file's, with the table read from
/// `certificate` (read_white_certificate(), whose errors it throws); of a rig with
/// `simulation.hidden` that of the hidden tile.
instrument::WhiteReference white_of(const RigFile& file);

/// The hidden world of a rig file with a material on it; the sample's tilt comes from `seed`, and
/// with `simulation.hidden` all that sim::hidden_options() draws. Sizes of sample, white and patch,
/// image size, the time a change takes, the time scale and ambient light are the file's all the
/// same. The certificate is true of white tile and patch. Throws as white_of().
sim::SimOptions simulated_world(const RigFile& file,
                                std::shared_ptr<const brdf::BrdfModel> material,
                                std::uint64_t seed);

/// The constants an operator of the nominal rig would know, without a calibration.
instrument::Instrument nominal_instrument(const RigFile& file);

/// Where the calibration lies that is named on the command line, else in the rig file: a file of
/// constants, or a folder of `gonio calibrate`, whose instrument.json they are, also where that
/// file or a link to it is named. Empty: none.
std::filesystem::path calibration_place(const RigFile& file, const std::string& calibration);

/// The calibration file named on the command line, else in the rig file, else nominal constants;
/// limits and keep-outs of the rig file hold besides the calibration's (narrower_rig(), whose
/// UsageError it throws).
instrument::Instrument instrument_of(const RigFile& file, const std::string& calibration = "");

/// A rig file with the constants that are known of its rig: what is planned and reduced with, never
/// the file's own nominal kinematics.
struct KnownRig {
  RigFile file;
  instrument::Instrument constants;
};

/// Reads the file; `calibration` as for instrument_of(), whose errors it throws as well.
KnownRig known_rig(const std::filesystem::path& file, const std::string& calibration = "");

/// The world's devices as a session takes them; they belong to the world.
acquisition::DeviceSet devices_of(sim::SimGoniometer& world);

}  // namespace gonio::cli
