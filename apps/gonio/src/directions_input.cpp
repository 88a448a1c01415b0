#include "directions_input.h"

#include <fmt/format.h>

#include <filesystem>

#include "gonio/console/failures.h"
#include "gonio/design/published_sets.h"
#include "planning.h"

namespace gonio::cli {

std::vector<samples::Direction> directions_input(const std::string& word,
                                                 samples::BelowHorizon below_horizon) {
  if (!std::filesystem::exists(word)) {
    for (const design::PublishedSet& set : design::published_sets()) {
      if (set.name != word) continue;
      std::vector<samples::Direction> directions;
      for (const brdf::HalfDiff& angles : set.directions) directions.push_back({angles, 0});
      return directions;
    }
  }
  return samples::read_directions(word, below_horizon);
}

void refuse_unreachable(const Console& console, const std::string& list,
                        const acquisition::MeasurementPlan& plan, bool skip) {
  for (const acquisition::RefusedDirection& refused : plan.refused) {
    const std::string place =
        list.empty()
            ? ""
            : list + ": " +
                  (refused.direction.line > 0 ? fmt::format("line {}: ", refused.direction.line)
                                              : std::string());
    const std::string what = fmt::format(
        "{}direction {} cannot be measured: {}: {}", place, to_text(refused.direction.angles),
        rig::to_string(refused.refusal.reason), refused.refusal.detail);
    if (!skip) {
      throw UsageError(what, plan.refused.size() > 1
                                 ? fmt::format("{} directions in all; --skip-unreachable leaves "
                                               "them out",
                                               plan.refused.size())
                                 : "--skip-unreachable leaves it out");
    }
    console.warn(what);
  }
  if (plan.points.empty()) throw UsageError("found no direction that can be measured");
}

}  // namespace gonio::cli
