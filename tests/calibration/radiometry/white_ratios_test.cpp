#include "gonio/calibration/radiometry/white_ratios.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <optional>

#include "white_scene.h"

namespace gonio::calibration {
namespace {

/// Of LA-2, whose camera stands at 0: with tilt 0 theta_o is the azimuth and theta_i what is left
/// of the arm.
VerificationData views_of(const instrument::Instrument& truth,
                          const std::vector<rig::Joints>& poses) {
  random::Stream noise(random::make_key(5, "ratios"));
  VerificationData data;
  data.constant = kConstant;
  for (const rig::Joints& joints : poses) {
    data.white.push_back(seen_white(truth, joints, 1, 0.0005, noise));
  }
  return data;
}

bool passes(const std::optional<RatioCheck>& ratio) {
  return std::abs(ratio.value().found - 1.0) <= ratio->tolerance;
}

/// The scene's white without its table: the same whichever way light goes.
instrument::Instrument reciprocal_instrument() {
  instrument::Instrument truth = true_instrument();
  truth.white.angular = instrument::AngularTable::of_incidence({0.0}, {1.0});
  return truth;
}

void multiply(WhiteView& view, double by) {
  for (PixelSignal& pixel : view.pixels) pixel.dn_per_s *= by;
}

TEST(WhiteRatios, RepeatedPoseShowsALampThatItsMonitorDidNotFollow) {
  const auto truth = true_instrument();
  auto data = views_of(truth, {joints_deg(45, 0, 0), joints_deg(70, 40, 0), joints_deg(45, 0, 0)});
  EXPECT_TRUE(passes(white_ratios(truth, data).repeat));
  multiply(data.white.back(), 1.005);
  const auto off = white_ratios(truth, data).repeat;
  EXPECT_NEAR(off->found, 1.005, 0.0005);
  EXPECT_FALSE(passes(off));
  data.white.back().monitor *= 1.005;
  EXPECT_TRUE(passes(white_ratios(truth, data).repeat));
}

TEST(WhiteRatios, LightAndCameraExchangedAreComparedWhateverTheCertificateSays) {
  const auto truth = true_instrument();  // its white is not reciprocal: 1.004 at 30, 0.985 at 60
  const auto data = views_of(truth, {joints_deg(70, 10, 0), joints_deg(70, 60, 0)});
  const auto off = white_ratios(truth, data).reciprocity;
  // D(10, 60) over D(60, 10), by the scene's own formula.
  const double expected =
      (1.0 + 0.004 / 3.0 - 0.01 * 60.0 / 90.0 / 3.0) / (0.985 - 0.01 * 10.0 / 90.0);
  EXPECT_NEAR(off->found, expected, 0.002);
  EXPECT_FALSE(passes(off));
}

TEST(WhiteRatios, ComparesNothingThatIsNotExchanged) {
  const auto truth = true_instrument();
  const auto data = views_of(truth, {joints_deg(70, 10, 0), joints_deg(70, 50, 0)});
  EXPECT_FALSE(white_ratios(truth, data).reciprocity);
  EXPECT_FALSE(white_ratios(truth, data).repeat);
}

const std::vector<rig::Joints> kPoses{joints_deg(70, -4, 8), joints_deg(60, 15, 30),
                                      joints_deg(15, 72, 0), joints_deg(110, 55, 10),
                                      joints_deg(50, 5, 12), joints_deg(50, 45, 12)};

// The level of every pose is a few parts in ten thousand off here, by what the white's table bends
// between its nodes over a picture.
constexpr double kLevel = 0.0005;

TEST(WhiteRatios, LightIntoAllDirectionsShowsAConstantThatIsOffByLessThanASpotMayBe) {
  const auto truth = true_instrument();
  auto data = views_of(truth, kPoses);
  const auto healthy = white_ratios(truth, data).hemisphere;
  EXPECT_NEAR(healthy.value().found, 1.0, kLevel);
  for (WhiteView& view : data.white) multiply(view, 1.01);
  const auto off = white_ratios(truth, data).hemisphere;
  EXPECT_NEAR(off.value().found, 1.01, kLevel);
  EXPECT_FALSE(passes(off));
}

TEST(WhiteRatios, LightIntoAllDirectionsIsThatOfTheTableTimesWhatThePosesShow) {
  const auto truth = true_instrument();
  // Less slanted than light from 45 deg thrown back into all directions is: a mean would not do.
  auto data = views_of(truth, {joints_deg(20, 0, 0), joints_deg(30, 10, 0), joints_deg(50, 5, 12),
                               joints_deg(40, -15, 20), joints_deg(110, 55, 10)});
  constexpr double kSlope = -0.02;
  for (WhiteView& view : data.white) {
    const auto middle = rig::forward(truth.rig, view.joints).directions_at(Eigen::Vector3d::Zero());
    const double slant = 2.0 - std::pow(middle.wi.z(), 2) - std::pow(middle.wo.z(), 2);
    multiply(view, 1.0 + kSlope * slant);
  }
  // Of nearly a Lambertian white: sin^2 45 deg is 1/2, and so is its mean over light thrown back.
  EXPECT_NEAR(white_ratios(truth, data).hemisphere->found, 1.0 + kSlope, 2.0 * kLevel);
}

TEST(WhiteRatios, WhiteThatThrowsBackMoreThanItGets) {
  auto known = reciprocal_instrument();
  known.white.reflectance = brdf::Rgb::Constant(0.99);
  known.white.u_relative = 0.005;
  const auto data = views_of(true_instrument(), kPoses);
  EXPECT_TRUE(passes(white_ratios(known, data).energy));
  known.white.angular.factor = {1.08};  // a table that was typed in wrong
  auto brighter = data;
  for (WhiteView& view : brighter.white) multiply(view, 1.08);
  const auto off = white_ratios(known, brighter).energy;
  EXPECT_FALSE(passes(off));
  EXPECT_GT(off->tolerance, 2.0 * 0.005 * 1.08) << "as sure as certificate and poses";
  EXPECT_LT(off->tolerance, 0.02);
  known.white.u_relative = 0.05;  // by which it may be
  EXPECT_TRUE(passes(white_ratios(known, brighter).energy));
}

}  // namespace
}  // namespace gonio::calibration
