#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "gonio/brdf/analytic_models.h"
#include "gonio/brdf/rgl_file.h"
#include "gonio/errors/errors.h"
#include "plain_rgl_reader.h"
#include "temporary_folder.h"

namespace gonio::brdf {
namespace {

using testing::PlainRglReader;

/// A rough gold lobe on a base that is not bilateral: sharp and odd at once.
const Mixture& lobe_and_base() {
  static const Mixture model(
      {{Rgb::Constant(0.5),
        std::make_shared<Ggx>(0.25, RefractiveIndex{Rgb(0.2, 0.5, 1.4), Rgb(3.1, 2.4, 1.9)})},
       {Rgb::Constant(1.0), std::make_shared<NonBilateral>()}});
  return model;
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class WriteRgl : public ::testing::Test {
 protected:
  TemporaryFolder folder;
  std::filesystem::path path = folder.path() / "a.bsdf";
};

/// Largest relative difference from the model over directions up to 75 deg, read by `f`.
template <class Read>
double worst_error(const Read& f) {
  double worst = 0.0;
  for (const double theta_i : {4.0, 25.0, 50.0, 72.0}) {
    for (const double theta_o : {2.0, 24.0, 49.0, 73.0}) {
      for (const double phi : {-150.0, -60.0, 20.0, 110.0, 170.0}) {
        const DirectionPair pair{direction(Angle::from_degrees(theta_i), Angle()),
                                 direction(Angle::from_degrees(theta_o), Angle::from_degrees(phi))};
        const Rgb truth = lobe_and_base().evaluate(pair);
        const Rgb found = f(pair);
        worst = std::max(worst, ((found - truth) / truth).abs().maxCoeff());
      }
    }
  }
  return worst;
}

/// Interpolation between lights 3 deg apart and on a warped grid of 64 x 64.
constexpr double kBetweenLights = 0.03;

TEST_F(WriteRgl, IsReadBackByAnIndependentReader) {
  write_rgl(path, rgl_tables(lobe_and_base(), "odd gold"));
  const PlainRglReader reader(path.string());
  EXPECT_LT(worst_error([&](const DirectionPair& pair) {
              Rgb f;
              for (std::size_t channel = 0; channel < 3; ++channel) {
                f[static_cast<Eigen::Index>(channel)] =
                    reader.f_cos_theta_o("rgb", channel, std::acos(pair.wi.z()), pair.wo) /
                    pair.wo.z();
              }
              return f;
            }),
            kBetweenLights);
  EXPECT_EQ(std::string(reader.fields.at("description").raw.begin(),
                        reader.fields.at("description").raw.end()),
            "odd gold");
}

TEST_F(WriteRgl, IsReadBackByOurOwn) {
  write_rgl(path, rgl_tables(lobe_and_base(), "odd gold"));
  const RglTables tables = read_rgl(path);
  EXPECT_EQ(tables.description, "odd gold");
  const RglBrdf brdf(tables);
  EXPECT_LT(worst_error([&](const DirectionPair& pair) { return brdf.evaluate(pair); }),
            kBetweenLights);
  EXPECT_LT(worst_error([&](const DirectionPair& pair) { return brdf.one_way(pair); }),
            kBetweenLights);
}

TEST_F(WriteRgl, GivesTheSameBytesForWhatWasRead) {
  write_rgl(path, rgl_tables(lobe_and_base(), "odd gold"));
  write_rgl(folder.path() / "b.bsdf", read_rgl(path));
  EXPECT_TRUE(bytes_of(path) == bytes_of(folder.path() / "b.bsdf"));
}

TEST_F(WriteRgl, HoldsWhatRenderersAskFor) {
  // Shapes and types that Mitsuba 3 and pbrt-v4 check when they load a measured material.
  write_rgl(path, rgl_tables(lobe_and_base(), ""));
  const PlainRglReader reader(path.string());
  const auto shape = [&](const char* name) { return reader.fields.at(name).shape; };
  const std::uint64_t lights = shape("theta_i").at(0);
  const std::uint64_t wavelengths = shape("wavelengths").at(0);
  EXPECT_EQ(reader.fields.at("description").type, 1);
  EXPECT_GE(shape("description").at(0), 1u);
  EXPECT_THAT(shape("phi_i"), ::testing::ElementsAre(1));
  EXPECT_EQ(shape("ndf").size(), 2u);
  EXPECT_EQ(shape("sigma").size(), 2u);
  ASSERT_EQ(shape("vndf").size(), 4u);
  EXPECT_EQ(shape("vndf")[0], 1u);
  EXPECT_EQ(shape("vndf")[1], lights);
  const std::uint64_t side = shape("luminance").at(2);
  EXPECT_THAT(shape("luminance"), ::testing::ElementsAre(1, lights, side, side));
  EXPECT_THAT(shape("spectra"), ::testing::ElementsAre(1, lights, wavelengths, side, side));
  EXPECT_THAT(shape("jacobian"), ::testing::ElementsAre(1));
  EXPECT_THAT(reader.fields.at("jacobian").raw, ::testing::ElementsAre(1));
  for (const char* name : {"luminance", "vndf", "sigma"}) {
    EXPECT_THAT(reader.fields.at(name).numbers, ::testing::Each(::testing::Ge(0.0f))) << name;
  }
  EXPECT_THAT(reader.fields.at("luminance").numbers, ::testing::Each(::testing::Gt(0.0f)));
  EXPECT_THAT(reader.fields.at("spectra").numbers, ::testing::Each(::testing::Ge(0.0f)));
}

TEST_F(WriteRgl, GivesAGreyMaterialAFlatSpectrum) {
  write_rgl(path, rgl_tables(Lambertian(Rgb::Constant(0.6)), "grey"));
  const PlainRglReader reader(path.string());
  const Eigen::Vector3d wo = direction(Angle::from_degrees(30.0), Angle::from_degrees(70.0));
  for (const std::size_t wavelength : {0u, 13u, 30u}) {
    EXPECT_NEAR(reader.f_cos_theta_o("spectra", wavelength, 0.4, wo) / wo.z(),
                0.6 / std::numbers::pi, 0.002);
  }
}

TEST_F(WriteRgl, DoesNotReplaceAFileUnasked) {
  std::ofstream(path) << "precious";
  const RglTables tables = rgl_tables(Lambertian(Rgb::Constant(0.6)), "grey");
  EXPECT_THROW(write_rgl(path, tables), FileError);
  EXPECT_EQ(bytes_of(path), "precious");
  RglTables broken = tables;
  broken.theta_i_rad[3] = broken.theta_i_rad[2];
  EXPECT_THROW(write_rgl(path, broken, files::Overwrite::Yes), std::invalid_argument);
  EXPECT_EQ(bytes_of(path), "precious");
}

}  // namespace
}  // namespace gonio::brdf
