#pragma once

#include <string>

namespace gonio::cli {

/// A ready scene: a sphere of the measured material on a grey floor under a soft sky and one lamp.
///
/// `bsdf_name`   File name of the `.bsdf` beside the scene.
/// `image_name`  What the renderer is to write.
/// Throws        UsageError for a name the scene's syntax cannot hold (control characters, quotes).
///
/// Mitsuba 3: XML, plugin `measured`; that one interpolates spectra, so a spectral variant is
/// needed. pbrt-v4: material "measured".
std::string mitsuba_scene(const std::string& bsdf_name);
std::string pbrt_scene(const std::string& bsdf_name, const std::string& image_name);

}  // namespace gonio::cli
