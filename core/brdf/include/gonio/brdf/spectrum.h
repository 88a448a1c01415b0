#pragma once

#include <Eigen/Core>
#include <span>

#include "gonio/brdf/brdf_model.h"

namespace gonio::brdf {

/// Turns a reflectance or BRDF known at some wavelengths into linear sRGB under D65.
///
/// rgb = weights(spectrum): the spectrum, linear between its wavelengths and constant beyond the
/// ends, times the illuminant D65 and the CIE 1931 2 deg observer, integrated from 380 to 780 nm,
/// to linear sRGB (IEC 61966-2-1) and scaled so that a spectrum of ones is exactly (1, 1, 1). D65
/// is the white of sRGB: the colours are those seen in daylight, and a grey stays grey. A saturated
/// colour may have a negative component.
///
/// Shape    3 x number of wavelengths.
/// Throws   std::invalid_argument for fewer than 2 wavelengths, wavelengths that do not ascend or
///          leave [200, 2500] nm, or that leave out 450 to 650 nm, where the colour is.
/// Source   CIE 15:2004, tables T.1 (D65) and T.4 (observer), at 10 nm.
Eigen::Matrix3Xd srgb_weights(std::span<const double> wavelengths_nm);

/// A smooth spectrum for each sRGB primary: columns such that srgb_weights() of their mixture gives
/// the mixed rgb back, and a grey has a flat spectrum. Among those the smoothest (least sum of
/// squared second differences), which may be negative for saturated colours.
///
/// Shape    number of wavelengths x 3.
Eigen::MatrixX3d smooth_spectra(std::span<const double> wavelengths_nm);

}  // namespace gonio::brdf
