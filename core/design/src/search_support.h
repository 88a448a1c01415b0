#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace gonio::design {

/// What a swap must lower the criterion by, of its value: more than single precision can imagine.
inline constexpr double kLeastImprovement = 1e-6;

/// Sweeps a search usually needs, for the progress shown.
inline constexpr double kUsualSweeps = 4.0;

/// About `wanted` of the candidates at even distances, all when there are no more. The distance is
/// a fraction, so that it does not fall into step with the 180 cells of a phi_d row.
template <typename Candidate>
std::vector<Candidate> even_selection(const std::vector<Candidate>& candidates,
                                      std::size_t wanted) {
  if (candidates.size() <= wanted) return candidates;
  std::vector<Candidate> selection(wanted);
  for (std::size_t i = 0; i < wanted; ++i) {
    selection[i] = candidates[(2 * i + 1) * candidates.size() / (2 * wanted)];
  }
  return selection;
}

/// The `count` of lowest value, in that order; equals as they stood.
template <typename SomeTrial>
void keep_best(std::vector<SomeTrial>& trials, std::size_t count) {
  std::stable_sort(trials.begin(), trials.end(),
                   [](const SomeTrial& a, const SomeTrial& b) { return a.value < b.value; });
  if (trials.size() > count) trials.resize(count);
}

}  // namespace gonio::design
