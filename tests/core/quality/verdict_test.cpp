#include "gonio/quality/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "gonio/basis/dense_field.h"
#include "gonio/brdf/brdf_model.h"
#include "gonio/design/published_sets.h"
#include "gonio/parallel/parallel.h"
#include "gonio/quality/metrics.h"
#include "gonio/quality/synthetic_samples.h"

namespace gonio::quality {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr int kMaterials = 24;

/// Numbers in [0, 1) that fill it evenly in several dimensions.
double part(int index, double step) { return std::fmod(0.5 + index * step, 1.0); }

/// A coloured body under a gloss: quick to evaluate at a million cells. `swing` lets the colour
/// turn with theta_d, as pearl pigments and thin films do.
class Paint final : public brdf::BrdfModel {
 public:
  explicit Paint(int index, double swing = 0.0)
      : body_(0.02 + 0.25 * part(index, 0.6180339887), 0.02 + 0.25 * part(index, 0.7548776662),
              0.02 + 0.25 * part(index, 0.5698402910)),
        gloss_(0.5 * std::pow(20.0, part(index, 0.8191725134))),
        sharpness_(10.0 * std::pow(40.0, part(index, 0.6710436067))),
        swing_(swing) {}

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry& g) const override {
    const double tan_h = g.sin_theta_h / g.cos_theta_h;
    const double fresnel = 0.04 + 0.96 * std::pow(1.0 - g.cos_theta_d, 5);
    brdf::Rgb turned = body_;
    for (Eigen::Index c = 0; c < 3; ++c) {
      const double phase = 9.0 * g.cos_theta_d * (1.0 + 0.4 * static_cast<double>(c));
      turned[c] *= std::exp(swing_ * std::sin(phase));
    }
    return turned + gloss_ * fresnel * std::exp(-sharpness_ * tan_h * tan_h);
  }

  brdf::Rgb body_;
  double gloss_;
  double sharpness_;
  double swing_;
};

const basis::Basis& trained() {
  static const basis::Basis made = [] {
    basis::TrainingSet set(brdf::RadiometricScale::si);
    for (int i = 0; i < kMaterials; ++i) set.add({"paint-" + std::to_string(i), "", ""}, Paint(i));
    return basis::train(set, basis::centred_gram(set), 30);
  }();
  return made;
}

samples::SampleSet measured(const brdf::BrdfModel& model) {
  SyntheticNoise noise;
  noise.relative = 0.03;
  return synthetic_samples(model, brdf::RadiometricScale::si,
                           design::published_set("nielsen-10").directions, {}, noise);
}

Verdict verdict_on(const brdf::BrdfModel& model) {
  const samples::SampleSet samples = measured(model);
  const basis::Fit fit = basis::fit(trained(), samples);
  return judge(trained(), samples, fit, basis::expand(trained(), fit.coefficients), nullptr);
}

TEST(Verdict, TrustsMaterialsOfTheTrainedKind) {
  for (const int index : {40, 57, 63}) {
    const Verdict verdict = verdict_on(Paint(index));
    EXPECT_EQ(verdict.trusted, true) << index << ": " << verdict.line;
    EXPECT_THAT(verdict.line, StartsWith("trust: "));
    EXPECT_THAT(verdict.reasons, IsEmpty());
  }
}

TEST(Verdict, DoesNotTrustAColourThatTurnsWithTheAngle) {
  for (const int index : {40, 57, 63}) {
    const Verdict verdict = verdict_on(Paint(index, 1.2));
    EXPECT_EQ(verdict.trusted, false) << index << ": " << verdict.line;
    EXPECT_THAT(verdict.line, StartsWith("do not trust: "));
    EXPECT_THAT(verdict.line, HasSubstr("; measure"));
    EXPECT_THAT(verdict.line, testing::Not(HasSubstr("\n")));
    ASSERT_TRUE(verdict.outlook.has_value());
    EXPECT_GT(verdict.outlook->innovation, verdict.outlook->left_out_innovations.back());
  }
}

TEST(Verdict, ForeseesScoresOfTheRightOrder) {
  // What was foreseen for a material it has not seen, against the truth.
  const Paint truth(57);
  const samples::SampleSet samples = measured(truth);
  const basis::Fit fit = basis::fit(trained(), samples);
  const Outlook seen = outlook(trained(), fit).value();
  const PictureError error =
      picture_error(brdf::tabulate(truth, brdf::RadiometricScale::si),
                    basis::expand(trained(), fit.coefficients), render::MetricLighting::a);
  EXPECT_NEAR(seen.expected_psnr_db, error.psnr_db, 3.0 * seen.sd_db);
}

TEST(Verdict, GivesTheSameFiguresWithOneAndTwoThreads) {
  const basis::Fit fit = basis::fit(trained(), measured(Paint(40)));
  parallel::set_thread_count(1);
  const double one = outlook(trained(), fit)->expected_psnr_db;
  parallel::set_thread_count(2);
  const double two = outlook(trained(), fit)->expected_psnr_db;
  parallel::set_thread_count(0);
  EXPECT_EQ(one, two);
}

TEST(Verdict, SaysNothingOfThePictureWhereNothingWasLeftOut) {
  basis::ReconstructOptions ridge;
  ridge.method = basis::Method::ridge;
  const samples::SampleSet samples = measured(Paint(40));
  const basis::Fit fit = basis::fit(trained(), samples, ridge);
  EXPECT_FALSE(outlook(trained(), fit).has_value());
  const Verdict verdict =
      judge(trained(), samples, fit, basis::expand(trained(), fit.coefficients), nullptr);
  EXPECT_EQ(verdict.trusted, std::nullopt);
  EXPECT_THAT(verdict.line, StartsWith("cannot tell: "));
}

TEST(Verdict, NamesTheChecksThatFailed) {
  const samples::SampleSet samples = measured(Paint(40));
  const basis::Fit fit = basis::fit(trained(), samples);
  brdf::BrdfTable table = basis::expand(trained(), fit.coefficients);
  for (const std::uint32_t cell : brdf::lattice::cells_above_horizon()) {
    table.set_value(cell, brdf::Rgb(0.0, 1.0, 1.0));
  }
  const Verdict bright = judge(trained(), samples, fit, table, nullptr);
  EXPECT_EQ(bright.trusted, false);
  EXPECT_THAT(bright.line, HasSubstr("of the light that falls in"));
  EXPECT_THAT(bright.line, HasSubstr("100 % of the directions came out below zero"));

  samples::SampleSet swapped = samples;
  samples::Sample twin = swapped.samples[0];
  twin.direction.phi_d += Angle::from_degrees(-180.0);
  twin.value_per_sr *= 2.0;
  twin.pose = 1000;
  swapped.samples.push_back(twin);
  const Verdict misaligned =
      judge(trained(), swapped, fit, basis::expand(trained(), fit.coefficients), nullptr);
  EXPECT_EQ(misaligned.trusted, false);
  EXPECT_THAT(misaligned.line, HasSubstr("exchanging lamp and camera"));
  EXPECT_THAT(misaligned.line, HasSubstr("check alignment"));
}

TEST(Verdict, AllowsExchangedDirectionsToLieApartOnAGloss) {
  int index = 40;
  while (part(index, 0.6710436067) < 0.9 || part(index, 0.8191725134) < 0.7) ++index;
  const Paint glossy(index);
  samples::SampleSet samples = measured(glossy);
  for (const double theta_h : {2.6, 2.8}) {
    samples::Sample one = samples.samples[0];
    one.direction = {Angle::from_degrees(theta_h), Angle::from_degrees(30.0),
                     Angle::from_degrees(theta_h < 2.7 ? 70.0 : 250.0), Angle()};
    one.value_per_sr = glossy.evaluate(brdf::shading_geometry(one.direction));
    one.sigma_per_sr = 0.005 * one.value_per_sr;
    one.pose = 1000 + static_cast<int>(samples.samples.size());
    samples.samples.push_back(one);
  }
  EXPECT_FALSE(check_reciprocity(samples).passed) << "the case shows nothing";
  const basis::Fit fit = basis::fit(trained(), samples);
  const Verdict verdict =
      judge(trained(), samples, fit, basis::expand(trained(), fit.coefficients), nullptr);
  EXPECT_EQ(verdict.reciprocity.pairs.size(), 1u);
  EXPECT_TRUE(verdict.reciprocity.passed) << verdict.line;
}

TEST(Verdict, MeasuresGrazingConfidenceFromTheBands) {
  const samples::SampleSet samples = measured(Paint(40));
  const basis::Fit fit = basis::fit(trained(), samples);
  basis::Uncertainty bands;
  bands.sigma.setConstant(trained().components.rows(), 3, 0.2F);
  bands.factor_68 = 1.5;
  const Verdict verdict =
      judge(trained(), samples, fit, basis::expand(trained(), fit.coefficients), &bands);
  EXPECT_NEAR(verdict.grazing_half_width.value(), 0.3, 1e-6);
  EXPECT_THAT(verdict.line, HasSubstr("two in three grazing values within 35 %"));
}

}  // namespace
}  // namespace gonio::quality
