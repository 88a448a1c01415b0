#include "gonio/quality/homogeneity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "gonio/random/stream.h"

namespace gonio::quality {
namespace {

constexpr double kDarkSigmas = 3.0;
/// What a good fit leaves anyway, nepers: keeps a few noise-free samples from deciding alone.
constexpr double kFitFloor = 0.05;
/// A fit may fail altogether at some direction; one such sample must not make a pattern.
constexpr double kLargestResidual = 1.0;
constexpr std::size_t kLeastPoses = 8;
constexpr std::size_t kAllSigns = 10;  // that may turn: up to then every choice is tried
constexpr std::size_t kDraws = 1024;
constexpr int kMostSpots = 99 * 99;

struct Residual {
  int spot;
  std::size_t channel;
  double value;  ///< nepers
  double weight;
};

std::map<int, std::vector<Residual>> residuals_by_pose(const samples::SampleSet& set,
                                                       const Eigen::MatrixXd& fitted) {
  std::map<int, std::vector<Residual>> poses;
  for (std::size_t i = 0; i < set.samples.size(); ++i) {
    const samples::Sample& sample = set.samples[i];
    if (sample.pose < 0 || sample.spot < 0 || sample.spot >= kMostSpots) continue;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const auto c = static_cast<Eigen::Index>(channel);
      const double value = sample.value_per_sr[c];
      const double sigma = sample.sigma_per_sr[c];
      const double fit = fitted(static_cast<Eigen::Index>(i), c);
      if (!(value > kDarkSigmas * sigma) || !(fit > 0.0)) continue;
      const double weight = 1.0 / (sigma * sigma / (value * value) + kFitFloor * kFitFloor);
      poses[sample.pose].push_back({sample.spot, channel, std::log(value / fit), weight});
    }
  }
  return poses;
}

/// Per pose (a column) the weighted residuals of all spots, summed over channels, each channel less
/// its mean over the pose.
struct Patterns {
  Eigen::MatrixXd of_pose;  ///< spots x poses
  Eigen::VectorXd weight;   ///< of all poses, by spot
};

Patterns patterns_of(const std::map<int, std::vector<Residual>>& poses, Eigen::Index spots) {
  Patterns patterns{Eigen::MatrixXd::Zero(spots, static_cast<Eigen::Index>(poses.size())),
                    Eigen::VectorXd::Zero(spots)};
  Eigen::Index column = 0;
  for (const auto& [pose, residuals] : poses) {
    std::array<double, 3> sum{};
    std::array<double, 3> weight{};
    for (const Residual& each : residuals) {
      sum[each.channel] += each.weight * each.value;
      weight[each.channel] += each.weight;
    }
    for (const Residual& each : residuals) {
      const double centred = std::clamp(each.value - sum[each.channel] / weight[each.channel],
                                        -kLargestResidual, kLargestResidual);
      patterns.of_pose(each.spot, column) += each.weight * centred;
      patterns.weight[each.spot] += each.weight;
    }
    ++column;
  }
  return patterns;
}

}  // namespace

HomogeneityCheck check_homogeneity(const samples::SampleSet& set,
                                   const Eigen::MatrixXd& fitted_per_sr, double false_alarm_rate,
                                   double least_rms, std::uint64_t seed) {
  if (fitted_per_sr.rows() != static_cast<Eigen::Index>(set.samples.size()) ||
      fitted_per_sr.cols() != 3) {
    throw std::invalid_argument("homogeneity: a fit of " + std::to_string(fitted_per_sr.rows()) +
                                " x " + std::to_string(fitted_per_sr.cols()) + " values for " +
                                std::to_string(set.samples.size()) + " samples");
  }
  std::map<int, std::vector<Residual>> poses = residuals_by_pose(set, fitted_per_sr);
  std::erase_if(poses, [](const auto& pose) {
    return std::all_of(pose.second.begin(), pose.second.end(),
                       [&](const Residual& each) { return each.spot == pose.second.front().spot; });
  });
  HomogeneityCheck check;
  check.poses = static_cast<int>(poses.size());
  int spots = 0;
  for (const auto& [pose, residuals] : poses) {
    for (const Residual& each : residuals) spots = std::max(spots, each.spot + 1);
  }
  check.pattern.assign(static_cast<std::size_t>(spots), 0.0);
  if (poses.size() < kLeastPoses) return check;
  check.applicable = true;

  const Patterns patterns = patterns_of(poses, spots);
  const Eigen::ArrayXd known = (patterns.weight.array() > 0.0).cast<double>();
  const Eigen::ArrayXd weight = patterns.weight.array().max(1e-300);
  const auto statistic = [&](const Eigen::VectorXd& sum) {
    return (known * sum.array().square() / weight).sum();
  };
  const Eigen::Index count = patterns.of_pose.cols();
  const Eigen::VectorXd as_measured = patterns.of_pose.rowwise().sum();
  const Eigen::VectorXd squares = patterns.of_pose.cwiseAbs2().rowwise().sum();
  const double found = statistic(as_measured);
  // The first pose keeps its sign: turning all of them changes nothing.
  const auto turned = static_cast<std::size_t>(count - 1);
  const bool all = turned <= kAllSigns;
  const std::size_t draws = all ? std::size_t{1} << turned : kDraws;
  random::Stream draw(random::make_key(seed, "quality.homogeneity"));
  std::size_t as_large = 0;
  Eigen::VectorXd signs = Eigen::VectorXd::Ones(count);
  Eigen::VectorXd sum(spots);
  for (std::size_t i = 0; i < draws; ++i) {
    for (std::size_t pose = 0; pose < turned; ++pose) {
      // The first draw is the measurement itself.
      const bool turn = all ? ((i >> pose) & 1U) != 0 : i > 0 && draw.below(2) == 1;
      signs[static_cast<Eigen::Index>(pose) + 1] = turn ? -1.0 : 1.0;
    }
    sum.noalias() = patterns.of_pose * signs;
    // Rounding of the sums must not tell the measurement from itself.
    if (statistic(sum) >= found * (1.0 - 1e-9)) ++as_large;
  }
  check.p_value = static_cast<double>(as_large) / static_cast<double>(draws);

  const Eigen::ArrayXd excess = as_measured.array().square() - squares.array();
  const double spots_known = known.sum();
  check.rms = std::sqrt(
      std::max(0.0, (known * excess / weight.square()).sum() / std::max(spots_known, 1.0)));
  for (Eigen::Index spot = 0; spot < spots; ++spot) {
    check.pattern[static_cast<std::size_t>(spot)] =
        known[spot] * std::expm1(as_measured[spot] / weight[spot]);
  }
  check.passed = check.p_value > false_alarm_rate || check.rms < least_rms;
  return check;
}

}  // namespace gonio::quality
