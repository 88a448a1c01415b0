#include "gonio/brdf/rgl_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "gonio/brdf/material_file.h"
#include "gonio/errors/errors.h"
#include "scratch_file.h"
#include "tensor_bytes.h"

namespace gonio::brdf {
namespace {

using ::testing::HasSubstr;
using testing::ScratchFile;
using testing::TensorBytes;

/// Tables are single precision numbers near 1.
constexpr double kFloatRounding = 2e-6;
constexpr std::size_t kAngles = 3;
constexpr std::size_t kNodes = 5;

using PlaneFunction =
    std::function<float(std::size_t slice, std::size_t channel, double u, double v)>;

std::vector<float> plane_values(std::size_t slices, std::size_t channels, std::size_t height,
                                std::size_t width, const PlaneFunction& function) {
  std::vector<float> values;
  for (std::size_t slice = 0; slice < slices; ++slice) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      for (std::size_t row = 0; row < height; ++row) {
        for (std::size_t i = 0; i < width; ++i) {
          values.push_back(function(slice, channel,
                                    static_cast<double>(i) / static_cast<double>(width - 1),
                                    static_cast<double>(row) / static_cast<double>(height - 1)));
        }
      }
    }
  }
  return values;
}

/// A material whose warp is the identity and whose factor ndf / (4 sigma) is 1: the rgb table is
/// f cos theta_o itself at (u_theta, u_phi) of the half vector.
TensorBytes plain_file(const PlaneFunction& rgb) {
  const std::vector<float> theta = {0.0f, 0.7f, 1.5707964f};
  TensorBytes file;
  file.add<std::uint8_t>("description", 1, {4}, {'t', 'e', 's', 't'});
  file.floats("phi_i", {1}, {0.0f});
  file.floats("theta_i", {kAngles}, theta);
  file.floats("ndf", {2, kNodes}, std::vector<float>(2 * kNodes, 1.0f));
  file.floats("sigma", {2, kNodes}, std::vector<float>(2 * kNodes, 0.25f));
  file.floats("vndf", {1, kAngles, kNodes, kNodes},
              std::vector<float>(kAngles * kNodes * kNodes, 3.0f));
  file.floats("rgb", {1, kAngles, 3, kNodes, kNodes},
              plane_values(kAngles, 3, kNodes, kNodes, rgb));
  file.add<std::uint8_t>("jacobian", 1, {1}, {1});
  return file;
}

TensorBytes constant_file() {
  return plain_file([](std::size_t, std::size_t, double, double) { return 0.1f; });
}

RglBrdf read_back(const TensorBytes& file) {
  const ScratchFile scratch("material.bsdf", file.str());
  return RglBrdf(read_rgl(scratch.path()));
}

/// The pair whose half vector stands at theta_m and `phi` from the light's azimuth.
DirectionPair pair_of(Angle theta_i, Angle phi_i, Angle theta_m, Angle phi) {
  const Eigen::Vector3d wi = direction(theta_i, phi_i);
  const Eigen::Vector3d m = direction(theta_m, phi_i + phi);
  return {wi, (2.0 * wi.dot(m) * m - wi).normalized()};
}

TEST(RglFile, HoldsTheBrdfTimesTheCosineOfTheDetector) {
  const RglBrdf brdf = read_back(constant_file());
  for (const double theta_o : {10.0, 45.0, 70.0}) {
    const DirectionPair pair{direction(Angle::from_degrees(30.0), Angle()),
                             direction(Angle::from_degrees(theta_o), Angle::from_degrees(77.0))};
    EXPECT_NEAR(brdf.one_way(pair).x() * std::cos(theta_o * std::numbers::pi / 180.0), 0.1,
                kFloatRounding);
  }
}

TEST(RglFile, CountsTheAzimuthFromTheLightCounterClockwise) {
  // Not bilateral: a wrong sign of phi or a swap of wi and wo shows.
  const RglBrdf brdf = read_back(plain_file([](std::size_t, std::size_t channel, double, double v) {
    return static_cast<float>(v * static_cast<double>(channel + 1));
  }));
  for (const double phi_i : {0.0, 100.0, -130.0}) {
    for (const double phi : {-90.0, -20.0, 50.0, 120.0}) {
      const DirectionPair pair = pair_of(Angle::from_degrees(20.0), Angle::from_degrees(phi_i),
                                         Angle::from_degrees(15.0), Angle::from_degrees(phi));
      const Rgb f_cos = brdf.one_way(pair) * pair.wo.z();
      for (int channel = 0; channel < 3; ++channel) {
        EXPECT_NEAR(f_cos[channel], (phi + 180.0) / 360.0 * (channel + 1), kFloatRounding)
            << "phi_i " << phi_i << ", phi " << phi;
      }
    }
  }
}

TEST(RglFile, SpacesPolarAnglesBySquareRoots) {
  const RglBrdf brdf = read_back(
      plain_file([](std::size_t, std::size_t, double u, double) { return static_cast<float>(u); }));
  // 22.5 deg is (1/2)^2 of 90, 5.625 is (1/4)^2.
  const auto at = [&](double theta_m) {
    const DirectionPair pair = pair_of(Angle::from_degrees(12.0), Angle(),
                                       Angle::from_degrees(theta_m), Angle::from_degrees(40.0));
    return brdf.one_way(pair).y() * pair.wo.z();
  };
  EXPECT_NEAR(at(22.5), 0.5, kFloatRounding);
  EXPECT_NEAR(at(5.625), 0.25, kFloatRounding);
}

TEST(RglFile, InterpolatesBetweenAnglesOfTheLight) {
  const RglBrdf brdf = read_back(plain_file(
      [](std::size_t slice, std::size_t, double, double) { return static_cast<float>(slice); }));
  const auto at = [&](double theta_i) {
    const DirectionPair pair = pair_of(Angle::from_radians(theta_i), Angle(), Angle(), Angle());
    return brdf.one_way(pair).z() * pair.wo.z();
  };
  EXPECT_NEAR(at(0.0), 0.0, kFloatRounding);
  EXPECT_NEAR(at(0.35), 0.5, kFloatRounding);
  EXPECT_NEAR(at(0.7), 1.0, kFloatRounding);
  EXPECT_NEAR(at(1.4), 1.0 + 0.7 / (1.5707964 - 0.7), kFloatRounding);
}

TEST(RglFile, LooksValuesUpWhereTheVisibleNormalsAreUniform) {
  // Density 2 u in the polar coordinate, independent of the azimuth: its distribution is u^2, so a
  // table of u read through the warp is u^2.
  TensorBytes file =
      plain_file([](std::size_t, std::size_t, double u, double) { return static_cast<float>(u); });
  file.remove("vndf");
  file.floats("vndf", {1, kAngles, 3, 3},
              plane_values(kAngles, 1, 3, 3, [](std::size_t, std::size_t, double u, double) {
                return static_cast<float>(0.2 * u);
              }));
  const RglBrdf brdf = read_back(file);
  const DirectionPair pair =
      pair_of(Angle::from_degrees(5.0), Angle(), Angle::from_degrees(22.5), Angle::from_degrees(9));
  EXPECT_NEAR(brdf.one_way(pair).x() * pair.wo.z(), 0.25, kFloatRounding);
}

TEST(RglFile, ScalesByTheDistributionOfNormalsOverTheProjectedArea) {
  TensorBytes file = constant_file();
  file.remove("ndf");
  file.remove("sigma");
  // ndf grows with u_theta of the half vector, sigma falls with that of the light.
  file.floats("ndf", {2, 3}, {0.0f, 4.0f, 8.0f, 0.0f, 4.0f, 8.0f});
  file.floats("sigma", {2, 2}, {1.0f, 0.5f, 1.0f, 0.5f});
  const DirectionPair pair = pair_of(Angle::from_degrees(22.5), Angle(), Angle::from_degrees(22.5),
                                     Angle::from_degrees(60.0));
  const double expected = 0.1 * 4.0 / (4.0 * 0.75);
  EXPECT_NEAR(read_back(file).one_way(pair).x() * pair.wo.z(), expected, kFloatRounding);
  file.field("jacobian").data[0] = 0;
  EXPECT_NEAR(read_back(file).one_way(pair).x() * pair.wo.z(), 0.1, kFloatRounding);
}

TEST(RglFile, IsReciprocalAsABrdf) {
  const RglBrdf brdf = read_back(plain_file([](std::size_t slice, std::size_t, double u, double v) {
    return static_cast<float>(0.1 + 0.2 * u + 0.05 * v + 0.1 * static_cast<double>(slice));
  }));
  const DirectionPair there{direction(Angle::from_degrees(20.0), Angle::from_degrees(10.0)),
                            direction(Angle::from_degrees(65.0), Angle::from_degrees(130.0))};
  const DirectionPair back{there.wo, there.wi};
  EXPECT_GT((brdf.one_way(there) - brdf.one_way(back)).abs().maxCoeff(), 0.01);
  EXPECT_LT((brdf.evaluate(there) - brdf.evaluate(back)).abs().maxCoeff(), 1e-12);
  // Between the two ways.
  const Rgb low = brdf.one_way(there).min(brdf.one_way(back));
  const Rgb high = brdf.one_way(there).max(brdf.one_way(back));
  EXPECT_TRUE((brdf.evaluate(there) >= low).all() && (brdf.evaluate(there) <= high).all());
}

TEST(RglFile, TakesNegativeNoiseAsBlackAndIsBlackBelowTheHorizon) {
  const RglBrdf brdf = read_back(plain_file([](std::size_t, std::size_t channel, double, double) {
    return channel == 2 ? 0.1f : -0.01f;
  }));
  const DirectionPair pair{direction(Angle::from_degrees(20.0), Angle()),
                           direction(Angle::from_degrees(30.0), Angle())};
  EXPECT_EQ(brdf.evaluate(pair).head(2).maxCoeff(), 0.0);
  const RglBrdf white = read_back(constant_file());
  EXPECT_EQ(white.evaluate({pair.wi, -pair.wo}).maxCoeff(), 0.0);
  EXPECT_GT(white.evaluate(pair).minCoeff(), 0.0);
}

TEST(RglFile, BecomesACompleteTableInSi) {
  const ScratchFile scratch("material.bsdf", constant_file().str());
  const BrdfTable table = read_material(scratch.path());
  EXPECT_EQ(table.scale(), RadiometricScale::si);
  for (const std::uint32_t cell : lattice::cells_above_horizon()) ASSERT_TRUE(table.valid(cell));
}

class BrokenRglFile : public ::testing::Test {
 protected:
  static std::string refusal_of(const std::string& bytes) {
    const ScratchFile scratch("broken.bsdf", bytes);
    try {
      read_rgl(scratch.path());
    } catch (const DataFormatError& error) {
      return error.what();
    }
    return "no DataFormatError";
  }
};

TEST_F(BrokenRglFile, IsRefusedForItsHead) {
  const std::string good = constant_file().str();
  EXPECT_THAT(refusal_of(""), HasSubstr("byte 0: the file ends here"));
  EXPECT_THAT(refusal_of("tensor_fil!" + good.substr(11)), HasSubstr("byte 0: found no tensor"));
  std::string version = good;
  version[12] = 2;
  EXPECT_THAT(refusal_of(version), HasSubstr("byte 12: found version 2.0, expected 1.0"));
  std::string count = good;
  count[17] = 1;  // 2^24 more
  EXPECT_THAT(refusal_of(count), HasSubstr("byte 14: found 16777224 fields, expected 1 to 64"));
  std::string name = good;
  name[19] = 4;
  EXPECT_THAT(refusal_of(name), HasSubstr("byte 18, field 0: found a name of 1035 bytes"));
  EXPECT_THAT(refusal_of(good.substr(0, 100)), HasSubstr("byte 100: the file ends here"));
  EXPECT_THAT(refusal_of(good.substr(0, good.size() - 1)), HasSubstr("field jacobian"));
}

TEST_F(BrokenRglFile, IsRefusedForWhereItsFieldsLie) {
  TensorBytes file = constant_file();
  file.field("ndf").offset = 20;
  EXPECT_THAT(refusal_of(file.str()), HasSubstr("field ndf: found at byte 20, inside of the head"));
  file = constant_file();
  file.field("sigma").offset = file.str().size() - 5;
  EXPECT_THAT(refusal_of(file.str()), HasSubstr("field sigma"));
  file.field("sigma").offset = std::numeric_limits<std::uint64_t>::max() - 4;
  EXPECT_THAT(refusal_of(file.str()), HasSubstr("expected them inside of the"));
  file = constant_file();
  file.field("vndf").shape = {1, std::uint64_t{1} << 62U, std::uint64_t{1} << 62U, 5};
  EXPECT_THAT(refusal_of(file.str()), HasSubstr("found extent 4611686018427387904 of dimension 1"));
  file = constant_file();
  file.field("vndf").shape = {1, 0, 5, 5};
  EXPECT_THAT(refusal_of(file.str()), HasSubstr("found extent 0"));
  file = constant_file();
  file.field("vndf").shape.assign(9, 1);
  EXPECT_THAT(refusal_of(file.str()), HasSubstr("found 9 dimensions, expected at most 8"));
  file = constant_file();
  file.field("ndf").type = 77;
  EXPECT_THAT(refusal_of(file.str()), HasSubstr("unknown type 77"));
  file = constant_file();
  file.fields.push_back(file.field("ndf"));
  EXPECT_THAT(refusal_of(file.str()), HasSubstr("the name ndf a second time"));
}

TEST_F(BrokenRglFile, IsRefusedForItsTables) {
  const auto with = [](const std::string& name, std::vector<std::uint64_t> shape,
                       const std::vector<float>& values) {
    TensorBytes file = constant_file();
    file.remove(name);
    return file.floats(name, std::move(shape), values).str();
  };
  TensorBytes missing = constant_file();
  missing.remove("vndf");
  EXPECT_THAT(refusal_of(missing.str()), HasSubstr("field vndf: missing"));
  EXPECT_THAT(refusal_of(with("phi_i", {3}, {0, 1, 2})), HasSubstr("an anisotropic material"));
  EXPECT_THAT(refusal_of(with("theta_i", {3}, {0, 1, 1})),
              HasSubstr("field theta_i: found angle 2"));
  EXPECT_THAT(refusal_of(with("theta_i", {3}, {0, 1, 2})), HasSubstr("expected 0 to pi/2"));
  EXPECT_THAT(refusal_of(with("theta_i", {2}, {0, 1})), HasSubstr("expected 1 x 2 x rows"));
  EXPECT_THAT(refusal_of(with("theta_i", {3, 1}, {0, 1, 1.5})), HasSubstr("found shape 3 x 1"));
  EXPECT_THAT(refusal_of(with("ndf", {2, 2}, {1, 1, -1, 1})), HasSubstr("field ndf: found a neg"));
  EXPECT_THAT(refusal_of(with("ndf", {1, 4}, {1, 1, 1, 1})), HasSubstr("at least 2 x 2"));
  EXPECT_THAT(refusal_of(with("ndf", {4}, {1, 1, 1, 1})), HasSubstr("expected rows x columns"));
  EXPECT_THAT(refusal_of(with("sigma", {2, 2}, {1, 1, 0, 1})), HasSubstr("not above 0"));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal_of(with("sigma", {2, 2}, {1, nan, 0, 1})),
              HasSubstr("found NaN as element 1 of field sigma"));
  std::vector<float> black(kAngles * 4, 1.0f);
  std::fill(black.begin() + 4, black.begin() + 8, 0.0f);
  EXPECT_THAT(refusal_of(with("vndf", {1, kAngles, 2, 2}, black)),
              HasSubstr("field vndf: slice 1 is zero everywhere"));
  black.assign(kAngles * 4, -1.0f);
  EXPECT_THAT(refusal_of(with("vndf", {1, kAngles, 2, 2}, black)), HasSubstr("negative density"));
  EXPECT_THAT(refusal_of(with("ndf", {2, 2}, {1, 3e38f, 1, 1})),
              HasSubstr("expected at most 1e12 in size"));
  const std::vector<float> dark(3 * kAngles * 4, -1.0f);
  EXPECT_THAT(refusal_of(with("rgb", {1, kAngles, 3, 2, 2}, dark)),
              HasSubstr("field rgb: found no value above 0"));
  TensorBytes spectral = constant_file();
  spectral.field("rgb").name = "spectra";
  EXPECT_THAT(refusal_of(spectral.str()), HasSubstr("this is a spectral file"));
  TensorBytes precision = constant_file();
  precision.field("sigma").type = 5;
  EXPECT_THAT(refusal_of(precision.str()), HasSubstr("field sigma: found type 5, expected 10"));
  TensorBytes jacobian = constant_file();
  jacobian.field("jacobian").data[0] = 7;
  EXPECT_THAT(refusal_of(jacobian.str()), HasSubstr("field jacobian"));
}

}  // namespace
}  // namespace gonio::brdf
