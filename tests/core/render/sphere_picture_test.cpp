#include "gonio/render/sphere_picture.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gonio/parallel/parallel.h"
#include "gonio/render/lighting.h"
#include "gonio/render/studio.h"

namespace gonio::render {
namespace {

using brdf::BrdfModel;
using brdf::Rgb;
using brdf::ShadingGeometry;

constexpr int kSize = 64;

class White final : public BrdfModel {
  Rgb evaluate_visible(const ShadingGeometry&) const override {
    return Rgb::Constant(1.0 / std::numbers::pi);
  }
};

/// A lobe around mirror reflection, `width` in radians of the half angle.
class Lobe final : public BrdfModel {
 public:
  explicit Lobe(double width) : width_(width) {}

 private:
  Rgb evaluate_visible(const ShadingGeometry& g) const override {
    const double t = g.half_diff.theta_h.radians() / width_;
    return Rgb(1.0, 0.6, 0.3) * std::exp(-t * t);
  }
  double width_;
};

/// Changes with all three angles, and differently for phi_d and -phi_d.
class Skew final : public BrdfModel {
  Rgb evaluate_visible(const ShadingGeometry& g) const override {
    const double tilt = g.sin_theta_h * g.sin_theta_d;
    return Rgb(1.0 + 0.8 * g.cos_phi_d * tilt, 1.0 + 0.8 * g.sin_phi_d * tilt,
               1.0 + std::sin(g.half_diff.phi_d.radians() + g.half_diff.theta_h.radians()) * tilt);
  }
};

Eigen::Vector3d normal_of_pixel(int x, int y) {
  const double radius = kSize / 2.0 - 1.0;
  const double px = (x + 0.5 - kSize / 2.0) / radius;
  const double py = (kSize / 2.0 - y - 0.5) / radius;
  return {px, py, std::sqrt(1.0 - px * px - py * py)};
}

const Eigen::Array3f& pixel(const SpherePicture& picture, int x, int y) {
  return picture.radiance[static_cast<std::size_t>(y * picture.size + x)];
}

/// A right-handed frame on the surface: the pair as the material sees it.
brdf::DirectionPair on_surface(const Eigen::Vector3d& wi, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d t = Eigen::Vector3d(normal.z(), 0.0, -normal.x()).normalized();
  const Eigen::Vector3d b = normal.cross(t);
  return {Eigen::Vector3d(t.dot(wi), b.dot(wi), normal.dot(wi)).normalized(),
          Eigen::Vector3d(t.z(), b.z(), normal.z()).normalized()};
}

/// The studio's light reflected at one point, by plain midpoint sums over all directions.
Rgb reflected_studio(const BrdfModel& model, const Eigen::Vector3d& normal) {
  constexpr int kPolar = 360;
  Rgb sum = Rgb::Zero();
  const double step = std::numbers::pi / kPolar;
  for (int i = 0; i < kPolar; ++i) {
    const double theta = (i + 0.5) * step;
    for (int j = 0; j < 2 * kPolar; ++j) {
      const double phi = (j + 0.5) * step;
      const Eigen::Vector3d wi(std::sin(theta) * std::cos(phi), std::cos(theta),
                               std::sin(theta) * std::sin(phi));
      const double cosine = wi.dot(normal);
      if (cosine <= 0.0) continue;
      sum += model.evaluate(on_surface(wi, normal)) * studio_radiance(wi) *
             (cosine * std::sin(theta) * step * step);
    }
  }
  return sum;
}

TEST(StudioSphere, AgreesWithPlainIntegrationForAWhiteSphere) {
  const White white;
  const SpherePicture picture = render_sphere(white, PictureLighting::studio, kSize);
  constexpr double kQuadrature = 0.015;  // relative, of some 2,000 half vectors
  for (const auto& [x, y] : {std::pair{32, 32}, {20, 14}, {50, 30}, {30, 55}}) {
    const Rgb expected = reflected_studio(white, normal_of_pixel(x, y));
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(pixel(picture, x, y)[c], expected[c], kQuadrature * expected[c]) << x << ' ' << y;
    }
  }
}

TEST(StudioSphere, AgreesWithPlainIntegrationForAGlossySphere) {
  const Lobe lobe(0.12);  // 7 deg
  const SpherePicture picture = render_sphere(lobe, PictureLighting::studio, kSize);
  constexpr double kQuadrature = 0.04;
  for (const auto& [x, y] : {std::pair{32, 32}, {22, 20}, {44, 26}, {30, 50}}) {
    const Rgb expected = reflected_studio(lobe, normal_of_pixel(x, y));
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(pixel(picture, x, y)[c], expected[c], kQuadrature * expected[c]) << x << ' ' << y;
    }
  }
}

TEST(StudioSphere, AgreesWithPlainIntegrationForAModelOfAllAngles) {
  const Skew skew;
  const SpherePicture picture = render_sphere(skew, PictureLighting::studio, kSize);
  constexpr double kQuadrature = 0.02;
  for (const auto& [x, y] : {std::pair{20, 14}, {50, 36}}) {
    const Rgb expected = reflected_studio(skew, normal_of_pixel(x, y));
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(pixel(picture, x, y)[c], expected[c], kQuadrature * expected[c]) << x << ' ' << y;
    }
  }
}

TEST(LampSphere, AgreesWithPlainSumsForAModelOfAllAngles) {
  const Skew skew;
  const SpherePicture picture = render_sphere(skew, PictureLighting::b, kSize);
  constexpr double kLampPoints = 2e-3;  // lamps are averaged over the pixel, not so here
  for (const auto& [x, y] : {std::pair{20, 14}, {50, 36}, {32, 50}}) {
    const Eigen::Vector3d normal = normal_of_pixel(x, y);
    Rgb expected = Rgb::Zero();
    for (const DirectionalLight& light : lights_of(MetricLighting::b)) {
      const double cosine = normal.dot(light.direction);
      if (cosine <= 0.0) continue;
      expected += skew.evaluate(on_surface(light.direction, normal)) * (cosine * light.irradiance);
    }
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(pixel(picture, x, y)[c], expected[c], kLampPoints * expected[c]) << x << ' ' << y;
    }
  }
}

TEST(StudioSphere, ShowsTheSoftboxMirroredWhereItStands) {
  // A sharp lobe: brightest in the upper left, where the normal is half way to the softbox.
  const SpherePicture picture = render_sphere(Lobe(0.01), PictureLighting::studio, kSize);
  const Eigen::Vector3d softbox = Eigen::Vector3d(-0.62, 0.62, 0.60).normalized();
  const Eigen::Vector3d half = (softbox + Eigen::Vector3d::UnitZ()).normalized();
  const int x = static_cast<int>(kSize / 2.0 + half.x() * (kSize / 2.0 - 1.0));
  const int y = static_cast<int>(kSize / 2.0 - half.y() * (kSize / 2.0 - 1.0));
  EXPECT_GT(pixel(picture, x, y)[0], 5.0F * pixel(picture, x, kSize - 1 - y)[0]);
  EXPECT_GT(pixel(picture, x, y)[0], 2.0F * pixel(picture, kSize / 2, kSize / 2)[0]);
}

TEST(Studio, KeepsItsLightWhenAveraged) {
  // The mean over all directions does not depend on the width, but for the bend of the panels.
  constexpr double kBend = 0.06;
  const auto mean = [](double width) {
    Eigen::Array3d sum = Eigen::Array3d::Zero();
    constexpr int kDirections = 60'000;
    for (int i = 0; i < kDirections; ++i) {
      const double y = 1.0 - (2.0 * i + 1.0) / kDirections;
      const double r = std::sqrt(1.0 - y * y);
      sum += studio_radiance({r * std::cos(2.399963 * i), y, r * std::sin(2.399963 * i)}, width);
    }
    return Eigen::Array3d(sum / kDirections);
  };
  const Eigen::Array3d sharp = mean(0.0);
  for (const double width : {0.05, 0.2, 0.4}) {
    EXPECT_LT(((mean(width) - sharp) / sharp).abs().maxCoeff(), kBend) << width;
  }
}

TEST(LampSphere, AddsUpTheLightsAtThePointThatFacesTheViewer) {
  const White white;
  const SpherePicture picture = render_sphere(white, PictureLighting::a, 65);
  double expected = 0.0;  // pixel (32, 32) of 65 has its centre on the axis: normal (0, 0, 1)
  for (const DirectionalLight& light : lights_of(MetricLighting::a)) {
    expected += std::max(0.0, light.direction.z()) * light.irradiance / std::numbers::pi;
  }
  constexpr double kLampPoints = 1e-3;  // lamps are averaged over the pixel, the rest is not
  EXPECT_NEAR(pixel(picture, 32, 32)[0], expected, kLampPoints * expected);
}

TEST(SpherePictures, OfTwoModelsAreThoseOfEachAlone) {
  const White white;
  const Lobe lobe(0.3);
  const std::array<const BrdfModel*, 2> both = {&white, &lobe};
  for (const PictureLighting lighting : {PictureLighting::a, PictureLighting::b}) {
    const auto pictures = render_spheres(both, lighting, kSize);
    const SpherePicture alone = render_sphere(lobe, lighting, kSize);
    ASSERT_EQ(pictures.size(), 2u);
    for (std::size_t i = 0; i < alone.radiance.size(); ++i) {
      ASSERT_TRUE((pictures[1].radiance[i] == alone.radiance[i]).all());
    }
  }
}

TEST(SpherePictures, AreTheSameWithOneThreadAndTwo) {
  const Lobe lobe(0.2);
  for (const PictureLighting lighting : {PictureLighting::a, PictureLighting::studio}) {
    parallel::set_thread_count(1);
    const SpherePicture one = render_sphere(lobe, lighting, kSize);
    parallel::set_thread_count(2);
    const SpherePicture two = render_sphere(lobe, lighting, kSize);
    parallel::set_thread_count(0);
    for (std::size_t i = 0; i < one.radiance.size(); ++i) {
      ASSERT_TRUE((one.radiance[i] == two.radiance[i]).all());
    }
  }
}

TEST(SpherePictures, FillTheDiscWithASmoothRim) {
  const SpherePicture picture = render_sphere(White(), PictureLighting::b, kSize);
  double area = 0.0;
  for (const float c : picture.coverage) area += double{c};
  EXPECT_NEAR(area, std::numbers::pi * 31.0 * 31.0, 4.0);
  EXPECT_EQ(picture.coverage[0], 0.0F);
  EXPECT_EQ(develop(picture, 1.0).at(0, 0).a, 0);
  EXPECT_EQ(develop(picture, 1.0).at(32, 32).a, 255);
}

TEST(SpherePictures, RefuseAbsurdSizes) {
  EXPECT_THROW(render_sphere(White(), PictureLighting::a, 15), std::invalid_argument);
  EXPECT_THROW(render_sphere(White(), PictureLighting::studio, 5000), std::invalid_argument);
}

TEST(Develop, KeepsOrderAndNeverClipsHard) {
  SpherePicture picture;
  picture.size = 16;
  picture.radiance.assign(256, Eigen::Array3f::Zero());
  picture.coverage.assign(256, 1.0F);
  for (int i = 0; i < 256; ++i) {
    picture.radiance[static_cast<std::size_t>(i)] = Eigen::Array3f::Constant(0.01F * float(i));
  }
  const Image image = develop(picture, 1.0);
  for (int i = 1; i < 256; ++i) {
    EXPECT_GE(image.at(i % 16, i / 16).r, image.at((i - 1) % 16, (i - 1) / 16).r);
  }
  EXPECT_EQ(image.at(2, 3).r, 188);  // 0.5 is linear below the shoulder: sRGB 188
  EXPECT_LT(image.at(4, 6).r, 255);  // exactly 1.0 still has room above it
}

TEST(PictureExposure, LeavesDarkMaterialsDarker) {
  SpherePicture dark;
  dark.size = 16;
  dark.coverage.assign(256, 1.0F);
  dark.radiance.assign(256, Eigen::Array3f::Constant(0.04F));
  SpherePicture bright = dark;
  for (auto& value : bright.radiance) value *= 20.0F;
  const auto shown = [](const SpherePicture& p) {
    const double exposure =
        picture_exposure(p, PictureLighting::studio, brdf::RadiometricScale::si);
    return double{p.radiance[0][0]} * exposure;
  };
  EXPECT_LT(shown(dark), shown(bright));
  EXPECT_NEAR(0.04 * picture_exposure(dark, PictureLighting::a, brdf::RadiometricScale::si), 0.8,
              1e-6);
}

}  // namespace
}  // namespace gonio::render
