#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "gonio/devices/frame.h"

namespace gonio::acquisition {

/// Of a frame in its archive: "frames/000012.tiff".
std::string frame_file_name(std::int64_t id);

/// The numbers of the frame files there are, ascending.
std::vector<std::int64_t> numbers_of_frame_files(const std::filesystem::path& folder);

/// Those behind the last row. A writer that is killed leaves one at most, for the row comes
/// right after the file: where there are more, the journal has lost rows.
std::vector<std::int64_t> without_rows(const std::vector<std::int64_t>& files,
                                       std::int64_t last_row);

/// What is wrong with a frame's file against its journal entry; empty when nothing is. Who reads
/// frames makes room for all pixels of the entry before the first is read.
std::string fault_of(const std::filesystem::path& path, const std::string& sha256,
                     const devices::Frame& shape);

/// Makes way for the frame that comes next: removes what a killed writer left in frames/, and sets
/// aside frames whose rows the journal has lost. Returns what was done, for people.
std::vector<std::string> cut_back(const std::filesystem::path& folder, std::int64_t last_row);

}  // namespace gonio::acquisition
