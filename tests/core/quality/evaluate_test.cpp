#include "gonio/quality/evaluate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/design/published_sets.h"
#include "gonio/parallel/parallel.h"

namespace gonio::quality {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

/// A diffuse body under a gloss: quick to evaluate at a million cells.
class Glossy final : public brdf::BrdfModel {
 public:
  Glossy(const brdf::Rgb& body, double gloss, double sharpness)
      : body_(body), gloss_(gloss), sharpness_(sharpness) {}

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry& g) const override {
    const double tan_h = g.sin_theta_h / g.cos_theta_h;
    const double fresnel = 0.04 + 0.96 * std::pow(1.0 - g.cos_theta_d, 5);
    return body_ + gloss_ * fresnel * std::exp(-sharpness_ * tan_h * tan_h);
  }

  brdf::Rgb body_;
  double gloss_;
  double sharpness_;
};

const std::vector<Glossy>& materials() {
  static const std::vector<Glossy> all = {
      {{0.20, 0.15, 0.10}, 0.5, 20}, {{0.05, 0.05, 0.08}, 4, 200}, {{0.02, 0.10, 0.04}, 9, 800},
      {{0.15, 0.02, 0.02}, 2, 60},   {{0.28, 0.27, 0.25}, 1, 9},   {{0.01, 0.01, 0.01}, 7, 90},
      {{0.10, 0.06, 0.20}, 3, 400}};
  return all;
}

constexpr std::size_t kMaterials = 6;  // the seventh stands in for another

struct Problem {
  explicit Problem(std::vector<std::size_t> wanted, const std::vector<std::string>& groups = {})
      : members(std::move(wanted)), set(brdf::RadiometricScale::si) {
    for (std::size_t i = 0; i < members.size(); ++i) {
      basis::MaterialId id{"material-" + std::to_string(members[i]), "", ""};
      if (!groups.empty()) id.group = groups[i];
      set.add(std::move(id), materials()[members[i]]);
    }
    gram = basis::centred_gram(set);
  }
  TruthSource truth() const {
    return [this](std::size_t i) {
      return brdf::tabulate(materials()[members[i]], brdf::RadiometricScale::si);
    };
  }

  std::vector<std::size_t> members;
  basis::TrainingSet set;
  Eigen::MatrixXd gram;
};

const Problem& problem() {
  static const Problem shared({0, 1, 2, 3, 4, 5});
  return shared;
}

EvaluateOptions quick_options() {
  EvaluateOptions options;
  options.folds = 3;
  options.components = 6;
  options.design.starts = 1;
  options.design.polished = 1;
  options.design.start_candidates = 4000;
  return options;
}

Contender ours(int samples = 4) {
  Contender contender;
  contender.label = "ours";
  contender.sample_count = samples;
  return contender;
}

Contender published() {
  Contender contender;
  contender.label = "published";
  contender.directions = design::published_set("nielsen-10").directions;
  contender.reconstruct.method = basis::Method::nielsen;
  return contender;
}

bool same(const std::vector<brdf::HalfDiff>& a, const std::vector<brdf::HalfDiff>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.theta_h == y.theta_h && x.theta_d == y.theta_d && x.phi_d == y.phi_d;
  });
}

TEST(Summarise, GivesQuantilesBetweenRanks) {
  const Summary summary = summarise({5.0, 1.0, 3.0, 2.0, 4.0});
  EXPECT_DOUBLE_EQ(summary.mean, 3.0);
  EXPECT_DOUBLE_EQ(summary.median, 3.0);
  EXPECT_DOUBLE_EQ(summary.tenth_percentile, 1.4);
  EXPECT_DOUBLE_EQ(summary.ninetieth_percentile, 4.6);
}

TEST(Evaluate, ScoresEveryMaterialOnceInItsFold) {
  std::size_t told = 0;
  const auto results =
      evaluate(problem().set, problem().gram, problem().truth(), {ours(), published()},
               quick_options(), [&](const EvaluateProgress& progress) {
                 EXPECT_EQ(progress.done, ++told);
                 EXPECT_EQ(progress.total, 2 * kMaterials);
               });
  ASSERT_TRUE(results.has_value());
  ASSERT_THAT(*results, SizeIs(2));
  for (const ContenderResult& result : *results) {
    ASSERT_THAT(result.scores, SizeIs(kMaterials));
    EXPECT_THAT(result.designs, SizeIs(3));
    for (std::size_t i = 0; i < kMaterials; ++i) {
      EXPECT_EQ(result.scores[i].material, i);
      EXPECT_EQ(result.scores[i].fold, static_cast<int>(i % 3));
    }
  }
  EXPECT_EQ(told, 2 * kMaterials);
  EXPECT_THAT((*results)[0].designs[0].directions, SizeIs(4));
  EXPECT_THAT((*results)[1].designs[0].directions, SizeIs(10));
  EXPECT_GT((*results)[0].designs[0].condition_number, 1.0);
  EXPECT_GT((*results)[0].designs[0].xu_metric, 0.0);
}

TEST(Evaluate, LearnsNothingFromWhatItTests) {
  // Another material in place of a tested one, and no Gram entry of either tested one: its fold's
  // design and the other score of that fold stay as they were, to the last bit.
  EvaluateOptions options = quick_options();
  options.tested = {0, 3};  // fold 0
  const auto before = evaluate(problem().set, problem().gram, problem().truth(), {ours()}, options);
  const Problem changed({6, 1, 2, 3, 4, 5});
  Eigen::MatrixXd blotted = problem().gram;
  for (const Eigen::Index tested : {0, 3}) {
    blotted.middleRows(3 * tested, 3).setConstant(std::nan(""));
    blotted.middleCols(3 * tested, 3).setConstant(std::nan(""));
  }
  const auto after = evaluate(changed.set, blotted, changed.truth(), {ours()}, options);
  EXPECT_TRUE(same((*before)[0].designs[0].directions, (*after)[0].designs[0].directions));
  EXPECT_EQ((*before)[0].designs[0].xu_metric, (*after)[0].designs[0].xu_metric);
  EXPECT_EQ((*before)[0].scores[1].errors.lighting_a.psnr_db,
            (*after)[0].scores[1].errors.lighting_a.psnr_db);
  EXPECT_NE((*before)[0].scores[0].errors.lighting_a.psnr_db,
            (*after)[0].scores[0].errors.lighting_a.psnr_db);
}

TEST(Evaluate, KeepsSiblingsInOneFold) {
  const Problem twins({0, 1, 2, 3, 4, 5}, {"", "twins", "", "twins", "", ""});
  const auto results =
      evaluate(twins.set, twins.gram, twins.truth(), {published()}, quick_options());
  EXPECT_EQ((*results)[0].scores[3].fold, 1);  // with material 1, not in 3 modulo 3
  EXPECT_EQ((*results)[0].scores[2].fold, 2);
  EXPECT_EQ((*results)[0].scores[4].fold, 0);  // the fourth group
}

TEST(Evaluate, SpreadsGroupsOverTheFoldsWhereverTheyStand) {
  EvaluateOptions options = quick_options();
  options.folds = 2;
  const Problem two({0, 1, 2, 3, 4, 5}, {"a", "a", "b", "b", "b", "b"});  // both begin evenly
  const auto results = evaluate(two.set, two.gram, two.truth(), {published()}, options);
  for (const MaterialScore& score : (*results)[0].scores) {
    EXPECT_EQ(score.fold, score.material < 2 ? 0 : 1);
  }
  options.folds = 3;
  EXPECT_THAT(
      [&] { evaluate(two.set, two.gram, two.truth(), {published()}, options); },
      ThrowsMessage<std::invalid_argument>(HasSubstr("the number of groups of siblings, 2")));
}

TEST(Evaluate, TestsOnlyWhatIsAskedForButTrainsOnTheRest) {
  EvaluateOptions options = quick_options();
  options.folds = 6;
  options.tested = {4};
  const auto results =
      evaluate(problem().set, problem().gram, problem().truth(), {published()}, options);
  ASSERT_THAT((*results)[0].scores, SizeIs(1));
  EXPECT_EQ((*results)[0].scores[0].material, 4u);
  EXPECT_THAT((*results)[0].designs, SizeIs(1));
}

TEST(Evaluate, ChoosesPosesForWhatAPatchShowsOrByTheirCentresAlone) {
  EvaluateOptions options = quick_options();
  options.tested = {1};
  options.pose_design.starts = 1;
  options.pose_design.polished = 1;
  options.pose_design.start_candidates = 500;
  options.pose_design.refine_step_deg = 0.0;
  options.noise.relative = 0.03;
  Contender patch = ours(3);
  patch.patch = PatchGeometry::of_half_width(25.0);
  Contender centres = patch;
  centres.chosen_as_points = true;
  const auto results = evaluate(problem().set, problem().gram, problem().truth(),
                                {patch, centres, ours(3)}, options);
  const auto directions = [&](std::size_t contender) {
    return (*results)[contender].designs.at(0).directions;
  };
  EXPECT_THAT(directions(0), SizeIs(3));
  EXPECT_FALSE(same(directions(0), directions(1)));
  EXPECT_TRUE(same(directions(1), directions(2)));
  // The same directions, measured as patches of 25 and as points.
  EXPECT_LT((*results)[1].weighted_log_rmse().mean, (*results)[2].weighted_log_rmse().mean);
}

TEST(Evaluate, ScoresNearFieldShotsAndWhatWasSaidOfThem) {
  EvaluateOptions options = quick_options();
  options.tested = {4};
  options.trust = true;
  Contender shots = ours(1);
  shots.near_field = design::NearFieldSetup();
  shots.near_field->image_px = 16;
  shots.directions = {
      {Angle::from_degrees(5.0), Angle::from_degrees(20.0), Angle::from_degrees(90.0), Angle()}};
  const auto results =
      evaluate(problem().set, problem().gram, problem().truth(), {shots, published()}, options);
  const MaterialScore& score = (*results)[0].scores.at(0);
  EXPECT_TRUE(std::isfinite(score.errors.lighting_a.psnr_db));
  ASSERT_TRUE(score.trust.has_value());
  EXPECT_GE(score.trust->coverage.in_95, score.trust->coverage.in_68);
  EXPECT_GT(score.trust->coverage.in_95, 0.0);
  EXPECT_LE(score.trust->coverage.in_95, 1.0);
  EXPECT_FALSE(score.trust->expected_psnr_db.has_value()) << "four materials foresee nothing";
  EXPECT_FALSE((*results)[1].scores.at(0).trust.has_value()) << "it leaves nothing out";
}

TEST(Evaluate, FindsNoiseWorseThanNone) {
  EvaluateOptions options = quick_options();
  options.tested = {1};
  const auto clean = evaluate(problem().set, problem().gram, problem().truth(), {ours()}, options);
  options.noise.relative = 0.3;
  options.draws = 2;
  const auto noisy = evaluate(problem().set, problem().gram, problem().truth(), {ours()}, options);
  EXPECT_GT((*noisy)[0].weighted_log_rmse().mean, (*clean)[0].weighted_log_rmse().mean);
}

TEST(Evaluate, GivesTheSameFiguresWithOneThreadAndWithMany) {
  EvaluateOptions options = quick_options();
  options.tested = {3};
  options.noise.relative = 0.03;
  parallel::set_thread_count(1);
  const auto one = evaluate(problem().set, problem().gram, problem().truth(), {ours()}, options);
  parallel::set_thread_count(3);
  const auto three = evaluate(problem().set, problem().gram, problem().truth(), {ours()}, options);
  parallel::set_thread_count(0);
  EXPECT_EQ((*one)[0].psnr_a_db().mean, (*three)[0].psnr_a_db().mean);
  EXPECT_EQ((*one)[0].weighted_log_rmse().mean, (*three)[0].weighted_log_rmse().mean);
}

TEST(Evaluate, ReturnsNothingWhenStopped) {
  std::stop_source source;
  source.request_stop();
  EXPECT_FALSE(evaluate(problem().set, problem().gram, problem().truth(), {ours()}, quick_options(),
                        {}, source.get_token())
                   .has_value());
}

TEST(Evaluate, RefusesOptionsThatDoNotFit) {
  const auto run = [](const EvaluateOptions& options, const std::vector<Contender>& contenders) {
    return evaluate(problem().set, problem().gram, problem().truth(), contenders, options);
  };
  EvaluateOptions options = quick_options();
  options.folds = 7;
  EXPECT_THAT([&] { run(options, {ours()}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("folds is 7")));
  options = quick_options();
  options.tested = {6};
  EXPECT_THROW(run(options, {ours()}), std::invalid_argument);
  EXPECT_THROW(run(quick_options(), {}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::quality
