#include "gonio/brdf/spectrum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "reference_values.h"

namespace gonio::brdf {
namespace {

using testing::kRounding;

std::vector<double> every(double step, double first = 380.0, double last = 780.0) {
  std::vector<double> wavelengths;
  for (double at = first; at <= last; at += step) wavelengths.push_back(at);
  return wavelengths;
}

Eigen::Vector3d rgb_of(const std::vector<double>& wavelengths, double (*reflectance)(double)) {
  Eigen::VectorXd spectrum(static_cast<Eigen::Index>(wavelengths.size()));
  for (std::size_t i = 0; i < wavelengths.size(); ++i) {
    spectrum[static_cast<Eigen::Index>(i)] = reflectance(wavelengths[i]);
  }
  return srgb_weights(wavelengths) * spectrum;
}

TEST(Spectrum, KeepsAGreyGreyOnAnyWavelengths) {
  for (const auto& wavelengths : {every(5), every(10, 400, 700), std::vector<double>{450, 650},
                                  std::vector<double>{300, 551, 553, 1000}}) {
    const Eigen::Vector3d rgb = rgb_of(wavelengths, [](double) { return 0.37; });
    EXPECT_LT((rgb.array() - 0.37).abs().maxCoeff(), kRounding);
  }
}

TEST(Spectrum, GivesLongWavelengthsToRedAndShortOnesToBlue) {
  const auto red = rgb_of(every(5), [](double nm) { return nm > 600.0 ? 1.0 : 0.0; });
  EXPECT_GT(red[0], 0.7);
  EXPECT_LT(red[1], 0.1);
  EXPECT_LT(red[2], 0.1);
  const auto yellow = rgb_of(every(5), [](double nm) { return nm > 500.0 ? 1.0 : 0.0; });
  EXPECT_GT(yellow[0], 0.9);
  EXPECT_GT(yellow[1], 0.8);
  EXPECT_LT(yellow[2], 0.15);
  const auto blue = rgb_of(every(5), [](double nm) { return nm < 490.0 ? 1.0 : 0.0; });
  EXPECT_GT(blue[2], 0.8);
  EXPECT_LT(blue[1], 0.15);
}

TEST(Spectrum, FindsTheLuminanceOfAKnownBand) {
  // Luminance under D65 of what lies above 555 nm: 0.516 of the whole, from the ASTM E308 weights
  // of D65 and the 2 deg observer, whose sum over 560 to 780 nm is half of Y at 560 and all above.
  const auto rgb = rgb_of(every(1), [](double nm) { return nm >= 555.0 ? 1.0 : 0.0; });
  const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
  EXPECT_NEAR(luminance, 0.516, 0.03);
}

TEST(Spectrum, DoesNotDependOnHowFinelyASmoothOneIsSampled) {
  const auto smooth = [](double nm) { return 0.4 + 0.3 * std::sin(nm / 60.0); };
  const Eigen::Vector3d fine = rgb_of(every(1), smooth);
  const Eigen::Vector3d coarse = rgb_of(every(10), smooth);
  // 10 nm steps of a curve that bends over 60 nm, linear between: (10 / 60)^2 / 8 of 0.3.
  EXPECT_LT((fine - coarse).cwiseAbs().maxCoeff(), 0.0015);
}

TEST(Spectrum, HasSmoothSpectraWithTheColoursOfThePrimaries) {
  const std::vector<double> wavelengths = every(10, 400, 700);
  const Eigen::MatrixX3d spectra = smooth_spectra(wavelengths);
  EXPECT_LT(
      (srgb_weights(wavelengths) * spectra - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(),
      1e-9);
  EXPECT_LT((spectra.rowwise().sum().array() - 1.0).abs().maxCoeff(), 1e-6) << "grey is flat";
}

TEST(Spectrum, RefusesWavelengthsThatSayNothingAboutColour) {
  EXPECT_THROW(srgb_weights(std::vector<double>{550}), std::invalid_argument);
  EXPECT_THROW(srgb_weights(std::vector<double>{500, 600}), std::invalid_argument);
  EXPECT_THROW(srgb_weights(std::vector<double>{400, 600, 600, 700}), std::invalid_argument);
  EXPECT_THROW(srgb_weights(std::vector<double>{0.4, 0.7}), std::invalid_argument);
  EXPECT_THROW(srgb_weights(std::vector<double>{400, std::nan(""), 700}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::brdf
