#include "gonio/brdf/convention_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

namespace gonio::brdf {
namespace {

constexpr int kPairs = 2000;
constexpr double kNearest_deg = 5.0;
constexpr double kFarthest_deg = 75.0;
/// Darker values are noise in every database.
constexpr double kDark_per_sr = 1e-3;
constexpr double kClearlyBetter = 0.6;
constexpr double kLeastGain = 0.01;

/// Low-discrepancy numbers in [0, 1): additive recurrence of the plastic number's powers in three
/// dimensions (Roberts 2018).
std::array<double, 3> spread(int i) {
  constexpr std::array<double, 3> kSteps = {0.8191725133961645, 0.6710436067037893,
                                            0.5497004779019703};
  std::array<double, 3> at{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double sum = 0.5 + kSteps[k] * i;
    at[k] = sum - std::floor(sum);
  }
  return at;
}

DirectionPair mirrored(DirectionPair pair) {
  pair.wi.y() = -pair.wi.y();
  pair.wo.y() = -pair.wo.y();
  return pair;
}

double median(std::vector<double>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

ConventionReport check_conventions(const std::function<Rgb(const DirectionPair&)>& one_way,
                                   const std::function<bool(const DirectionPair&)>& covers) {
  // as read, reversed, and a cosine ratio to the power -1, 1, 2.
  std::array<std::vector<double>, 5> asymmetry;
  for (int i = 0; i < kPairs; ++i) {
    const std::array<double, 3> at = spread(i);
    const auto polar = [](double u) {
      return Angle::from_degrees(kNearest_deg + u * (kFarthest_deg - kNearest_deg));
    };
    const DirectionPair there{direction(polar(at[0]), Angle()),
                              direction(polar(at[1]), Angle::from_degrees(360.0 * at[2]))};
    const DirectionPair back{there.wo, there.wi};
    if (!covers(there) || !covers(back) || !covers(mirrored(back))) continue;
    const double f_there = one_way(there).mean();
    const double f_back = one_way(back).mean();
    const double f_reversed = one_way(mirrored(back)).mean();
    if (!(std::fmin(std::fmin(f_there, f_back), f_reversed) > kDark_per_sr)) continue;
    const double difference = std::log(f_there / f_back);
    const double cosines = std::log(there.wo.z() / there.wi.z());
    asymmetry[0].push_back(std::abs(difference));
    asymmetry[1].push_back(std::abs(std::log(f_there / f_reversed)));
    asymmetry[2].push_back(std::abs(difference - cosines));
    asymmetry[3].push_back(std::abs(difference + cosines));
    asymmetry[4].push_back(std::abs(difference + 2.0 * cosines));
  }
  ConventionReport report;
  report.pairs = asymmetry[0].size();
  report.as_read = median(asymmetry[0]);
  report.phi_reversed = median(asymmetry[1]);
  report.holds_f_cos_o = median(asymmetry[2]);
  report.holds_f_cos_i = median(asymmetry[3]);
  report.exchanged = median(asymmetry[4]);
  return report;
}

std::string ConventionReport::text() const {
  if (pairs == 0) return "reciprocity cannot be tested: no pair of directions is covered both ways";
  char line[240];
  std::snprintf(
      line, sizeof line,
      "reciprocal within %.1f %% as read (azimuth reversed %.1f %%, values taken as f cos "
      "theta_o %.1f %%, as f cos theta_i %.1f %%, light and detector exchanged %.1f %%)",
      100.0 * as_read, 100.0 * phi_reversed, 100.0 * holds_f_cos_o, 100.0 * holds_f_cos_i,
      100.0 * exchanged);
  return line;
}

std::string ConventionReport::warning() const {
  struct Other {
    double asymmetry;
    const char* words;
  };
  const std::array<Other, 4> others = {{
      {phi_reversed, "if the azimuth ran the other way"},
      {holds_f_cos_o, "if its values were f cos theta_o"},
      {holds_f_cos_i, "if its values were f cos theta_i (or f where f cos theta_o was expected)"},
      {exchanged, "if light and detector were exchanged"},
  }};
  const Other best =
      *std::min_element(others.begin(), others.end(),
                        [](const Other& a, const Other& b) { return a.asymmetry < b.asymmetry; });
  if (pairs == 0 || best.asymmetry > kClearlyBetter * as_read ||
      as_read - best.asymmetry < kLeastGain) {
    return {};
  }
  char line[240];
  std::snprintf(
      line, sizeof line,
      "reciprocal only within %.1f %%, but within %.1f %% %s: was it written under another "
      "convention?",
      100.0 * as_read, 100.0 * best.asymmetry, best.words);
  return line;
}

}  // namespace gonio::brdf
