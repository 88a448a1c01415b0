#include "gonio/brdf/scattered_brdf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <stdexcept>

#include "gonio/brdf/analytic_models.h"
#include "gonio/brdf/convention_check.h"
#include "gonio/brdf/cornell_file.h"
#include "gonio/brdf/material_file.h"
#include "gonio/errors/errors.h"
#include "nearest_points.h"
#include "scratch_file.h"

namespace gonio::brdf {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ScratchFile;

DirectionPair pair_of(double theta_i, double theta_o, double phi) {
  return {direction(Angle::from_degrees(theta_i), Angle()),
          direction(Angle::from_degrees(theta_o), Angle::from_degrees(phi))};
}

/// A goniometer's scan: rings of theta_o and azimuths in [0, `turn`] deg for eight lights.
std::vector<ScatteredValue> scan(const BrdfModel& model, double turn) {
  std::vector<ScatteredValue> samples;
  for (double theta_i = 10.0; theta_i <= 80.0; theta_i += 10.0) {
    for (double theta_o = 5.0; theta_o <= 80.0; theta_o += 7.5) {
      for (double phi = 0.0; phi <= turn; phi += 12.0) {
        const DirectionPair pair = pair_of(theta_i, theta_o, phi);
        samples.push_back({pair, model.evaluate(pair)});
      }
    }
  }
  return samples;
}

double worst_error(const BrdfModel& truth, const BrdfModel& found) {
  double worst = 0.0;
  for (const double theta_i : {14.0, 35.0, 62.0}) {
    for (const double theta_o : {9.0, 41.0, 70.0}) {
      for (const double phi : {17.0, 80.0, 140.0, 200.0, 333.0}) {
        const DirectionPair pair = pair_of(theta_i, theta_o, phi);
        const Rgb expected = truth.evaluate(pair);
        worst = std::max(worst, ((found.evaluate(pair) - expected) / expected).abs().maxCoeff());
      }
    }
  }
  return worst;
}

/// Rings 7.5 to 10 deg apart, a smooth function between them.
constexpr double kBetweenRings = 0.05;

TEST(ScatteredBrdf, FollowsAFunctionThatIsNotBilateral) {
  const NonBilateral truth;
  const ScatteredBrdf found(scan(truth, 348.0));
  EXPECT_LT(worst_error(truth, found), kBetweenRings);
}

TEST(ScatteredBrdf, FollowsItFromOneSideOfThePlaneOfIncidence) {
  // By reciprocity the other side is known too; a mirror image would be wrong here.
  const NonBilateral truth;
  EXPECT_LT(worst_error(truth, ScatteredBrdf(scan(truth, 180.0))), kBetweenRings);
}

TEST(ScatteredBrdf, MirrorsOneSideToTestReciprocity) {
  const RoughDiffuse truth(Rgb(0.3, 0.5, 0.7), 0.5);
  const ScatteredBrdf found(scan(truth, 180.0), Symmetry::one_way);
  EXPECT_TRUE(found.covers(pair_of(30.0, 60.0, -90.0)));
  EXPECT_LT(worst_error(truth, found), kBetweenRings);
}

TEST(ScatteredBrdf, ReturnsASampleWhereItStandsAndItsReciprocal) {
  const NonBilateral truth;
  const auto samples = scan(truth, 348.0);
  const ScatteredBrdf found(samples);
  for (std::size_t i = 0; i < samples.size(); i += 97) {
    const DirectionPair& pair = samples[i].pair;
    EXPECT_LT((found.evaluate(pair) - samples[i].per_sr).abs().maxCoeff(), 1e-12);
    EXPECT_LT((found.evaluate({pair.wo, pair.wi}) - samples[i].per_sr).abs().maxCoeff(), 1e-4);
  }
}

TEST(ScatteredBrdf, NeverLeavesTheRangeOfItsNeighbours) {
  std::vector<ScatteredValue> samples = scan(Lambertian(Rgb::Constant(0.3)), 348.0);
  for (std::size_t i = 0; i < samples.size(); i += 3) samples[i].per_sr *= 50.0;
  const ScatteredBrdf found(samples);
  for (const double phi : {3.0, 77.0, 191.0}) {
    for (const double theta : {1.0, 33.0, 86.0}) {
      const DirectionPair pair = pair_of(theta, theta + 2.0, phi);
      EXPECT_GT(found.evaluate(pair).minCoeff(), 0.9999 * 0.3 / std::numbers::pi);
      EXPECT_LT(found.evaluate(pair).maxCoeff(), 1.0001 * 50.0 * 0.3 / std::numbers::pi);
    }
  }
}

TEST(ScatteredBrdf, LeavesCellsWithoutValueWhereNothingWasMeasured) {
  const ScatteredBrdf found(scan(Lambertian(Rgb::Constant(0.3)), 348.0));
  EXPECT_TRUE(found.covers(pair_of(40.0, 40.0, 90.0)));
  EXPECT_TRUE(found.covers(pair_of(84.0, 30.0, 90.0)));
  EXPECT_FALSE(found.covers(pair_of(86.0, 30.0, 90.0))) << "5 deg beyond the last ring";
  std::vector<ScatteredValue> half;
  for (const ScatteredValue& sample : scan(Lambertian(Rgb::Constant(0.3)), 348.0)) {
    if (half_diff_from_directions(sample.pair).theta_d.degrees() < 30.0) half.push_back(sample);
  }
  EXPECT_FALSE(ScatteredBrdf(half).covers(pair_of(70.0, 70.0, 180.0)));
  const BrdfTable table = tabulate_covered(found, RadiometricScale::si);
  std::size_t valid = 0;
  for (const std::uint32_t cell : lattice::cells_above_horizon()) valid += table.valid(cell);
  const std::size_t all = lattice::cells_above_horizon().size();
  // 8.6 % of the cells have a direction beyond 85 deg; a training material may lack a fifth.
  EXPECT_GT(valid, all * 4 / 5);
  EXPECT_LT(valid, all * 92 / 100);
}

TEST(ScatteredBrdf, RefusesWhatIsNoMeasurement) {
  auto samples = scan(NonBilateral(), 348.0);
  EXPECT_THROW(ScatteredBrdf(std::span(samples).first(49)), std::invalid_argument);
  samples[7].per_sr[1] = -0.1;
  EXPECT_THROW(ScatteredBrdf{samples}, std::invalid_argument);
  samples[7].per_sr[1] = std::nan("");
  EXPECT_THROW(ScatteredBrdf{samples}, std::invalid_argument);
  samples[7] = {{Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ()}, Rgb::Ones()};
  EXPECT_THROW(ScatteredBrdf{samples}, std::invalid_argument);
}

TEST(NearestPoints, FindsWhatTryingAllFinds) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<NearestPoints::Point> points(700);
  for (auto& point : points) {
    for (double& x : point) x = std::round(uniform(generator) * 8.0) / 8.0;  // many ties
  }
  const NearestPoints tree(points);
  std::vector<NearestPoints::Found> found;
  for (int trial = 0; trial < 200; ++trial) {
    NearestPoints::Point at;
    for (double& x : at) x = uniform(generator);
    std::vector<std::pair<double, std::size_t>> all;
    for (std::size_t i = 0; i < points.size(); ++i) {
      all.emplace_back((points[i] - at).squaredNorm(), i);
    }
    std::sort(all.begin(), all.end());
    tree.find(at, 12, found);
    ASSERT_EQ(found.size(), 12u);
    for (std::size_t k = 0; k < 12; ++k) ASSERT_EQ(found[k].index, all[k].second) << k;
  }
}

/// A Cornell file of a grey function: all wavelengths alike, so RGB is the function itself.
std::string cornell_text(const std::vector<ScatteredValue>& samples, const char* head) {
  std::string text = head;
  for (const ScatteredValue& sample : samples) {
    const auto& [wi, wo] = sample.pair;
    char line[200];
    std::snprintf(line, sizeof line, "%.9f %.9f %.9f %.9f %.9f %.9f\n%.9f\n", std::acos(wi.z()),
                  std::atan2(wi.y(), wi.x()), std::acos(wo.z()), std::atan2(wo.y(), wo.x()),
                  sample.per_sr[1], sample.per_sr[1], sample.per_sr[1]);
    text += line;
  }
  return text;
}

constexpr const char* kHead = "# a paint\n3\n# nm\n400 550\n700 # red\n";

TEST(CornellFile, HoldsAnglesInRadiansAndAValuePerWavelength) {
  const auto samples = scan(NonBilateral(), 348.0);
  const ScratchFile file("paint.brdf", cornell_text(samples, kHead));
  const std::vector<ScatteredValue> read = read_cornell(file.path());
  ASSERT_EQ(read.size(), samples.size());
  for (std::size_t i = 0; i < read.size(); i += 31) {
    // Nine decimals; the arc cosine near 5 deg magnifies what it is given.
    EXPECT_LT((read[i].pair.wi - samples[i].pair.wi).norm(), 1e-7);
    EXPECT_LT((read[i].pair.wo - samples[i].pair.wo).norm(), 1e-7);
    EXPECT_LT((read[i].per_sr - samples[i].per_sr[1]).abs().maxCoeff(), 1e-8);
  }
}

TEST(CornellFile, BecomesATableThatIsNotMirrored) {
  const NonBilateral truth;
  const ScratchFile file("paint.brdf", cornell_text(scan(truth, 348.0), kHead));
  const BrdfTable table = read_material(file.path());
  EXPECT_EQ(table.scale(), RadiometricScale::si);
  const lattice::Index at{60, 40, 45};
  const lattice::Index mirror{60, 40, 134};
  const auto green = [&](lattice::Index index) {
    return truth.evaluate(shading_geometry(lattice::angles_of(index)))[1];
  };
  ASSERT_GT(std::abs(green(at) - green(mirror)), 0.03);
  EXPECT_NEAR(table.value(lattice::cell_from_index(at))[1], green(at), 0.003);
  EXPECT_NEAR(table.value(lattice::cell_from_index(mirror))[1], green(mirror), 0.003);
}

std::string refusal_of(const std::string& text) {
  const ScratchFile file("broken.brdf", text);
  try {
    read_material(file.path());
  } catch (const DataFormatError& error) {
    return error.what();
  }
  return "no DataFormatError";
}

TEST(CornellFile, IsRefusedWithTheLineOfTheFault) {
  const std::string head = kHead;
  EXPECT_THAT(refusal_of(""), HasSubstr("line 1: the file ends here"));
  EXPECT_THAT(refusal_of("# only\n# comments\n"), HasSubstr("line 3: the file ends here"));
  EXPECT_THAT(refusal_of("x"), HasSubstr("line 1: found \"x\", expected a finite number"));
  EXPECT_THAT(refusal_of("2.5 400 700\n"), HasSubstr("expected a number of wavelengths"));
  EXPECT_THAT(refusal_of("1e9\n"), HasSubstr("expected a number of wavelengths"));
  EXPECT_THAT(refusal_of("2\n700 400\n"), HasSubstr("expected ascending"));
  EXPECT_THAT(refusal_of("2\n500 600\n"), HasSubstr("expected at least 450 to 650"));
  EXPECT_THAT(refusal_of(head), HasSubstr("expected at least one sample"));
  EXPECT_THAT(refusal_of(head + "0.1 0 0.2 3\n1 1"), HasSubstr("line 7: the file ends here"));
  EXPECT_THAT(refusal_of(head + "0.1 0 0.2 3 1 nan 1"), HasSubstr("line 6: found \"nan\""));
  EXPECT_THAT(refusal_of(head + "0.1 0 0.2 3 1 1e999 1"), HasSubstr("found \"1e999\""));
  EXPECT_THAT(refusal_of(head + "30 0 0.2 3 1 1 1"), HasSubstr("found theta_i = 30"));
  EXPECT_THAT(refusal_of(head + "0.1 0 0.2 180 1 1 1"), HasSubstr("found phi_o = 180"));
  EXPECT_THAT(refusal_of(head + "0.1 0 0.2 3 1 -5 1"), HasSubstr("found a BRDF of -5"));
  EXPECT_THAT(refusal_of(head + "0.1 0 0.2 3 1 1 1"), HasSubstr("found 1 samples, expected"));
}

ConventionReport report_of(const std::function<Rgb(const DirectionPair&)>& one_way) {
  return check_conventions(one_way, [](const DirectionPair&) { return true; });
}

DirectionPair mirror_image(DirectionPair pair) {
  pair.wi.y() = -pair.wi.y();
  pair.wo.y() = -pair.wo.y();
  return pair;
}

TEST(ConventionCheck, IsContentWithAReciprocalFunction) {
  const NonBilateral f;
  const auto report = report_of([&](const DirectionPair& pair) { return f.evaluate(pair); });
  EXPECT_GT(report.pairs, 1000u);
  EXPECT_LT(report.as_read, 1e-9);
  EXPECT_GT(report.phi_reversed, 0.03);
  EXPECT_THAT(report.warning(), IsEmpty());
}

TEST(ConventionCheck, NamesACosineThatIsStillInTheValues) {
  const NonBilateral f;
  EXPECT_THAT(
      report_of([&](const DirectionPair& p) -> Rgb { return f.evaluate(p) * p.wo.z(); }).warning(),
      HasSubstr("if its values were f cos theta_o"));
  EXPECT_THAT(
      report_of([&](const DirectionPair& p) -> Rgb { return f.evaluate(p) * p.wi.z(); }).warning(),
      HasSubstr("f cos theta_i"));
  EXPECT_THAT(
      report_of([&](const DirectionPair& p) -> Rgb { return f.evaluate(p) / p.wo.z(); }).warning(),
      HasSubstr("or f where f cos theta_o was expected"));
  EXPECT_THAT(report_of([&](const DirectionPair& p) -> Rgb {
                return f.evaluate(p) * p.wi.z() / p.wo.z();
              }).warning(),
              HasSubstr("if light and detector were exchanged"));
}

TEST(ConventionCheck, NamesAnAzimuthThatRunsTheOtherWay) {
  // The azimuth counted from whichever of the two stands higher.
  const NonBilateral f;
  const auto report = report_of([&](const DirectionPair& pair) {
    return f.evaluate(pair.wi.z() > pair.wo.z() ? pair : mirror_image(pair));
  });
  EXPECT_THAT(report.warning(), HasSubstr("if the azimuth ran the other way"));
}

TEST(ConventionCheck, SaysSoWhenNothingCanBeCompared) {
  const auto report = check_conventions([](const DirectionPair&) { return Rgb(Rgb::Ones()); },
                                        [](const DirectionPair&) { return false; });
  EXPECT_EQ(report.pairs, 0u);
  EXPECT_THAT(report.warning(), IsEmpty());
  EXPECT_THAT(report.text(), HasSubstr("cannot be tested"));
}

}  // namespace
}  // namespace gonio::brdf
