#pragma once

#include <filesystem>

#include "gonio/basis/basis.h"
#include "gonio/files/atomic_file.h"

namespace gonio::basis {

/// HDF5, self-describing, readable by h5py (docs/formats.md).
void write_basis(const std::filesystem::path& path, const Basis& basis,
                 files::Overwrite overwrite = files::Overwrite::No);

/// Throws DataFormatError: not HDF5, a missing or wrongly shaped data set, non-finite values,
/// another lattice convention, an unknown scale or version.
Basis read_basis(const std::filesystem::path& path);

}  // namespace gonio::basis
