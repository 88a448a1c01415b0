#pragma once

#include <filesystem>
#include <vector>

#include "gonio/brdf/scattered_brdf.h"

namespace gonio::brdf {

/// Reads a spectral goniometer measurement as Cornell University published them (`.brdf`): text,
/// '#' starts a comment; the number of wavelengths; the wavelengths in nm, ascending; then per
/// sample theta_i phi_i theta_o phi_o in rad (phi_o - phi_i = pi is the specular side) and a BRDF
/// value in 1/sr per wavelength. Lines may be broken anywhere.
///
/// Returns  The samples in linear sRGB under D65 (spectrum.h), SI, in file order. Components that
///          come out negative, by noise or because sRGB has no such colour, are 0.
/// Hostile  At most 64 MiB; numbers are checked one by one.
/// Throws   FileError when it cannot be opened or read; DataFormatError with "line N": a word that
///          is no finite number, a count out of range, wavelengths srgb_weights() refuses, angles
///          out of range, a negative BRDF below -1, a sample that breaks off, no sample at all.
std::vector<ScatteredValue> read_cornell(const std::filesystem::path& path);

}  // namespace gonio::brdf
