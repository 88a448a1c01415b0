#pragma once

#include <filesystem>
#include <string>

#include "gonio/files/atomic_file.h"
#include "gonio/instrument/instrument.h"

namespace gonio::instrument {

/// The calibration archive's constants: one JSON file, format "gonio-calibration", version 1
/// (docs/formats.md). Numbers are written so that they read back exactly.
std::string to_json(const Instrument& instrument);

/// The same as the constants of a calibration, which say so by the key "archive": how old they are,
/// of which devices and of what, stands in the calibration.json that lies beside them.
std::string calibrated_to_json(const Instrument& instrument);

/// `place` names the text's origin in errors.
/// Throws DataFormatError (path, JSON key, found, expected): not JSON, another format or version,
/// missing, unknown or ill-typed keys, non-finite numbers, values validate() refuses.
Instrument instrument_from_json(const std::string& text, const std::filesystem::path& place);

/// Links followed. Throws FileError, DataFormatError as instrument_from_json(), and for constants
/// of a calibration that are not the instrument.json beside its archive: a copy elsewhere has no
/// age.
Instrument read_calibration(const std::filesystem::path& path);
void write_calibration(const std::filesystem::path& path, const Instrument& instrument,
                       files::Overwrite overwrite = files::Overwrite::No);

}  // namespace gonio::instrument
