#include "gonio/calibration/sensor/flat_field.h"

#include <gmock/gmock.h>

#include <cmath>

#include "gonio/random/distributions.h"
#include "refused.h"

namespace gonio::calibration::sensor {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 160;
constexpr int kHeight = 128;
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;

instrument::CameraModel camera() {
  instrument::CameraModel model;
  model.width_px = kWidth;
  model.height_px = kHeight;
  model.fx_px = model.fy_px = 360.0;
  model.cx_px = 83.0;
  model.cy_px = 61.0;
  return model;
}

/// cos^4 of the field angle, which no polynomial is exactly.
double lens(std::size_t p) {
  const double x = (static_cast<double>(p % kWidth) - 83.0) / 360.0;
  const double y = (static_cast<double>(p / kWidth) - 61.0) / 360.0;
  return 1.0 / std::pow(1.0 + x * x + y * y, 2.0);
}

/// Views of a white whose light falls off another way in each, with PRNU and noise.
class Whites {
 public:
  Whites(std::size_t images, std::uint64_t seed, double prnu = 0.006, double noise = 0.002) {
    signals_.resize(images);
    expected_.resize(images);
    std::vector<double> response(kPixels);
    random::fill_normal(random::make_key(seed, "prnu"), 0, response);
    for (std::size_t i = 0; i < images; ++i) {
      std::vector<double> draws(kPixels);
      random::fill_normal(random::make_key(seed, "noise", i), 0, draws);
      for (std::size_t p = 0; p < kPixels; ++p) {
        const double tilt = 0.2 * static_cast<double>(i) - 0.2;
        const double light = 1.0 + tilt * static_cast<double>(p % kWidth) / kWidth;
        expected_[i].push_back(light);
        signals_[i].push_back((1500.0 + 100.0 * static_cast<double>(i)) * light * lens(p) *
                              (1.0 + prnu * response[p]) * (1.0 + noise * draws[p]));
      }
    }
  }
  std::vector<double>& signal(std::size_t i) { return signals_[i]; }
  std::vector<double>& expected(std::size_t i) { return expected_[i]; }
  std::vector<FlatImage> images() const {
    std::vector<FlatImage> out;
    for (std::size_t i = 0; i < signals_.size(); ++i) out.push_back({signals_[i], expected_[i]});
    return out;
  }

 private:
  std::vector<std::vector<double>> signals_;
  std::vector<std::vector<double>> expected_;
};

double value_at(const instrument::Vignetting& v, double q) {
  return 1.0 + q * (v.v1 + q * (v.v2 + q * v.v3));
}

TEST(FlatField, FindsTheFalloffOfTheLens) {
  Whites whites(3, 1);
  const auto found = fit_flat_field(camera(), whites.images());
  constexpr double kTolerance = 0.005;  // of the specification, 3.8
  for (const double q : {0.01, 0.03, 0.05, 0.08}) {
    EXPECT_NEAR(value_at(found.vignetting, q), std::pow(1.0 + q, -2.0), kTolerance);
  }
  EXPECT_TRUE(found.acceptance.passed());
  EXPECT_LT(found.residual_rms, 0.001);  // 0.6 % over the root of 256 pixels
  // Three images of 0.2 % each beside 0.6 % of the pixels: hypot(0.6, 0.2 / sqrt 3).
  EXPECT_NEAR(found.pixel_response_rms, 0.0061, 0.0003);
  EXPECT_NEAR(found.pixel_response[500],
              1.0 + 0.006 * random::normal(random::make_key(1, "prnu"), 500), 4.0 * 0.002);
}

TEST(FlatField, SigmasCoverTheTruthThoughImagesShareTheirPixels) {
  constexpr int kDraws = 200;
  int inside = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Whites whites(3, 100 + static_cast<std::uint64_t>(draw));
    const auto found = fit_flat_field(camera(), whites.images());
    const Eigen::Vector3d gradient(0.06, 0.06 * 0.06, 0.06 * 0.06 * 0.06);
    const double sigma = std::sqrt(gradient.dot(found.covariance * gradient));
    const double error = value_at(found.vignetting, 0.06) - std::pow(1.06, -2.0);
    if (std::abs(error) <= 2.0 * sigma) ++inside;
  }
  expect_coverage(inside, kDraws);
}

TEST(FlatField, MosaicHasAConstantForEachColour) {
  Whites whites(2, 2);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t p = 0; p < kPixels; ++p) {
      const bool red = p % 2 == 0 && (p / kWidth) % 2 == 0;
      if (red) whites.signal(i)[p] *= 0.4;
    }
  }
  const auto found = fit_flat_field(camera(), whites.images(), {.mosaic = true});
  EXPECT_NEAR(value_at(found.vignetting, 0.08), std::pow(1.08, -2.0), 0.005);
  EXPECT_NEAR(found.pixel_response_rms, 0.0062, 0.0003);
}

TEST(FlatField, FailsAWrongGeometry) {
  Whites whites(2, 3);
  for (std::size_t p = 0; p < kPixels; ++p) {
    whites.expected(1)[p] *= 1.0 + 0.05 * static_cast<double>(p / kWidth) / kHeight;
  }
  EXPECT_FALSE(fit_flat_field(camera(), whites.images()).acceptance.passed());
}

TEST(FlatField, LeavesOutWhatIsNotOnTheWhite) {
  Whites whites(2, 4);
  std::vector<std::uint8_t> bad(kPixels, 0);
  for (std::size_t p = 0; p < kPixels; ++p) {
    if (p % kWidth < 30) {
      whites.expected(0)[p] = 0.0;
      whites.signal(0)[p] = -3.0;
    }
    if (p % 97 == 0) {
      bad[p] = 1;
      whites.signal(1)[p] = 0.0;
    }
  }
  const auto found = fit_flat_field(camera(), whites.images(), {.bad_pixels = bad});
  EXPECT_NEAR(value_at(found.vignetting, 0.08), std::pow(1.08, -2.0), 0.005);
  EXPECT_EQ(found.pixel_response[97], 0.0F);
}

TEST(FlatField, RefusesWhatTellsNothing) {
  const auto refused = [](const std::vector<FlatImage>& images) {
    return refusal([&] { fit_flat_field(camera(), images); });
  };
  EXPECT_THAT(refused({}), HasSubstr("no image"));
  Whites whites(1, 5);
  EXPECT_EQ(refused(whites.images()), "");
  auto short_image = whites.images();
  short_image[0].expected = short_image[0].expected.first(10);
  EXPECT_THAT(refused(short_image), HasSubstr("10 expected values"));
  Whites dark(1, 6);
  std::fill(dark.signal(0).begin(), dark.signal(0).end(), 0.0);
  EXPECT_THAT(refused(dark.images()), HasSubstr("lamp is off"));
  Whites nan(1, 7);
  nan.signal(0)[99] = std::nan("");
  EXPECT_THAT(refused(nan.images()), HasSubstr("pixel 99 of image 0"));
  Whites away(1, 8);
  std::fill(away.expected(0).begin() + 500, away.expected(0).end(), 0.0);
  EXPECT_THAT(refused(away.images()), HasSubstr("500 pixels see the white"));
  instrument::CameraModel tele = camera();
  tele.fx_px = tele.fy_px = 1e5;
  EXPECT_THAT(refusal([&] { fit_flat_field(tele, whites.images()); }), HasSubstr("off the axis"));
}

}  // namespace
}  // namespace gonio::calibration::sensor
