#include "gonio/render/metric_sphere.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gonio/parallel/parallel.h"

namespace gonio::render {
namespace {

using brdf::BrdfTable;
using brdf::IndexConvention;
using brdf::RadiometricScale;
using brdf::Rgb;

/// Same value everywhere, also below the horizon, so that no light is lost at the rim.
BrdfTable constant_table(const Rgb& per_sr) {
  BrdfTable table(IndexConvention::bin_centre, RadiometricScale::si);
  for (std::size_t cell = 0; cell < brdf::lattice::kCells; ++cell) table.set_value(cell, per_sr);
  return table;
}

TEST(Lighting, HasTheLightsOfTheDefinition) {
  const auto& a = lights_of(MetricLighting::a);
  const auto& b = lights_of(MetricLighting::b);
  ASSERT_EQ(a.size(), 164u);
  ASSERT_EQ(b.size(), 160u);
  for (const auto& light : a) EXPECT_NEAR(light.direction.norm(), 1.0, 1e-12);

  // Light 0 stands almost overhead: z = 1 - 1/160.
  EXPECT_NEAR(a[0].direction.y(), 0.99375, 1e-12);
  EXPECT_NEAR(a[0].irradiance, (0.35 + 0.65 * 0.99375) * std::numbers::pi / 40.0, 1e-12);
  EXPECT_NEAR(a[159].irradiance, 0.35 * std::numbers::pi / 40.0, 1e-12);  // from below
  EXPECT_NEAR(a[163].irradiance, 4.0, 1e-12);
  EXPECT_NEAR(a[163].direction.z() / a[163].direction.y(), -1.6, 1e-12);

  double bright = 0.0;
  for (const auto& light : b) bright += light.irradiance > 1.0 ? light.irradiance : 0.0;
  EXPECT_NEAR(bright, 6.0 * (2.5 + 0.3 * std::numbers::pi / 40.0), 1e-9);
  EXPECT_GT(b[93].irradiance, 2.5);
}

TEST(MetricSphere, HasThePixelsInsideTheRim) {
  const MetricSphere& sphere = MetricSphere::shared(MetricLighting::a, IndexConvention::bin_centre);
  // Area of the disc in pixels: 0.995 pi/4 96^2 = 7202; a lattice count differs by its edge.
  EXPECT_NEAR(static_cast<double>(sphere.pixel_count()), 0.995 * std::numbers::pi / 4.0 * 96 * 96,
              30.0);
}

TEST(MetricSphere, ShowsALambertianSphereAsItsIrradiance) {
  // Lighting B without its bright lights is even: E = 0.3 per sr from all around, so that a
  // Lambertian surface of albedo 1 has radiance 0.3 whichever way it faces. Checked by linearity:
  // the six lamps' share is added by hand at the pixel that looks at the viewer.
  const MetricSphere& sphere = MetricSphere::shared(MetricLighting::b, IndexConvention::bin_centre);
  const SphereRadiance picture =
      sphere.render(constant_table(Rgb(1.0, 0.5, 0.0) / std::numbers::pi));

  // Rows from the top: the centre of the disc is where half of the pixels are behind us.
  const auto centre = static_cast<Eigen::Index>(sphere.pixel_count() / 2 + 96 / 2);
  double expected = 0.3;
  for (const int i : {20, 78, 93, 96, 125, 155}) {
    const double z = lights_of(MetricLighting::b)[static_cast<std::size_t>(i)].direction.z();
    expected += 2.5 * std::max(z, 0.0) / std::numbers::pi;
  }
  constexpr double kFewLights = 0.02;  // 160 directions sample the cosine to a per cent or two
  EXPECT_NEAR(picture(0, centre), expected, kFewLights * expected);
  EXPECT_NEAR(picture(1, centre), expected / 2.0, kFewLights * expected);
  EXPECT_EQ(picture(2, centre), 0.0);
}

TEST(MetricSphere, ReadsTheHighlightWhereMirrorReflectionPutsIt) {
  // Only the cells of the smallest half angle shine: bright pixels have a lamp mirrored in them.
  BrdfTable table = constant_table(Rgb::Zero());
  for (int td = 0; td < 90; ++td) {
    for (int pd = 0; pd < 180; ++pd) {
      for (int th = 0; th < 20; ++th) {  // theta_h below 4.4 deg
        table.set_value(brdf::lattice::cell_from_index({th, td, pd}), Rgb::Ones());
      }
    }
  }
  const MetricSphere& sphere = MetricSphere::shared(MetricLighting::a, IndexConvention::bin_centre);
  const SphereRadiance picture = sphere.render(table);

  // Lamp 160 at (.5, .7, .5): its highlight has the normal half way to the viewer.
  const Eigen::Vector3d half =
      (lights_of(MetricLighting::a)[160].direction + Eigen::Vector3d::UnitZ()).normalized();
  std::size_t pixel = 0;
  double brightest = 0.0;
  double x_of_brightest = 0.0;
  double y_of_brightest = 0.0;
  for (int row = 0; row < 96; ++row) {
    for (int column = 0; column < 96; ++column) {
      const double x = -1.0 + (column + 0.5) / 48.0;
      const double y = 1.0 - (row + 0.5) / 48.0;
      if (x * x + y * y >= 0.995) continue;
      const double value = picture(0, static_cast<Eigen::Index>(pixel++));
      if (x > 0.0 && y > 0.0 && std::hypot(x, y) < 0.8 && value > brightest) {
        brightest = value;
        x_of_brightest = x;
        y_of_brightest = y;
      }
    }
  }
  ASSERT_EQ(pixel, sphere.pixel_count());
  constexpr double kLobe = 0.09;  // sin 4.4 deg and a pixel
  EXPECT_NEAR(x_of_brightest, half.x(), kLobe);
  EXPECT_NEAR(y_of_brightest, half.y(), kLobe);
}

/// Smooth, and different for phi_d and -phi_d but for reciprocity, which the lattice has built in.
Rgb skew(const brdf::HalfDiff& a) {
  const double tilt = sin(a.theta_h) * sin(a.theta_d);
  const double twice = 2.0 * a.phi_d.radians();
  return {1.0 + 0.8 * std::cos(twice) * tilt, 1.0 + 0.8 * std::sin(twice) * tilt, 0.5};
}

TEST(MetricSphere, AgreesWithPlainSumsForAMaterialOfAllAngles) {
  BrdfTable table(IndexConvention::bin_centre, RadiometricScale::si);
  for (std::size_t cell = 0; cell < brdf::lattice::kCells; ++cell) {
    table.set_value(cell, skew(brdf::lattice::angles_of(brdf::lattice::index_from_cell(cell))));
  }
  const SphereRadiance picture =
      MetricSphere::shared(MetricLighting::a, IndexConvention::bin_centre).render(table);
  constexpr double kHalfACell = 5e-3;  // half a degree of each angle, averaged over many lights
  std::size_t pixel = 0;
  int compared = 0;
  for (int row = 0; row < 96; ++row) {
    for (int column = 0; column < 96; ++column) {
      const double x = -1.0 + (column + 0.5) / 48.0;
      const double y = 1.0 - (row + 0.5) / 48.0;
      if (x * x + y * y >= 0.995) continue;
      const auto at = static_cast<Eigen::Index>(pixel++);
      if (at % 211 != 0) continue;
      const Eigen::Vector3d n(x, y, std::sqrt(1.0 - x * x - y * y));
      const Eigen::Vector3d t = Eigen::Vector3d(n.z(), 0.0, -n.x()).normalized();
      const Eigen::Vector3d b = n.cross(t);
      const Eigen::Vector3d wo = Eigen::Vector3d(t.z(), b.z(), n.z()).normalized();
      Rgb expected = Rgb::Zero();
      for (const DirectionalLight& light : lights_of(MetricLighting::a)) {
        const Eigen::Vector3d& d = light.direction;
        if (n.dot(d) <= 0.01) continue;
        const Eigen::Vector3d wi = Eigen::Vector3d(t.dot(d), b.dot(d), n.dot(d)).normalized();
        expected += skew(brdf::half_diff_from_directions({wi, wo})) * (wi.z() * light.irradiance);
      }
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(picture(c, at), expected[c], kHalfACell * expected[c]) << x << ' ' << y;
      }
      ++compared;
    }
  }
  EXPECT_GT(compared, 30);
}

TEST(MetricSphere, LeavesACellThatIsInvalidInEitherOutOfBoth) {
  const BrdfTable whole = constant_table(Rgb::Ones());
  BrdfTable holes = constant_table(Rgb::Ones());
  for (std::size_t cell = 0; cell < brdf::lattice::kCells; cell += 3) holes.set_invalid(cell);
  const MetricSphere& sphere = MetricSphere::shared(MetricLighting::a, IndexConvention::bin_centre);
  const auto [first, second] = sphere.render_pair(whole, holes);
  EXPECT_TRUE((first == second).all());
  EXPECT_LT(first.sum(), sphere.render(whole).sum());
}

TEST(MetricSphere, IsTheSameWithOneThreadAndTwo) {
  const BrdfTable table = constant_table(Rgb(0.1, 0.2, 0.3));
  parallel::set_thread_count(1);
  const SphereRadiance one =
      MetricSphere(MetricLighting::a, IndexConvention::bin_centre).render(table);
  parallel::set_thread_count(2);
  const SphereRadiance two =
      MetricSphere(MetricLighting::a, IndexConvention::bin_centre).render(table);
  parallel::set_thread_count(0);
  EXPECT_TRUE((one == two).all());
}

TEST(MetricSphere, RefusesATableOfAnotherConvention) {
  const BrdfTable table(IndexConvention::dtu, RadiometricScale::si);
  const MetricSphere& sphere = MetricSphere::shared(MetricLighting::a, IndexConvention::bin_centre);
  EXPECT_THROW(sphere.render(table), std::invalid_argument);
}

TEST(MetricExposure, BringsTheNinetiethPercentileToFourFifths) {
  SphereRadiance picture(3, 7);  // 21 values: rank 18 of 0..20 is the 90th percentile
  for (Eigen::Index i = 0; i < picture.size(); ++i) picture(i) = static_cast<double>(20 - i);
  EXPECT_DOUBLE_EQ(metric_exposure(picture), 0.8 / 18.0);
  EXPECT_EQ(metric_exposure(SphereRadiance::Zero(3, 5)), 1.0);
}

TEST(MetricDisplay, ClipsAndEncodes) {
  SphereRadiance picture(3, 1);
  picture << 0.25, 4.0, 0.0;
  const SphereRadiance shown = metric_display(picture, 2.0);
  EXPECT_NEAR(shown(0), 0.729740, 1e-6);  // 0.5^(1/2.2)
  EXPECT_EQ(shown(1), 1.0);
  EXPECT_EQ(shown(2), 0.0);
}

}  // namespace
}  // namespace gonio::render
