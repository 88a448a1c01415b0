#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gonio/modbus_stage/drive_profile.h"

namespace gonio::cli {

/// A drive profile in TOML (docs/formats.md, rigs/drives/generic.toml). Throws ConfigError
/// (file:line key: found, expected), FileError.
modbus_stage::DriveProfile read_drive_profile(const std::filesystem::path& path);
modbus_stage::DriveProfile drive_profile_from_text(const std::string& text,
                                                   const std::filesystem::path& place);

/// A profile that comes with the program, by its name. Throws std::invalid_argument naming those
/// there are.
modbus_stage::DriveProfile shipped_drive_profile(const std::string& name);
std::vector<std::string> shipped_drive_names();

/// What a rig file in `folder` calls `word`: a file beside it where the word ends in .toml,
/// otherwise a shipped profile. Throws as those two.
modbus_stage::DriveProfile drive_profile(const std::string& word,
                                         const std::filesystem::path& folder);

}  // namespace gonio::cli
