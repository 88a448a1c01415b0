// The figures the project is judged on, on the 90 decoded MERL materials.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <vector>

#include "gonio/brdf/merl_file.h"
#include "gonio/design/published_sets.h"
#include "gonio/quality/evaluate.h"

namespace gonio::quality {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDecodedMaterials = 90;

/// In the order of their names, which is that of the list they were decoded from.
std::vector<basis::MaterialFile> merl_files() {
  std::vector<basis::MaterialFile> files;
  const char* root = std::getenv("GONIO_REAL_DATA");
  if (root == nullptr) return files;
  for (const fs::path& folder : {fs::path(root) / "merl", fs::path(root)}) {
    std::error_code missing;
    for (const auto& entry : fs::directory_iterator(folder, missing)) {
      if (entry.path().extension() == ".binary") files.push_back({entry.path(), ""});
    }
    if (!files.empty()) break;
  }
  std::sort(files.begin(), files.end(),
            [](const auto& a, const auto& b) { return a.path < b.path; });
  return files;
}

class EvaluateRealData : public testing::Test {
 protected:
  void SetUp() override {
    if (files.size() != kDecodedMaterials) {
      GTEST_SKIP() << "GONIO_REAL_DATA names no folder with the " << kDecodedMaterials
                   << " decoded MERL materials, but one with " << files.size();
    }
    set.add_files(files);
  }

  /// Held out, as `gonio evaluate` does it.
  std::vector<ContenderResult> scores(const std::vector<Contender>& contenders,
                                      const EvaluateOptions& options) {
    return evaluate(
               set, basis::centred_gram(set),
               [&](std::size_t i) { return brdf::read_merl(files[i].path); }, contenders, options)
        .value();
  }

  std::vector<basis::MaterialFile> files = merl_files();
  basis::TrainingSet set{brdf::RadiometricScale::merl};
};

TEST_F(EvaluateRealData, TenChosenDirectionsReachTheBarAndThePublishedTenDoNot) {
  Contender ours;
  ours.label = "ours";
  ours.sample_count = 10;
  Contender published;
  published.label = "published";
  published.directions = design::published_set("nielsen-10").directions;
  published.reconstruct.method = basis::Method::nielsen;
  const std::vector<ContenderResult> results = scores({ours, published}, EvaluateOptions());
  const ContenderResult& found = results[0];
  EXPECT_GE(found.psnr_a_db().mean, 35.4);
  EXPECT_LE(found.grazing_log_rmse().mean, 0.21);
  EXPECT_NEAR(found.grazing_log_bias().mean, 0.0, 0.02);
  // The authors' own method on the same materials, as others have found it to within half a
  // decibel.
  EXPECT_NEAR(results[1].psnr_a_db().mean, 28.2, 0.8);
  EXPECT_NEAR(results[1].grazing_log_rmse().mean, 0.232, 0.02);
}

TEST_F(EvaluateRealData, BandsHoldWhatTheyPromiseOnTwoFolds) {
  Contender ours;
  ours.sample_count = 10;
  EvaluateOptions options;
  options.trust = true;
  options.noise.relative = 0.03;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (i % 5 < 2) options.tested.push_back(i);
  }
  const std::vector<ContenderResult> results = scores({ours}, options);
  double in_68 = 0.0;
  double in_95 = 0.0;
  int below = 0;
  ASSERT_EQ(results.front().scores.size(), 36U);
  for (const MaterialScore& score : results.front().scores) {
    in_68 += score.trust.value().coverage.in_68 / 36.0;
    in_95 += score.trust.value().coverage.in_95 / 36.0;
    if (score.trust.value().coverage.in_95 < 0.9) ++below;
  }
  EXPECT_GE(in_68, 0.62);
  EXPECT_LE(in_68, 0.76);
  EXPECT_GE(in_95, 0.90);
  EXPECT_LE(in_95, 0.98);
  // A fifth of the materials, and the scatter of that count between folds.
  EXPECT_LE(below, 9);
}

}  // namespace
}  // namespace gonio::quality
