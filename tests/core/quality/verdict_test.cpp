#include "gonio/quality/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "gonio/basis/dense_field.h"
#include "gonio/parallel/parallel.h"
#include "gonio/quality/metrics.h"
#include "paints.h"

namespace gonio::quality {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

Verdict verdict_of(const samples::SampleSet& samples) {
  const basis::Fit fit = basis::fit(trained(), samples);
  return judge(trained(), samples, fit, basis::expand(trained(), fit.coefficients), nullptr);
}

Verdict verdict_on(const brdf::BrdfModel& model) { return verdict_of(measured(model)); }

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

TEST(Verdict, DoesNotTrustWhatTheSessionsOwnChecksDidNot) {
  samples::SampleSet samples = measured(Paint(40));
  ASSERT_NE(verdict_of(samples).trusted, false);
  samples.samples[1].flags = "dark;suspect";
  const Verdict verdict = verdict_of(samples);
  EXPECT_EQ(verdict.trusted, false);
  EXPECT_THAT(verdict.line, HasSubstr("1 of "));
  EXPECT_THAT(verdict.line, HasSubstr("suspect by the session's own checks"));
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
