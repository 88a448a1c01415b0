#include "illumination.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "gonio/parallel/avx2.h"

namespace gonio::sim {
namespace {

constexpr double kSquareMmInSquareM = 1e6;

/// What a loop over points needs, out of matrices.
struct LightNumbers {
  double x, y, z;     // the lamp's place, mm
  double turn[3][3];  // into the lamp's axes
  double field[5];
  double distance;  // collimated: of the rig's centre, mm
  double cosine;    // collimated: of the angle of incidence
};

template <bool kCollimated>
GONIO_INLINE void irradiance_loop(const LightNumbers& lamp, const Illumination::Points& points,
                                  float* out) {
  for (std::size_t i = 0; i < points.count; ++i) {
    const double from_x = points.x_mm[i] - lamp.x;
    const double from_y = points.y_mm[i] - lamp.y;
    const double from_z = -lamp.z;
    const double ahead =
        lamp.turn[2][0] * from_x + lamp.turn[2][1] * from_y + lamp.turn[2][2] * from_z;
    const double across_x =
        lamp.turn[0][0] * from_x + lamp.turn[0][1] * from_y + lamp.turn[0][2] * from_z;
    const double across_y =
        lamp.turn[1][0] * from_x + lamp.turn[1][1] * from_y + lamp.turn[1][2] * from_z;
    double square_mm = lamp.distance * lamp.distance;
    double cosine = lamp.cosine;
    // A collimated beam's profile goes by place, measured as the angle it has at the rig's centre.
    double depth = lamp.distance;
    if constexpr (!kCollimated) {
      square_mm = from_x * from_x + from_y * from_y + from_z * from_z;
      cosine = lamp.z / std::sqrt(square_mm);
      depth = ahead;
    }
    const double x = across_x / depth;
    const double y = across_y / depth;
    const double field = 1.0 + lamp.field[0] * x + lamp.field[1] * y + lamp.field[2] * x * x +
                         lamp.field[3] * x * y + lamp.field[4] * y * y;
    const double shape = field > 0.0 ? field : 0.0;
    const double facing = cosine > 0.0 ? cosine : 0.0;
    const double falls = shape * facing * kSquareMmInSquareM / square_mm;
    out[i] = static_cast<float>(ahead > 0.0 ? falls : 0.0);
  }
}

void spread(bool collimated, const LightNumbers& lamp, const Illumination::Points& points,
            float* out) {
  if (collimated) return irradiance_loop<true>(lamp, points, out);
  irradiance_loop<false>(lamp, points, out);
}
#if GONIO_WITH_AVX2
GONIO_TARGET_AVX2 void spread_avx2(bool collimated, const LightNumbers& lamp,
                                   const Illumination::Points& points, float* out) {
  if (collimated) return irradiance_loop<true>(lamp, points, out);
  irradiance_loop<false>(lamp, points, out);
}
#endif

}  // namespace

Illumination::Illumination(const rig::RigPose& pose, const Eigen::Isometry3d& target_from_world,
                           const LampOptions& lamp, double lamp_distance_mm)
    : lamp_((target_from_world * pose.world_from_lamp).translation()),
      into_lamp_((target_from_world * pose.world_from_lamp).linear().transpose()),
      field_(lamp.field),
      collimated_(pose.collimated_lamp),
      lamp_distance_mm_(lamp_distance_mm) {}

Illumination::Light Illumination::at(double x_mm, double y_mm) const {
  const Eigen::Vector3d to_lamp = lamp_ - Eigen::Vector3d(x_mm, y_mm, 0.0);
  Light light;
  light.wi = collimated_ ? Eigen::Vector3d(-into_lamp_.row(2)) : to_lamp.normalized();
  float irradiance = 0.0F;
  irradiances({&x_mm, &y_mm, 1}, &irradiance);
  light.irradiance = irradiance;
  return light;
}

void Illumination::irradiances(const Points& points, float* w_per_m2) const {
  LightNumbers lamp{lamp_.x(), lamp_.y(), lamp_.z(), {}, {}, lamp_distance_mm_, -into_lamp_(2, 2)};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) lamp.turn[row][column] = into_lamp_(row, column);
  }
  std::copy(field_.begin(), field_.end(), lamp.field);
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) return spread_avx2(collimated_, lamp, points, w_per_m2);
#endif
  spread(collimated_, lamp, points, w_per_m2);
}

}  // namespace gonio::sim
