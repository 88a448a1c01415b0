#include "gonio/quality/closed_loop.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "gonio/design/criteria.h"
#include "gonio/design/image_importance.h"
#include "gonio/design/leave_one_out.h"
#include "gonio/quality/forecast.h"

namespace gonio::quality {
namespace {

/// What samples have in common; those without a pose stand for themselves.
int pose_of(const samples::SampleSet& samples, std::size_t i) {
  const int pose = samples.samples[i].pose;
  return pose >= 0 ? pose : -1 - static_cast<int>(i);
}

/// Root mean square of each pose's standardised residuals, with its number.
std::vector<std::pair<double, int>> pose_residuals(const samples::SampleSet& samples,
                                                   const basis::Fit& fit) {
  struct Sum {
    double squares = 0.0;
    double count = 0.0;
  };
  std::map<int, Sum> sums;
  for (std::size_t i = 0; i < samples.samples.size(); ++i) {
    Sum& sum = sums[pose_of(samples, i)];
    sum.squares += fit.standardised.row(static_cast<Eigen::Index>(i)).squaredNorm();
    sum.count += static_cast<double>(fit.standardised.cols());
  }
  std::vector<std::pair<double, int>> residuals;
  for (const auto& [pose, sum] : sums) {
    residuals.emplace_back(std::sqrt(sum.squares / sum.count), pose);
  }
  std::sort(residuals.begin(), residuals.end());
  return residuals;
}

}  // namespace

std::vector<int> outlying_poses(const samples::SampleSet& samples, const basis::Fit& fit,
                                double limit) {
  const std::vector<std::pair<double, int>> residuals = pose_residuals(samples, fit);
  std::vector<int> outliers;
  if (residuals.size() < static_cast<std::size_t>(kFewestJudged)) return outliers;
  const double middle = residuals[residuals.size() / 2].first;
  for (const auto& [residual, pose] : residuals) {
    if (residual > limit && residual > limit * middle) outliers.push_back(pose);
  }
  std::sort(outliers.begin(), outliers.end());
  return outliers;
}

std::optional<Prospect> prospect(const basis::Basis& basis, const samples::SampleSet& samples) {
  std::set<int> poses;
  for (std::size_t i = 0; i < samples.samples.size(); ++i) poses.insert(pose_of(samples, i));
  if (poses.size() < static_cast<std::size_t>(kFewestJudged)) return std::nullopt;
  const basis::Fit fit = basis::fit(basis, samples);
  std::optional<Outlook> seen = outlook(basis, fit);
  if (!seen) return std::nullopt;
  const bool doubtful = is_doubtful(*seen);
  return Prospect{std::move(*seen), doubtful, outlying_poses(samples, fit), fit.coefficients};
}

NextPose::NextPose(const basis::Basis& basis, design::PoseCandidates candidates,
                   const design::PatchGeometry& patch, const design::PoseNoise& noise)
    : basis_(basis),
      candidates_(std::move(candidates)),
      patch_(patch.coarse()),
      noise_(noise),
      importance_(design::blended_importance(basis, basis.left_vectors,
                                             patch.is_point()
                                                 ? design::ImportanceBlend::for_points()
                                                 : design::ImportanceBlend::for_patches())) {}

std::optional<brdf::HalfDiff> NextPose::next(const std::vector<brdf::HalfDiff>& kept,
                                             const std::vector<brdf::HalfDiff>& avoid) const {
  const design::PoseExtension found =
      design::extend_poses(basis_, importance_, design::away_from(candidates_, avoid, kKeptAway),
                           kept, patch_, noise_, 1);
  if (found.poses.empty()) return std::nullopt;
  return found.poses.front();
}

double NextPose::gain_db(const std::vector<brdf::HalfDiff>& kept, int count) const {
  if (count <= 0 || kept.empty()) return 0.0;
  std::vector<brdf::HalfDiff> all = kept;
  const design::PoseExtension more =
      design::extend_poses(basis_, importance_, candidates_, kept, patch_, noise_, count);
  all.insert(all.end(), more.poses.begin(), more.poses.end());
  const basis::BasisRows rows(basis_);
  const double m = basis_.row_count();
  const double eta = noise_.model_eta + m * noise_.independent * noise_.independent;
  const auto score_db = [&](const std::vector<brdf::HalfDiff>& poses) {
    const design::LeaveOneOut left_out =
        design::leave_one_out(design::rows_at(rows, poses), basis_.left_vectors, importance_, eta);
    return forecast(basis_, left_out.residuals).psnr_db;
  };
  return std::max(0.0, score_db(all) - score_db(kept));
}

}  // namespace gonio::quality
