#include "gonio/calibration/radiometry/lamp_field.h"

#include <gmock/gmock.h>

#include <functional>

#include "gonio/calibration/result/step_refused.h"
#include "white_scene.h"

namespace gonio::calibration {
namespace {

std::vector<WhiteView> views_of(const instrument::Instrument& truth, double noise_level,
                                std::uint64_t seed) {
  random::Stream noise(random::make_key(seed, "lamp field"));
  std::vector<WhiteView> views;
  int channel = 0;
  for (const auto& joints : {joints_deg(30, 15, 0), joints_deg(30, 0, 20), joints_deg(60, 40, -4),
                             joints_deg(60, 10, 25), joints_deg(90, 45, 0), joints_deg(90, 55, 15),
                             joints_deg(40, -20, 5)}) {
    views.push_back(seen_white(truth, joints, channel, noise_level, noise, 0.9 + 0.05 * channel));
    channel = (channel + 1) % 3;
  }
  return views;
}

/// As views_of, every pose in all colours, one after the other.
std::vector<WhiteView> views_in_all_colours(const instrument::Instrument& truth, double noise_level,
                                            std::uint64_t seed) {
  random::Stream noise(random::make_key(seed, "lamp field in colours"));
  std::vector<WhiteView> views;
  for (const WhiteView& view : views_of(truth, noise_level, seed)) {
    for (int channel = 0; channel < 3; ++channel) {
      views.push_back(seen_white(truth, view.joints, channel, noise_level, noise, 0.9));
    }
  }
  return views;
}

constexpr int kSeeds = 60;

/// Of all parameters of many fits, those within two of their sigmas. Relative sds of what all
/// pixels are off by together: `by_view` those of a view, `by_pose` those of a pose in all colours.
double share_within_two_sigma(double by_view, double by_pose) {
  const auto truth = true_instrument();
  instrument::Instrument known = truth;
  known.lamp_field = {};
  known.vignetting = {};
  const std::array<double, 11> wanted{
      std::log(kConstant[0]), std::log(kConstant[1]), std::log(kConstant[2]), truth.lamp_field.c10,
      truth.lamp_field.c01,   truth.lamp_field.c20,   truth.lamp_field.c11,   truth.lamp_field.c02,
      truth.vignetting.v1,    truth.vignetting.v2,    truth.vignetting.v3};
  int inside = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    std::vector<WhiteView> views = views_in_all_colours(truth, 0.002, 100 + seed);
    random::Stream draw(random::make_key(seed, "shared by a view"));
    double of_pose = 0.0;
    for (WhiteView& view : views) {
      if (view.channel == 0) of_pose = by_pose * draw.normal();
      const double factor = (1.0 + of_pose) * (1.0 + by_view * draw.normal());
      for (PixelSignal& pixel : view.pixels) pixel.dn_per_s *= factor;
    }
    const FieldFit fit = fit_fields(known, views);
    const std::array<double, 11> found{
        std::log(fit.constant[0]), std::log(fit.constant[1]), std::log(fit.constant[2]),
        fit.lamp_field.c10,        fit.lamp_field.c01,        fit.lamp_field.c20,
        fit.lamp_field.c11,        fit.lamp_field.c02,        fit.vignetting.v1,
        fit.vignetting.v2,         fit.vignetting.v3};
    for (std::size_t i = 0; i < found.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      inside += std::abs(found[i] - wanted[i]) < 2.0 * std::sqrt(fit.covariance(at, at)) ? 1 : 0;
    }
  }
  return inside / (kSeeds * 11.0);
}

/// What an operator starts with: geometry and certificate, no field.
instrument::Instrument started_with() {
  instrument::Instrument known = true_instrument();
  known.lamp_field = {};
  known.vignetting = {};
  return known;
}

TEST(LampField, IsFoundWithTheLensAndTheConstants) {
  const auto truth = true_instrument();
  const FieldFit fit = fit_fields(started_with(), views_of(truth, 0.001, 7));
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(fit.constant[c] / kConstant[c], 1.0, 0.003) << c;
  }
  // The maps, not the coefficients: those trade against each other.
  for (const double x : {-0.04, 0.0, 0.04}) {
    for (const double y : {-0.04, 0.0, 0.04}) {
      const Eigen::Vector3d beam(x, y, 1.0);
      EXPECT_NEAR(instrument::relative_intensity(fit.lamp_field, beam) /
                      instrument::relative_intensity(truth.lamp_field, beam),
                  1.0, 0.002);
    }
  }
  instrument::Instrument found = truth;
  found.vignetting = fit.vignetting;
  EXPECT_NEAR(instrument::relative_response(found, 5.0, 250.0) /
                  instrument::relative_response(truth, 5.0, 250.0),
              1.0, 0.002);
  EXPECT_NEAR(fit.chi2_per_dof, 1.0, 0.2);
}

TEST(LampField, ReportedSigmasCoverTheTruth) {
  const double share = share_within_two_sigma(0.0, 0.0);
  EXPECT_GT(share, 0.90);
  EXPECT_LT(share, 0.99);
}

TEST(LampField, ReportedSigmasCoverWhatAViewIsOffByAsAWhole) {
  const double share = share_within_two_sigma(0.002, 0.0);  // a monitor
  EXPECT_GT(share, 0.88);
  EXPECT_LT(share, 0.99);
}

TEST(LampField, ReportedSigmasCoverWhatAPoseIsOffByInAllColours) {
  const double share = share_within_two_sigma(0.0, 0.002);  // the white's own table, say
  EXPECT_GT(share, 0.88);
  EXPECT_LT(share, 0.99);
}

/// ln of the constants, the field's and the lens' coefficients, as FieldFit::covariance has them.
Eigen::VectorXd parameters_of(const FieldFit& fit) {
  Eigen::VectorXd all(11);
  const auto& field = fit.lamp_field;
  const auto& lens = fit.vignetting;
  all << std::log(fit.constant[0]), std::log(fit.constant[1]), std::log(fit.constant[2]), field.c10,
      field.c01, field.c20, field.c11, field.c02, lens.v1, lens.v2, lens.v3;
  return all;
}

TEST(LampField, FollowsRigAndLensThatItIsNotSureOf) {
  const std::vector<WhiteView> views = views_of(true_instrument(), 0.001, 7);
  instrument::Instrument known = started_with();
  CalibratedRig other{known.rig, known.camera};
  other.rig.lamp.home_pose.translation() += Eigen::Vector3d(0.5, 0.3, -0.4);  // mm
  other.camera.cx_px += 0.5;
  const FieldFit sure = fit_fields(known, views);
  const FieldFit unsure = fit_fields(known, views, {other});
  known.rig = other.rig;
  known.camera = other.camera;
  const Eigen::VectorXd moved = parameters_of(fit_fields(known, views)) - parameters_of(sure);
  const Eigen::MatrixXd more = unsure.covariance - sure.covariance;
  // Of the lens' higher terms the target shows next to nothing: they have their prior.
  for (Eigen::Index i = 0; i < 5; ++i) {
    EXPECT_NEAR(more(i, i) / (moved[i] * moved[i]), 1.0, 0.05) << i;
    EXPECT_NEAR(more(0, i) / (moved[0] * moved[i]), 1.0, 0.05) << i;
  }
  EXPECT_GT(unsure.field_sigma, 1.05 * sure.field_sigma);
}

TEST(LampField, WhatTheRigExplainsIsNotCountedTwice) {
  // The rig is off by what it is said to be uncertain by, which the means of the views show.
  instrument::Instrument truth = true_instrument();
  truth.rig.sample.links[0].offset += Angle::from_degrees(0.3);
  const std::vector<WhiteView> views = views_of(truth, 0.0002, 9);
  instrument::Instrument known = started_with();
  const FieldFit unexplained = fit_fields(known, views);
  const FieldFit explained = fit_fields(known, views, {{truth.rig, truth.camera}});
  known.rig = truth.rig;
  const Eigen::VectorXd moved = parameters_of(fit_fields(known, views)) - parameters_of(explained);
  const Eigen::VectorXd rest = explained.covariance.diagonal() - moved.cwiseAbs2();
  const Eigen::VectorXd before = unexplained.covariance.diagonal();
  // The fields' own noise stays, what the views are off by each on its own goes.
  EXPECT_LT(rest.head<3>().sum(), 0.5 * before.head<3>().sum());
  EXPECT_GT(rest.minCoeff(), -0.05 * before.minCoeff());
}

TEST(LampField, OnePoseCannotTellLampFromLens) {
  random::Stream noise(random::make_key(1, "one pose"));
  const std::vector<WhiteView> views{
      seen_white(true_instrument(), joints_deg(30, 15, 0), 0, 0.001, noise)};
  EXPECT_THAT(
      [&] { fit_fields(started_with(), views); },
      testing::ThrowsMessage<StepRefused>(testing::HasSubstr("lamp's field from the lens'")));
}

TEST(LampField, ShadowOnTheWhiteIsNamed) {
  auto views = views_of(true_instrument(), 0.001, 3);
  for (std::size_t i = 0; i < 20; ++i) views[4].pixels[i].dn_per_s *= 0.9;
  EXPECT_THAT([&] { fit_fields(started_with(), views); },
              testing::ThrowsMessage<StepRefused>(testing::AllOf(
                  testing::HasSubstr("view 4"), testing::HasSubstr("expected at most"))));
}

TEST(LampField, LampThatIsOffIsRefused) {
  auto views = views_of(true_instrument(), 0.001, 3);
  for (PixelSignal& pixel : views[2].pixels) pixel.dn_per_s = -0.1;
  EXPECT_THAT([&] { fit_fields(started_with(), views); },
              testing::ThrowsMessage<StepRefused>(
                  testing::AllOf(testing::HasSubstr("view 2"), testing::HasSubstr("lamp on"))));
}

TEST(LampField, BadViewsAreRefusedByIndex) {
  const auto good = views_of(true_instrument(), 0.001, 3);
  const auto refused = [&](const std::function<void(WhiteView&)>& spoil, const char* says) {
    auto views = good;
    spoil(views[1]);
    EXPECT_THAT([&] { fit_fields(started_with(), views); },
                testing::ThrowsMessage<StepRefused>(
                    testing::AllOf(testing::HasSubstr("view 1"), testing::HasSubstr(says))));
  };
  refused([](WhiteView& view) { view.joints.pop_back(); }, "one per axis");
  refused([](WhiteView& view) { view.channel = 3; }, "0 to 2");
  refused([](WhiteView& view) { view.monitor = 0.0; }, "lamp on");
  refused([](WhiteView& view) { view.pixels.clear(); }, "at least one");
  refused([](WhiteView& view) { view.pixels[3].dn_per_s = std::nan(""); }, "finite");
  refused([](WhiteView& view) { view.pixels[3].sigma_dn_per_s = 0.0; }, "positive sigma");
  EXPECT_THROW(fit_fields(started_with(), {}), StepRefused);
}

}  // namespace
}  // namespace gonio::calibration
