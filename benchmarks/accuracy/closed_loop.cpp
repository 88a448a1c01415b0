// The closed loop held out: every material is measured with a basis and directions that have seen
// neither it nor the rest of its fold. Writes true and foreseen scores, which
// docs/results/closed_loop.py makes figures of; docs/results.md, "Closed loop".
//
//   closed_loop FOLDER TABLE.csv [FIRST_FOLD LAST_FOLD]     folds 0 to 4
//   closed_loop outliers FOLDER TABLE.csv                   ten points, one of them spoiled

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "gonio/basis/dense_field.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/basis/training_set.h"
#include "gonio/brdf/material_file.h"
#include "gonio/design/image_importance.h"
#include "gonio/design/leave_one_out.h"
#include "gonio/design/pose_extension.h"
#include "gonio/quality/closed_loop.h"
#include "gonio/quality/metrics.h"
#include "gonio/quality/synthetic_samples.h"
#include "gonio/quality/verdict.h"
#include "gonio/random/stream.h"

namespace gonio {
namespace {

constexpr int kFolds = 5;
constexpr int kFirst = 5;
constexpr int kMost = 40;
constexpr std::uint64_t kSeed = 1;
constexpr int kCounts[] = {5, 6, 7, 8, 9, 10, 12, 14, 17, 20, 24, 28, 33, 40};
constexpr double kFailing = 0.2;
constexpr double kAvoided_deg = 5.0;
const quality::SyntheticNoise kNoise{0.03, 0.0, Angle()};
const design::PoseNoise kDesignNoise{0.03, 0.0, 0.3};

struct Truth {
  std::vector<std::filesystem::path> files;
  brdf::BrdfTable table(std::size_t i) const { return brdf::read_material(files[i]); }
};

design::PoseCandidates candidates() {
  const auto allowed = [](const brdf::HalfDiff& pose) {
    return design::within(design::DirectionLimits{}, pose);
  };
  return {design::pose_grid(5.0, allowed), allowed, {}};
}

struct Design {
  Eigen::MatrixXd importance;
  std::vector<brdf::HalfDiff> sequence;  ///< kMost of them
  std::vector<brdf::HalfDiff> ten;
};

Design design_for(const basis::Basis& basis) {
  Design found;
  found.importance =
      design::blended_importance(basis, basis.left_vectors, design::ImportanceBlend::for_points());
  design::PoseDesignOptions options;
  options.noise = kDesignNoise;
  options.seed = kSeed;
  options.pose_count = kFirst;
  const design::PoseCandidates all = candidates();
  found.sequence = design::choose_poses(basis, found.importance, all, {}, options).poses;
  const auto more = design::extend_poses(basis, found.importance, all, found.sequence, {},
                                         kDesignNoise, kMost - kFirst);
  found.sequence.insert(found.sequence.end(), more.poses.begin(), more.poses.end());
  options.pose_count = 10;
  found.ten = design::choose_poses(basis, found.importance, all, {}, options).poses;
  return found;
}

struct Score {
  double psnr_db = 0.0;
  std::optional<quality::Outlook> outlook;
};

Score score(const basis::Basis& basis, const brdf::BrdfTable& truth, const brdf::TableBrdf& model,
            const std::vector<brdf::HalfDiff>& directions, std::size_t stream, bool foreseen) {
  const samples::SampleSet set =
      quality::synthetic_samples(model, basis.scale, directions, {}, kNoise, kSeed, stream);
  const basis::Fit fit = basis::fit(basis, set);
  const brdf::BrdfTable found = basis::expand(basis, fit.coefficients);
  Score result;
  result.psnr_db = quality::picture_error(truth, found, render::MetricLighting::a).psnr_db;
  if (foreseen) result.outlook = quality::outlook(basis, fit);
  return result;
}

/// Ten points of which each fails with kFailing; a failed one is left out, or replaced.
std::vector<brdf::HalfDiff> with_failures(const basis::Basis& basis, const Design& design,
                                          bool replaced, std::size_t material) {
  random::Stream draw(random::make_key(kSeed, "closed_loop.failures", material));
  std::vector<brdf::HalfDiff> left = design.ten;
  std::vector<brdf::HalfDiff> measured;
  std::vector<brdf::HalfDiff> failed;
  const design::PoseCandidates all = candidates();
  while (!left.empty()) {
    const brdf::HalfDiff next = left.front();
    left.erase(left.begin());
    if (draw.uniform() >= kFailing) {
      measured.push_back(next);
      continue;
    }
    failed.push_back(next);
    if (!replaced) continue;
    std::vector<brdf::HalfDiff> kept = measured;
    kept.insert(kept.end(), left.begin(), left.end());
    const auto found = design::extend_poses(
        basis, design.importance, design::away_from(all, failed, Angle::from_degrees(kAvoided_deg)),
        kept, {}, kDesignNoise, 1);
    left.insert(left.end(), found.poses.begin(), found.poses.end());
  }
  return measured;
}

/// The held-out folds of the materials of a folder.
struct Folds {
  Truth truth;
  basis::TrainingSet set;
  Eigen::MatrixXd gram;

  static std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == ".binary") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
  }

  explicit Folds(const std::filesystem::path& folder)
      : truth{files_in(folder)}, set(brdf::material_scale(truth.files.front())) {
    std::vector<basis::MaterialFile> files;
    for (const auto& file : truth.files) files.push_back({file, ""});
    set.add_files(files);
    gram = basis::centred_gram(set);
  }

  std::string name(std::size_t material) const { return truth.files[material].stem().string(); }

  struct Fold {
    basis::Basis basis;
    std::vector<std::size_t> testing;
  };
  Fold fold(int number) const {
    std::vector<std::size_t> training;
    std::vector<std::size_t> testing;
    for (std::size_t i = 0; i < set.material_count(); ++i) {
      (static_cast<int>(i % kFolds) == number ? testing : training).push_back(i);
    }
    return {basis::train(set, gram, training), std::move(testing)};
  }
};

void run(const std::filesystem::path& folder, const std::filesystem::path& out, int first,
         int last) {
  const Folds folds(folder);
  std::ofstream table(out);
  table << "fold,kind,material,n,psnr,expected,sd,innovation,usual_innovation,nearest\n";
  for (int number = first; number <= last; ++number) {
    const Folds::Fold fold = folds.fold(number);
    const basis::Basis& basis = fold.basis;
    const Design design = design_for(basis);
    for (const std::size_t material : fold.testing) {
      const brdf::BrdfTable known = folds.truth.table(material);
      const brdf::TableBrdf model(known);
      const auto add_row = [&](const char* kind, const std::vector<brdf::HalfDiff>& directions,
                               bool foreseen) {
        const Score found = score(basis, known, model, directions, material, foreseen);
        table << fmt::format("{},{},{},{},{:.3f}", number, kind, folds.name(material),
                             directions.size(), found.psnr_db);
        if (found.outlook) {
          const std::vector<double>& usual = found.outlook->left_out_innovations;
          table << fmt::format(",{:.3f},{:.3f},{:.4g},{:.4g},{:.4g}",
                               found.outlook->expected_psnr_db, found.outlook->sd_db,
                               found.outlook->innovation, usual[(usual.size() - 1) * 19 / 20],
                               found.outlook->nearest);
        }
        table << "\n" << std::flush;
      };
      for (const int n : kCounts) {
        add_row("sequence", {design.sequence.begin(), design.sequence.begin() + n}, true);
      }
      add_row("ten", design.ten, false);
      add_row("failing", with_failures(basis, design, false, material), false);
      add_row("replaced", with_failures(basis, design, true, material), false);
    }
  }
}

/// Which poses of ten are called outliers, where none is and where one is so many times too bright.
void run_outliers(const std::filesystem::path& folder, const std::filesystem::path& out) {
  const Folds folds(folder);
  std::ofstream table(out);
  table << "fold,material,times,limit,found,others\n";
  for (int number = 0; number < kFolds; ++number) {
    const Folds::Fold fold = folds.fold(number);
    const Design design = design_for(fold.basis);
    for (const std::size_t material : fold.testing) {
      const brdf::TableBrdf model(folds.truth.table(material));
      random::Stream draw(random::make_key(kSeed, "closed_loop.outliers", material));
      const int spoiled =
          std::min(9, static_cast<int>(draw.uniform() * static_cast<double>(design.ten.size())));
      for (const double times : {1.0, 1.3, 2.0, 4.0}) {
        samples::SampleSet set = quality::synthetic_samples(model, fold.basis.scale, design.ten, {},
                                                            kNoise, kSeed, material);
        for (samples::Sample& sample : set.samples) {
          if (sample.pose != spoiled) continue;
          sample.value_per_sr *= times;
          sample.sigma_per_sr *= times;
        }
        const basis::Fit fit = basis::fit(fold.basis, set);
        for (const double limit : {2.0, 2.5, 3.0, 4.0, 5.0}) {
          const std::vector<int> found = quality::outlying_poses(set, fit, limit);
          const auto right = std::count(found.begin(), found.end(), spoiled);
          table << fmt::format("{},{},{},{},{},{}\n", number, folds.name(material), times, limit,
                               right, static_cast<std::ptrdiff_t>(found.size()) - right)
                << std::flush;
        }
      }
    }
  }
}

}  // namespace
}  // namespace gonio

int main(int argc, char** argv) {
  if (argc == 4 && std::string(argv[1]) == "outliers") {
    gonio::run_outliers(argv[2], argv[3]);
    return 0;
  }
  if (argc != 3 && argc != 5) {
    std::fputs(
        "closed_loop FOLDER TABLE.csv [FIRST_FOLD LAST_FOLD]\n"
        "closed_loop outliers FOLDER TABLE.csv\n",
        stderr);
    return 2;
  }
  gonio::run(argv[1], argv[2], argc == 5 ? std::atoi(argv[3]) : 0,
             argc == 5 ? std::atoi(argv[4]) : 4);
  return 0;
}
