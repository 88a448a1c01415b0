#include "gonio/quality/evaluate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "gonio/brdf/builtin_materials.h"
#include "gonio/design/published_sets.h"
#include "gonio/parallel/parallel.h"

namespace gonio::quality {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

/// Every `step`-th built-in material.
std::vector<const brdf::BuiltinMaterial*> few_materials() {
  std::vector<const brdf::BuiltinMaterial*> few;
  const auto& all = brdf::builtin_materials();
  for (std::size_t i = 0; i < 8; ++i) few.push_back(&all[i * all.size() / 8]);
  return few;
}

struct Problem {
  explicit Problem(std::vector<const brdf::BuiltinMaterial*> wanted)
      : materials(std::move(wanted)), set(brdf::RadiometricScale::si) {
    for (const auto* material : materials) {
      set.add({material->name, material->family, ""}, *material->model);
    }
    gram = basis::centred_gram(set);
  }
  TruthSource truth() const {
    return [this](std::size_t i) {
      return brdf::tabulate(*materials[i]->model, brdf::RadiometricScale::si);
    };
  }

  std::vector<const brdf::BuiltinMaterial*> materials;
  basis::TrainingSet set;
  Eigen::MatrixXd gram;
};

const Problem& problem() {
  static const Problem shared(few_materials());
  return shared;
}

EvaluateOptions quick_options() {
  EvaluateOptions options;
  options.folds = 4;
  options.components = 12;
  options.design.starts = 1;
  options.design.polished = 1;
  options.design.start_candidates = 4000;
  return options;
}

Contender ours(int samples = 6) {
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
                 EXPECT_EQ(progress.total, 16u);
               });
  ASSERT_TRUE(results.has_value());
  ASSERT_THAT(*results, SizeIs(2));
  for (const ContenderResult& result : *results) {
    ASSERT_THAT(result.scores, SizeIs(8));
    EXPECT_THAT(result.designs, SizeIs(4));
    for (std::size_t i = 0; i < 8; ++i) {
      EXPECT_EQ(result.scores[i].material, i);
      EXPECT_EQ(result.scores[i].fold, static_cast<int>(i % 4));
    }
  }
  EXPECT_EQ(told, 16u);
  EXPECT_THAT((*results)[0].designs[0].directions, SizeIs(6));
  EXPECT_THAT((*results)[1].designs[0].directions, SizeIs(10));
  EXPECT_GT((*results)[0].designs[0].condition_number, 1.0);
  EXPECT_GT((*results)[0].designs[0].xu_metric, 0.0);
}

TEST(Evaluate, LearnsNothingFromWhatItTests) {
  // Another material in place of a tested one must leave its fold's design and the other scores of
  // that fold as they were, to the last bit of what the Gram matrix's centring lets through.
  std::vector<const brdf::BuiltinMaterial*> others = few_materials();
  others[0] = &brdf::builtin_materials()[brdf::builtin_materials().size() - 2];
  ASSERT_NE(others[0], few_materials()[0]);
  const Problem changed(others);
  EvaluateOptions options = quick_options();
  options.tested = {0, 4};  // fold 0
  const auto before = evaluate(problem().set, problem().gram, problem().truth(), {ours()}, options);
  const auto after = evaluate(changed.set, changed.gram, changed.truth(), {ours()}, options);
  EXPECT_TRUE(same((*before)[0].designs[0].directions, (*after)[0].designs[0].directions));
  constexpr double kCentringDb = 1e-3;
  EXPECT_NEAR((*before)[0].scores[1].errors.lighting_a.psnr_db,
              (*after)[0].scores[1].errors.lighting_a.psnr_db, kCentringDb);
  EXPECT_NE((*before)[0].scores[0].errors.lighting_a.psnr_db,
            (*after)[0].scores[0].errors.lighting_a.psnr_db);
}

TEST(Evaluate, KeepsSiblingsInOneFold) {
  EvaluateOptions options = quick_options();
  options.groups = {"", "twins", "", "", "", "", "twins", ""};
  const auto results =
      evaluate(problem().set, problem().gram, problem().truth(), {published()}, options);
  EXPECT_EQ((*results)[0].scores[6].fold, 1);  // with material 1, not in 6 modulo 4
  EXPECT_EQ((*results)[0].scores[2].fold, 2);
}

TEST(Evaluate, TestsOnlyWhatIsAskedForButTrainsOnTheRest) {
  EvaluateOptions options = quick_options();
  options.folds = 8;
  options.tested = {5};
  const auto results =
      evaluate(problem().set, problem().gram, problem().truth(), {published()}, options);
  ASSERT_THAT((*results)[0].scores, SizeIs(1));
  EXPECT_EQ((*results)[0].scores[0].material, 5u);
  EXPECT_THAT((*results)[0].designs, SizeIs(1));
}

TEST(Evaluate, FindsNoiseWorseThanNone) {
  EvaluateOptions options = quick_options();
  options.tested = {1, 2};
  const auto clean = evaluate(problem().set, problem().gram, problem().truth(), {ours()}, options);
  options.noise.relative = 0.3;
  options.draws = 3;
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
  options.folds = 9;
  EXPECT_THAT([&] { run(options, {ours()}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("folds is 9")));
  options = quick_options();
  options.groups = {"a"};
  EXPECT_THROW(run(options, {ours()}), std::invalid_argument);
  options = quick_options();
  options.tested = {8};
  EXPECT_THROW(run(options, {ours()}), std::invalid_argument);
  EXPECT_THROW(run(quick_options(), {}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::quality
