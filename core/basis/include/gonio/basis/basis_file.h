#pragma once

#include <filesystem>

#include "gonio/basis/basis.h"
#include "gonio/files/atomic_file.h"

namespace gonio::basis {

/// Writes a basis as HDF5: self-describing, readable by h5py (docs/formats.md), the same bytes for
/// the same basis. p * k * 4 bytes, 350 MB at the default 80 components.
///
/// Throws   FileError when it cannot be written; nothing is left under `path` then, and what stood
///          there stays. std::invalid_argument for a basis whose parts do not fit together.
/// Threads  Any; HDF5 is entered by one at a time.
void write_basis(const std::filesystem::path& path, const Basis& basis,
                 files::Overwrite overwrite = files::Overwrite::No);

/// Reads what write_basis() wrote. The file is not trusted: shapes are checked against the lattice
/// and the size of the file before anything is allocated, links out of the file are refused.
///
/// Throws   FileError when it cannot be opened; DataFormatError: not HDF5, not as plain as
///          write_basis() makes it (metadata without checksums, heaps, B-trees, chunks), a missing
///          or wrongly shaped data set, non-finite values, parts that contradict each other
///          (components whose lengths are not the singular values), another lattice convention, an
///          unknown scale or version.
/// Threads  As above.
Basis read_basis(const std::filesystem::path& path);

}  // namespace gonio::basis
