#include "gonio/render/sphere_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "develop.h"
#include "gonio/parallel/parallel.h"
#include "gonio/render/colour.h"
#include "gonio/render/lighting.h"
#include "percentile.h"
#include "sphere_layout.h"
#include "studio_sphere.h"
#include "view_geometry.h"

namespace gonio::render {
namespace {

constexpr double kLampIrradiance = 0.5;  // brighter lights are lamps, whose highlights need care
constexpr int kLampPoints = 3;           // per pixel and direction
constexpr std::size_t kRowBlock = 4;

struct PixelLight {
  ViewedLight viewed;
  double irradiance;
};

/// A pixel the sphere covers, and the normal at its middle.
struct LitPixel {
  std::size_t index;
  int x;
  int y;
  Eigen::Vector3d normal;
};

std::vector<PixelLight> lights_in_front(MetricLighting lighting) {
  std::vector<PixelLight> lights;
  for (const DirectionalLight& light : lights_of(lighting)) {
    // From straight behind nothing the viewer sees is lit, and there is no half vector.
    if (light.direction.z() < -0.999) continue;
    lights.push_back({ViewedLight(light.direction), light.irradiance});
  }
  return lights;
}

/// Adds one light at one point of the sphere to all pictures.
void add_light(std::span<const brdf::BrdfModel* const> models, const PixelLight& light,
               const Eigen::Vector3d& normal, double share, std::size_t pixel,
               std::vector<SpherePicture>& pictures) {
  const double cosine = normal.dot(light.viewed.direction);
  if (cosine <= 0.0) return;
  const brdf::ShadingGeometry geometry = geometry_at(normal, light.viewed);
  for (std::size_t i = 0; i < models.size(); ++i) {
    const brdf::Rgb radiance = models[i]->evaluate(geometry) * (cosine * light.irradiance * share);
    pictures[i].radiance[pixel] += radiance.cast<float>();
  }
}

void render_lights(std::span<const brdf::BrdfModel* const> models, MetricLighting lighting,
                   const SphereLayout& layout, std::vector<SpherePicture>& pictures) {
  const std::vector<PixelLight> lights = lights_in_front(lighting);
  const auto size = static_cast<std::size_t>(layout.size());
  parallel::for_each_block(0, size, kRowBlock, [&](std::size_t from, std::size_t to) {
    std::vector<LitPixel> lit;
    for (std::size_t pixel = from * size; pixel < to * size; ++pixel) {
      const int x = static_cast<int>(pixel % size);
      const int y = static_cast<int>(pixel / size);
      if (layout.coverage(x, y) > 0.0F)
        lit.push_back({pixel, x, y, layout.normal(x + 0.5, y + 0.5)});
    }
    // Lights outside, pixels inside: a light has one theta_d, so neighbours read the same part of a
    // table.
    for (const PixelLight& light : lights) {
      const bool lamp = light.irradiance > kLampIrradiance;
      for (const LitPixel& p : lit) {
        if (!lamp) {
          add_light(models, light, p.normal, 1.0, p.index, pictures);
          continue;
        }
        for (int point = 0; point < kLampPoints * kLampPoints; ++point) {
          const double dx = (point % kLampPoints + 0.5) / kLampPoints;
          const double dy = (point / kLampPoints + 0.5) / kLampPoints;
          add_light(models, light, layout.normal(p.x + dx, p.y + dy),
                    1.0 / (kLampPoints * kLampPoints), p.index, pictures);
        }
      }
    }
  });
}

}  // namespace

std::string_view to_string(PictureLighting lighting) {
  switch (lighting) {
    case PictureLighting::a:
      return "lighting A";
    case PictureLighting::b:
      return "lighting B";
    case PictureLighting::studio:
      break;
  }
  return "studio";
}

std::vector<SpherePicture> render_spheres(std::span<const brdf::BrdfModel* const> models,
                                          PictureLighting lighting, int size) {
  const SphereLayout layout(size);
  SpherePicture empty;
  empty.size = size;
  const auto area = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  empty.radiance.assign(area, Eigen::Array3f::Zero());
  empty.coverage.resize(area);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) empty.coverage[layout.index(x, y)] = layout.coverage(x, y);
  }
  std::vector<SpherePicture> pictures(models.size(), empty);
  if (models.empty()) return pictures;

  switch (lighting) {
    case PictureLighting::a:
      render_lights(models, MetricLighting::a, layout, pictures);
      break;
    case PictureLighting::b:
      render_lights(models, MetricLighting::b, layout, pictures);
      break;
    case PictureLighting::studio:
      render_studio(models, layout, pictures);
      break;
  }
  return pictures;
}

SpherePicture render_sphere(const brdf::BrdfModel& model, PictureLighting lighting, int size) {
  const std::array<const brdf::BrdfModel*, 1> models = {&model};
  return std::move(render_spheres(models, lighting, size).front());
}

double picture_exposure(const SpherePicture& reference, PictureLighting lighting,
                        brdf::RadiometricScale scale) {
  std::vector<double> values;
  for (std::size_t i = 0; i < reference.radiance.size(); ++i) {
    if (reference.coverage[i] < 1.0F) continue;
    for (const float value : reference.radiance[i]) values.push_back(double{value});
  }
  const double high = percentile(std::move(values), 0.9);
  constexpr double kHighGoesTo = 0.8;
  if (lighting != PictureLighting::studio) return high > 0.0 ? kHighGoesTo / high : 1.0;

  constexpr double kWhite = 0.75;
  constexpr double kMerlIsThird = 3.0;  // reconstruction on MERL's own scale (docs/conventions.md)
  constexpr double kMostAdaptation = 6.0;
  const double fixed = kWhite * (scale == brdf::RadiometricScale::merl ? kMerlIsThird : 1.0);
  if (high <= 0.0) return fixed;
  return fixed * std::clamp(std::sqrt(kHighGoesTo / (high * fixed)), 1.0 / kMostAdaptation,
                            kMostAdaptation);
}

Image develop(const SpherePicture& picture, double exposure) {
  Image image(picture.size, picture.size);
  for (int y = 0; y < picture.size; ++y) {
    for (int x = 0; x < picture.size; ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.size) +
                             static_cast<std::size_t>(x);
      if (picture.coverage[at] <= 0.0F) continue;
      const auto byte = [&](int channel) {
        const double linear = shown_linear(double{picture.radiance[at][channel]}, exposure);
        return static_cast<std::uint8_t>(std::lround(255.0 * srgb_encode(linear)));
      };
      image.at(x, y) = {byte(0), byte(1), byte(2),
                        static_cast<std::uint8_t>(std::lround(255.0F * picture.coverage[at]))};
    }
  }
  return image;
}

}  // namespace gonio::render
