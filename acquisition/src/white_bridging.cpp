#include "white_bridging.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "gonio/devices/clock.h"

namespace gonio::acquisition {
namespace {

/// A change by more than so many of its uncertainties is told from noise.
constexpr double kTellingSigmas = 2.0;

bool is_told(const LightCurve::Reading& before, const LightCurve::Reading& after,
             double u_monitor) {
  const brdf::Rgb u = (before.variance + after.variance + 2.0 * u_monitor * u_monitor).sqrt();
  return ((after.level / before.level - 1.0).abs() > kTellingSigmas * u).any();
}

std::vector<LightCurve::Reading> of_part(const std::vector<PartSentinel>& sentinels,
                                         std::size_t part) {
  std::vector<LightCurve::Reading> readings;
  for (const PartSentinel& each : sentinels) {
    if (each.part == part) readings.push_back(each.reading);
  }
  return readings;
}

/// The sentinel as it would have been measured at the time of a white.
struct BesideWhite {
  LightCurve::Reading sentinel;
  double unseen_s = 0.0;  ///< between both, where nothing in the part shows how the light drifts
};

/// By the drift that the sentinels of its part show, or else its whites. None: no sentinel.
std::optional<BesideWhite> beside_white(const std::vector<PartSentinel>& sentinels,
                                        const std::vector<WhiteLevel::Visit>& visits,
                                        const WhiteLevel::Visit& white) {
  const std::vector<LightCurve::Reading> own = of_part(sentinels, white.part);
  if (own.empty()) return std::nullopt;
  const LightCurve by_sentinels(own);
  if (by_sentinels.shows_drift()) return BesideWhite{by_sentinels.at(white.time_s), 0.0};
  std::vector<LightCurve::Reading> whites;
  for (const WhiteLevel::Visit& visit : visits) {
    if (visit.part != white.part) continue;
    whites.push_back({visit.time_s, visit.constant, visit.relative_sigma.square()});
  }
  const LightCurve by_whites(whites);
  LightCurve::Reading carried = own.front();
  const double unseen_s = std::abs(carried.time_s - white.time_s);
  if (!by_whites.shows_drift()) return BesideWhite{carried, unseen_s};
  const LevelChange change = by_whites.change(carried.time_s, white.time_s);
  carried.level *= 1.0 + change.relative;
  carried.variance += change.variance;
  return BesideWhite{carried, 0.0};
}

/// Of every white. Where no drift is seen the light may have drifted as fast as it changed from or
/// to the next white, either way.
std::vector<std::optional<LightCurve::Reading>> beside_whites(
    const std::vector<PartSentinel>& sentinels, const std::vector<WhiteLevel::Visit>& visits) {
  std::vector<std::optional<BesideWhite>> beside;
  for (const WhiteLevel::Visit& visit : visits) {
    beside.push_back(beside_white(sentinels, visits, visit));
  }
  std::vector<brdf::Rgb> rates(visits.size(), brdf::Rgb::Zero());  // 1/s
  for (std::size_t i = 1; i < visits.size(); ++i) {
    const double elapsed_s = visits[i].time_s - visits[i - 1].time_s;
    if (!(elapsed_s > 0.0)) continue;
    brdf::Rgb change = (visits[i].constant / visits[i - 1].constant).log().abs();
    if (beside[i - 1] && beside[i]) {
      change = change.max((beside[i]->sentinel.level / beside[i - 1]->sentinel.level).log().abs());
    }
    rates[i - 1] = rates[i - 1].max(change / elapsed_s);
    rates[i] = rates[i].max(change / elapsed_s);
  }
  std::vector<std::optional<LightCurve::Reading>> found(visits.size());
  for (std::size_t i = 0; i < visits.size(); ++i) {
    if (!beside[i]) continue;
    found[i] = beside[i]->sentinel;
    found[i]->variance += (beside[i]->unseen_s * rates[i]).square() / 3.0;
  }
  return found;
}

/// Of whites that bridges tie together: while only the light changes, sentinel over white is one
/// number. It is their weighted mean; then each white gives way by its noise, which is the least
/// squares solution of all of them at once.
void put_apart(const std::vector<std::size_t>& chain,
               const std::vector<std::optional<LightCurve::Reading>>& beside,
               std::vector<WhiteLevel::Visit>& visits) {
  brdf::Rgb sum = brdf::Rgb::Zero();
  brdf::Rgb weights = brdf::Rgb::Zero();
  const auto log_ratio = [&](std::size_t i) -> brdf::Rgb {
    return (beside[i]->level / visits[i].constant).log();
  };
  const auto variance = [&](std::size_t i) -> brdf::Rgb {
    return visits[i].relative_sigma.square() + beside[i]->variance;
  };
  for (const std::size_t i : chain) {
    sum += log_ratio(i) / variance(i);
    weights += 1.0 / variance(i);
  }
  const brdf::Rgb ratio = sum / weights;
  for (const std::size_t i : chain) {
    const brdf::Rgb own = visits[i].relative_sigma.square() / variance(i);
    visits[i].constant *= (own * (log_ratio(i) - ratio)).exp();
  }
}

bool is_one_light(const PartBridge& bridge) { return !bridge.is_applied() && !bridge.is_refused(); }

/// Joins a part without a white to one that has some and a sentinel, where it has sentinels itself.
/// Where no bridge leads over it, or whites and sentinels contradict each other, the sample may
/// have changed: then only a sentinel that reads as before attaches it.
void join_without_white(const std::vector<PartSentinel>& sentinels, std::size_t part,
                        double u_monitor, WhiteLevel& level) {
  const std::vector<LightCurve::Reading> own = of_part(sentinels, part);
  if (own.empty()) return;
  std::optional<std::size_t> before;
  std::optional<std::size_t> after;
  for (const WhiteLevel::Visit& visit : level.visits) {
    if (visit.part < part) before = visit.part;
    if (visit.part > part && !after) after = visit.part;
  }
  const bool bridged = std::any_of(
      level.bridges.begin(), level.bridges.end(),
      [part](const PartBridge& each) { return !each.is_refused() && each.spans(part); });
  if (before) {
    const std::vector<LightCurve::Reading> others = of_part(sentinels, *before);
    if (!others.empty() && (bridged || !is_told(others.back(), own.front(), u_monitor))) {
      level.stretches[part] = level.stretches[*before];
      return;
    }
  }
  if (after && bridged && !of_part(sentinels, *after).empty()) {
    level.stretches[part] = level.stretches[*after];
  }
}

void find_stretches(const std::vector<PartSentinel>& sentinels, std::size_t parts, double u_monitor,
                    WhiteLevel& level) {
  level.stretches.resize(parts);
  std::iota(level.stretches.begin(), level.stretches.end(), std::size_t{0});
  std::vector<bool> settled(parts, false);
  for (const WhiteLevel::Visit& visit : level.visits) settled[visit.part] = true;
  for (const PartBridge& bridge : level.bridges) {
    if (!bridge.by_sentinel || !is_one_light(bridge)) continue;
    for (std::size_t part = bridge.from + 1; part <= bridge.part; ++part) {
      level.stretches[part] = level.stretches[bridge.from];
      settled[part] = true;
    }
  }
  for (std::size_t part = 0; part < parts; ++part) {
    if (!settled[part]) join_without_white(sentinels, part, u_monitor, level);
  }
}

/// Of the stretches in which a sentinel is off the first by more than noise. A part in which the
/// drift is seen keeps to that behind its last sentinel: over an interruption it may have gone
/// another way.
void find_shapes(const std::vector<PartSentinel>& sentinels, double u_monitor, WhiteLevel& level) {
  std::map<std::size_t, std::vector<LightCurve::Reading>> of_stretch;
  for (const PartSentinel& each : sentinels) {
    of_stretch[level.stretches[each.part]].push_back(each.reading);
  }
  for (std::size_t part = 0; part < level.stretches.size(); ++part) {
    const auto all = of_stretch.find(level.stretches[part]);
    if (all == of_stretch.end()) continue;
    const bool tells = std::any_of(all->second.begin(), all->second.end(), [&](const auto& each) {
      return is_told(all->second.front(), each, u_monitor);
    });
    if (!tells) continue;
    const std::vector<LightCurve::Reading> own = of_part(sentinels, part);
    // Readings that differ by noise alone have no slope to go on with.
    const bool seen = std::any_of(own.begin(), own.end(), [&](const auto& each) {
      return is_told(own.front(), each, u_monitor);
    });
    level.shapes.emplace(part, LightCurve(seen ? own : all->second));
  }
}

}  // namespace

std::vector<PartSentinel> part_sentinels(const std::vector<SentinelVisit>& visits,
                                         const ColourLayout& colours, const SessionParts& parts) {
  std::vector<PartSentinel> sentinels;
  for (const SentinelVisit& visit : visits) {
    PartSentinel found;
    found.part = parts.at(visit.at);
    found.reading.time_s = devices::to_seconds(visit.at);
    bool whole = true;
    for (int colour = 0; colour < 3 && whole; ++colour) {
      const auto level = visit.reading.find(colours.channels().at(colours.channel_of(colour)));
      whole = level != visit.reading.end();
      if (!whole) continue;
      found.reading.level[colour] = level->second.level_dn_per_s;
      const double u = std::hypot(level->second.relative_sigma, kSentinelRepeatability);
      found.reading.variance[colour] = u * u;
    }
    if (whole) sentinels.push_back(found);
  }
  return sentinels;
}

void bridge_whites(const std::vector<PartSentinel>& sentinels, std::size_t parts, double u_monitor,
                   WhiteLevel& level) {
  std::vector<WhiteLevel::Visit>& visits = level.visits;
  const auto beside = beside_whites(sentinels, visits);
  std::vector<std::vector<std::size_t>> chains;
  bool goes_on = false;
  for (std::size_t i = 1; i < visits.size(); ++i) {
    const WhiteLevel::Visit& before = visits[i - 1];
    const WhiteLevel::Visit& after = visits[i];
    if (before.part == after.part) continue;
    const LevelChange white{after.constant / before.constant - 1.0,
                            before.relative_sigma.square() + after.relative_sigma.square()};
    std::optional<LevelChange> sentinel;
    if (beside[i - 1] && beside[i]) {
      sentinel = LevelChange{beside[i]->level / beside[i - 1]->level - 1.0,
                             beside[i - 1]->variance + beside[i]->variance};
    }
    PartBridge bridge = bridge_parts(white, sentinel, u_monitor);
    bridge.from = before.part;
    bridge.part = after.part;
    bridge.at_s = after.time_s;
    level.bridges.push_back(bridge);
    const bool ties = bridge.is_applied() && bridge.by_sentinel;
    if (ties && !goes_on) chains.emplace_back();
    if (ties && (!goes_on || chains.back().back() != i - 1)) chains.back().push_back(i - 1);
    if (ties) chains.back().push_back(i);
    goes_on = ties;
  }
  for (const std::vector<std::size_t>& chain : chains) put_apart(chain, beside, visits);
  find_stretches(sentinels, parts, u_monitor, level);
  find_shapes(sentinels, u_monitor, level);
}

}  // namespace gonio::acquisition
