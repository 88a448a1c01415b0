#pragma once

#include <filesystem>

namespace gonio::basis::detail {

/// Refuses an HDF5 file nobody vouches for unless it is as plain as those that Hdf5Writer makes:
/// metadata with checksums, attributes and links inside the header of the root group, contiguous
/// data sets. To be called before the library opens the file: in heaps, B-trees and formats without
/// checksums a few wrong bytes make libhdf5 1.10 crash or loop without end. Headers are read by our
/// own code, links that lead elsewhere are left to the reader.
///
/// Errors   DataFormatError with the place in the file; FileError when it cannot be read.
/// Threads  Any.
/// Source   The HDF Group, "HDF5 File Format Specification Version 3.0": II.A superblock,
///          IV.A.1.b object headers of version 2, IV.A.2 messages.
void require_plain_structure(const std::filesystem::path& path);

}  // namespace gonio::basis::detail
