#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>

namespace gonio::cli {

/// What is written under `path` replaces what stands there: throws FileError unless that is a file,
/// or nothing.
void require_replaceable_file(const std::filesystem::path& path);

/// Before long work: `out` can be created, and writing it takes none of the inputs away, neither by
/// being one of them nor by lying inside a session archive that is one, nor a calibration's own
/// files. An X.binary is written with
/// its X.json. "-" names no file.
/// Throws UsageError or FileError. Empty input names are skipped.
void require_output(const std::string& out, bool force, std::initializer_list<std::string> inputs);

}  // namespace gonio::cli
