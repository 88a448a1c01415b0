#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/render/image.h"

namespace gonio::render {

/// Light for pictures that people look at: the two metric lightings, and a studio with area lights
/// (studio.h), in which a material looks as one is used to.
enum class PictureLighting { a, b, studio };

std::string_view to_string(PictureLighting lighting);  ///< "lighting A", "lighting B", "studio"

/// A sphere in linear light, before exposure. Pictures for people: quoted errors come from
/// MetricSphere.
struct SpherePicture {
  int size = 0;                          ///< pixels along an edge; the sphere leaves 1 px of margin
  std::vector<Eigen::Array3f> radiance;  ///< size x size from the top left; 0 outside the sphere
  std::vector<float> coverage;           ///< in [0, 1]: how much of the pixel the sphere covers
};

/// Renders one orthographic unit sphere, seen along z, per model; all under the same light, sharing
/// its geometry, so two cost little more than one.
///
/// Lighting A, B  All directional lights at every pixel, lamps at 3 x 3 points per pixel.
/// Studio         Deterministic quadrature over half vectors, denser where the first two models
///                reflect most, each sample reading the studio averaged over its own solid angle:
///                no noise at any roughness.
///
/// `size`    In [16, 4096].
/// Threads   Uses all; the same picture with any number of them.
/// Time      256 x 256 on two cores: about 0.3 s under A or B, 0.2 s in the studio.
std::vector<SpherePicture> render_spheres(std::span<const brdf::BrdfModel* const> models,
                                          PictureLighting lighting, int size);
SpherePicture render_sphere(const brdf::BrdfModel& model, PictureLighting lighting, int size);

/// How brightly to show a picture. A and B: as the metric, the 90th percentile of the values goes
/// to 0.8. Studio: half of the way from a fixed exposure, under which a white sphere is just below
/// white, to that one: dark materials stay dark but can be seen. Take it from the reference
/// and use it for every picture beside it.
double picture_exposure(const SpherePicture& reference, PictureLighting lighting,
                        brdf::RadiometricScale scale);

/// Exposes, rolls highlights off softly above 0.75 instead of clipping them, encodes as sRGB; alpha
/// is the coverage.
Image develop(const SpherePicture& picture, double exposure);

}  // namespace gonio::render
