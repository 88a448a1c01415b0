#include "pair_agreement.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <tuple>

#include "gonio/acquisition/trust_notes.h"

namespace gonio::acquisition {
namespace {

constexpr double kRepeatLimit = 0.005;
constexpr double kExchangeLimit = 0.01;
constexpr double kLimitSigmas = 4.0;

using SpotsOfPoint = std::map<int, const samples::Sample*>;

/// Logarithm of second over first, averaged with weights by noise over spots and colours.
struct LogRatio {
  double sum = 0.0;
  double weights = 0.0;

  void add(const samples::Sample& first, const samples::Sample& second) {
    for (int colour = 0; colour < 3; ++colour) {
      const double a = first.value_per_sr[colour];
      const double b = second.value_per_sr[colour];
      // A value that is all noise has no logarithm worth weighing.
      constexpr double kLeastSigmas = 5.0;
      const double u_a = first.sigma_per_sr[colour];
      const double u_b = second.sigma_per_sr[colour];
      if (!(u_a > 0.0 && u_b > 0.0 && a > kLeastSigmas * u_a && b > kLeastSigmas * u_b)) continue;
      const double variance = u_a * u_a / (a * a) + u_b * u_b / (b * b);
      sum += std::log(b / a) / variance;
      weights += 1.0 / variance;
    }
  }
};

bool is_exchanged(char branch) { return branch == 'C' || branch == 'D'; }

}  // namespace

bool PairAgreement::agrees() const {
  return std::abs(change_relative) <=
         (exchanged ? kExchangeLimit : kRepeatLimit) + kLimitSigmas * u_relative;
}

std::vector<PairAgreement> pair_agreements(const SessionReader& archive,
                                           const samples::SampleSet& samples, int grid,
                                           double u_monitor) {
  std::map<int, const PointRecord*> rows;  // the last of each point, as it is reduced
  for (const PointRecord& point : archive.points()) rows[point.point] = &point;
  std::map<int, SpotsOfPoint> spots;
  for (const samples::Sample& sample : samples.samples) spots[sample.pose][sample.spot] = &sample;

  std::vector<PairAgreement> pairs;
  std::map<std::tuple<double, double, double>, const PointRecord*> firsts;
  const int middle = grid * grid / 2;
  for (const auto& [index, row] : rows) {
    const brdf::HalfDiff& d = row->commanded;
    const auto [first, is_first] =
        firsts.try_emplace({d.theta_h.radians(), d.theta_d.radians(), d.phi_d.radians()}, row);
    if (is_first || !spots.contains(index) || !spots.contains(first->second->point)) continue;
    PairAgreement pair;
    pair.first = first->second->point;
    pair.second = index;
    pair.exchanged = is_exchanged(first->second->branch) != is_exchanged(row->branch);
    LogRatio ratio;
    for (const auto& [spot, sample] : spots.at(pair.first)) {
      const auto other = spots.at(index).find(spot);
      if (other == spots.at(index).end()) continue;
      if (!pair.exchanged || (spot == middle && grid % 2 == 1)) ratio.add(*sample, *other->second);
    }
    if (!(ratio.weights > 0.0)) continue;
    pair.change_relative = std::expm1(ratio.sum / ratio.weights);
    pair.u_relative = std::sqrt(1.0 / ratio.weights + 2.0 * u_monitor * u_monitor +
                                2.0 * kSentinelRepeatability * kSentinelRepeatability);
    pairs.push_back(pair);
  }
  return pairs;
}

std::string to_text(const std::vector<PairAgreement>& pairs) {
  if (pairs.empty()) return "";
  double change = 0.0;
  double u = 0.0;
  std::ptrdiff_t agree = 0;
  for (const PairAgreement& pair : pairs) {
    change = std::max(change, std::abs(pair.change_relative));
    u = std::max(u, pair.u_relative);
    agree += pair.agrees() ? 1 : 0;
  }
  return fmt::format(
      "{} of {} points measured twice agree with themselves: they differ by {:.2f} % at most, each "
      "known to {:.2f} % or better",
      agree, pairs.size(), 100.0 * change, 100.0 * u);
}

std::string disagreement_text(const PairAgreement& pair) {
  return fmt::format(
      "points {} and {} ({}) differ by {:+.2f} +- {:.2f} %: what was measured between them may "
      "have "
      "changed as much",
      pair.first, pair.second,
      pair.exchanged ? "one direction, light and camera exchanged" : "one pose measured twice",
      100.0 * pair.change_relative, 100.0 * pair.u_relative);
}

}  // namespace gonio::acquisition
