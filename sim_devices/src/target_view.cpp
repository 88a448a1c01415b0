#include "target_view.h"

#include <fmt/format.h>

#include <algorithm>

#include "gonio/errors/errors.h"
#include "gonio/parallel/avx2.h"

namespace gonio::sim {
namespace {

/// What a loop over rays needs, out of matrices.
struct ViewNumbers {
  double turn[3][3];  // into the target's axes
  double eye[3];      // mm
  double missed;      // what is said of a ray that misses the plane's face
};

GONIO_INLINE void places_loop(const ViewNumbers& view, const TargetView::Rays& rays,
                              const TargetView::Places& places) {
  for (std::size_t i = 0; i < rays.count; ++i) {
    const double x = rays.x[i];
    const double y = rays.y[i];
    const double along_x = view.turn[0][0] * x + view.turn[0][1] * y + view.turn[0][2];
    const double along_y = view.turn[1][0] * x + view.turn[1][1] * y + view.turn[1][2];
    const double along_z = view.turn[2][0] * x + view.turn[2][1] * y + view.turn[2][2];
    const double way = -view.eye[2] / along_z;
    places.x_mm[i] = along_z < 0.0 ? view.eye[0] + way * along_x : view.missed;
    places.y_mm[i] = along_z < 0.0 ? view.eye[1] + way * along_y : view.missed;
  }
}

void find_places(const ViewNumbers& view, const TargetView::Rays& rays,
                 const TargetView::Places& places) {
  places_loop(view, rays, places);
}
#if GONIO_WITH_AVX2
GONIO_TARGET_AVX2 void find_places_avx2(const ViewNumbers& view, const TargetView::Rays& rays,
                                        const TargetView::Places& places) {
  places_loop(view, rays, places);
}
#endif

}  // namespace

TargetView::TargetView(const Scene& scene, devices::Target target,
                       const Eigen::Isometry3d& target_from_camera,
                       const Illumination& illumination, const LampImage& lamp_image)
    : scene_(scene),
      target_(target),
      from_camera_(target_from_camera.linear()),
      eye_(target_from_camera.translation()),
      illumination_(illumination),
      lamp_image_(lamp_image) {}

TargetView::Kind TargetView::kind_at(const Place& place, const Eigen::Vector3d& direction) const {
  if (place.x_mm == kMissed) return {};
  Kind kind{scene_.surface_at(place.x_mm, place.y_mm, target_), false};
  const PolishedOptions* const polish = scene_.surfaces()[kind.surface].polish;
  kind.shines = polish != nullptr && lamp_image_.seen({place.x_mm, place.y_mm, 0.0}, direction);
  return kind;
}

brdf::Rgb TargetView::radiance_at(const Place& place, const Eigen::Vector3d& direction) const {
  if (place.x_mm == kMissed) return brdf::Rgb::Zero();
  const Surface& surface = scene_.surfaces()[scene_.surface_at(place.x_mm, place.y_mm, target_)];
  if (surface.material == nullptr) return brdf::Rgb::Zero();
  const Eigen::Vector3d along = direction.normalized();
  brdf::Rgb radiance = brdf::Rgb::Zero();
  if (surface.polish != nullptr) {
    radiance += surface.polish->filter * lamp_image_.radiance() *
                lamp_image_.reflected({place.x_mm, place.y_mm, 0.0}, along, *surface.polish,
                                      target_ == devices::Target::black_glass);
  }
  const Illumination::Light light = illumination_.at(place.x_mm, place.y_mm);
  if (light.irradiance > 0.0) {
    radiance +=
        surface.material->evaluate(brdf::DirectionPair{light.wi, -along}) * light.irradiance;
  }
  if (!(radiance >= 0.0).all() || !radiance.isFinite().all()) {
    throw NumericalError(fmt::format(
        "simulated material: found a radiance of {}, {}, {} at ({:.3f}, {:.3f}) mm, expected "
        "zero or more",
        radiance[0], radiance[1], radiance[2], place.x_mm, place.y_mm));
  }
  return radiance;
}

void TargetView::places_along(const Rays& rays, const Places& places) const {
  if (eye_.z() <= 0.0) {
    std::fill_n(places.x_mm, rays.count, kMissed);
    std::fill_n(places.y_mm, rays.count, kMissed);
    std::fill_n(places.irradiance, rays.count, 0.0F);
    return;
  }
  ViewNumbers view{{}, {eye_.x(), eye_.y(), eye_.z()}, kMissed};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) view.turn[row][column] = from_camera_(row, column);
  }
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) {
    find_places_avx2(view, rays, places);
  } else {
    find_places(view, rays, places);
  }
#else
  find_places(view, rays, places);
#endif
  illumination_.irradiances({places.x_mm, places.y_mm, rays.count}, places.irradiance);
  for (std::size_t i = 0; i < rays.count; ++i) {
    if (places.x_mm[i] == kMissed) places.irradiance[i] = 0.0F;
  }
}

}  // namespace gonio::sim
