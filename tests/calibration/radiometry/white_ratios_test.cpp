#include "gonio/calibration/radiometry/white_ratios.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>

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

const RatioCheck& named(const std::vector<RatioCheck>& ratios, const std::string& word) {
  const auto found = std::find_if(ratios.begin(), ratios.end(), [&](const RatioCheck& ratio) {
    return ratio.name.find(word) != std::string::npos;
  });
  if (found == ratios.end()) throw std::out_of_range("no ratio is called " + word);
  return *found;
}

bool passes(const RatioCheck& ratio) { return std::abs(ratio.found - 1.0) <= ratio.tolerance; }

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
  EXPECT_TRUE(passes(named(white_ratios(truth, data), "repeated")));
  multiply(data.white.back(), 1.005);
  const RatioCheck off = named(white_ratios(truth, data), "repeated");
  EXPECT_NEAR(off.found, 1.005, 0.0005);
  EXPECT_FALSE(passes(off));
  data.white.back().monitor *= 1.005;
  EXPECT_TRUE(passes(named(white_ratios(truth, data), "repeated")));
}

TEST(WhiteRatios, LightAndCameraExchangedAreComparedWhateverTheCertificateSays) {
  const auto truth = true_instrument();  // its white is not reciprocal: 1.004 at 30, 0.985 at 60
  const auto data = views_of(truth, {joints_deg(70, 10, 0), joints_deg(70, 60, 0)});
  const RatioCheck off = named(white_ratios(truth, data), "reciprocity");
  // D(10, 60) over D(60, 10), by the scene's own formula.
  const double expected =
      (1.0 + 0.004 / 3.0 - 0.01 * 60.0 / 90.0 / 3.0) / (0.985 - 0.01 * 10.0 / 90.0);
  EXPECT_NEAR(off.found, expected, 0.002);
  EXPECT_FALSE(passes(off));
}

TEST(WhiteRatios, ComparesNothingThatIsNotExchanged) {
  const auto truth = true_instrument();
  const auto data = views_of(truth, {joints_deg(70, 10, 0), joints_deg(70, 50, 0)});
  EXPECT_THROW(named(white_ratios(truth, data), "reciprocity"), std::out_of_range);
  EXPECT_THROW(named(white_ratios(truth, data), "repeated"), std::out_of_range);
}

TEST(WhiteRatios, WhiteThatThrowsBackMoreThanItGets) {
  auto known = reciprocal_instrument();
  known.white.reflectance = brdf::Rgb::Constant(0.99);
  const auto data = views_of(true_instrument(), {joints_deg(45, 0, 0)});
  EXPECT_TRUE(passes(named(white_ratios(known, data), "energy")));
  known.white.angular.factor = {1.08};  // a table that was typed in wrong
  auto brighter = data;
  for (WhiteView& view : brighter.white) multiply(view, 1.08);
  const RatioCheck off = named(white_ratios(known, brighter), "energy");
  EXPECT_NEAR(off.found, 1.08 * true_instrument().white.reflectance[1] * 0.9945, 0.005);
  EXPECT_FALSE(passes(off));
}

}  // namespace
}  // namespace gonio::calibration
