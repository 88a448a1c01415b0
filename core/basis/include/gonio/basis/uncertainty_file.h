#pragma once

#include <filesystem>
#include <string>

#include "gonio/basis/uncertainty.h"
#include "gonio/files/atomic_file.h"

namespace gonio::basis {

/// `X.uncertainty.h5` for `X.binary`; for any other name `.uncertainty.h5` is appended.
std::filesystem::path uncertainty_path(const std::filesystem::path& binary);

/// Writes the limits of every cell as HDF5: self-describing, readable by h5py (docs/formats.md),
/// the same bytes for the same fit. 70 MB.
///
/// `brdf_sha256`  Of the `.binary` file the limits belong to, so that a pair that does not belong
///                together is found out; 64 lower-case hexadecimal digits.
/// Throws   FileError when it cannot be written or stands there and may not be replaced; nothing is
///          left under `path` then. std::invalid_argument when the parts do not fit
///          together or the sum is none.
/// Threads  Any; HDF5 is entered by one at a time.
void write_uncertainty(const std::filesystem::path& path, const Basis& basis, const Fit& fit,
                       const Uncertainty& uncertainty, const std::string& brdf_sha256,
                       files::Overwrite overwrite = files::Overwrite::No);

}  // namespace gonio::basis
