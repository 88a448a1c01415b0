#include "white_level.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "gonio/acquisition/trust_notes.h"
#include "gonio/devices/clock.h"
#include "gonio/errors/errors.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::acquisition {
namespace {

/// Frames of one visit to the white, which ends with its lamp-off frame.
struct Visit {
  std::size_t part = 0;
  std::map<std::string, std::vector<const FrameRecord*>> frames;  ///< by channel
  const FrameRecord* lamp_off = nullptr;
};

std::vector<Visit> visits_of(const SessionReader& archive, const SessionParts& parts) {
  std::vector<std::chrono::nanoseconds> again;  // from when on a visit was taken again
  for (const SessionNote& note : archive.notes()) {
    if (note.kind == kWhiteAgainNote) again.push_back(note.at);
  }
  auto next_again = again.begin();
  std::vector<Visit> visits;
  bool open = false;
  std::size_t part = 0;
  for (const FrameRecord& record : archive.frames()) {
    const bool began_again = next_again != again.end() && record.exposure_start >= *next_again;
    while (next_again != again.end() && record.exposure_start >= *next_again) ++next_again;
    if (parts.of(record) != part || began_again) {
      // The lamp-off frame comes last; it may be what the visit is taken again for.
      if (open && (began_again || !visits.back().lamp_off)) visits.pop_back();
      open = false;
      part = parts.of(record);
    }
    if (record.kind == FrameKind::white) {
      // Nor need a frame of the sample lie between two visits: all points may be done.
      if (!open || visits.back().lamp_off) visits.push_back({part, {}, nullptr});
      open = true;
      visits.back().frames[record.channel].push_back(&record);
    } else if (record.kind == FrameKind::lamp_off && record.point < 0 && open) {
      visits.back().lamp_off = &record;
    } else if (record.kind == FrameKind::sample || record.kind == FrameKind::sentinel) {
      open = false;
    }
  }
  // A session that ended within a visit, or had just found that it was none.
  if (open && (next_again != again.end() || !visits.back().lamp_off)) visits.pop_back();
  return visits;
}

/// Colours of a reading; none: a channel is missing.
std::optional<LevelChange> change_between(const SentinelReading& before,
                                          const SentinelReading& after,
                                          const ColourLayout& colours) {
  LevelChange change;
  for (int colour = 0; colour < 3; ++colour) {
    const std::string& channel = colours.channels().at(colours.channel_of(colour));
    const auto from = before.find(channel);
    const auto to = after.find(channel);
    if (from == before.end() || to == after.end()) return std::nullopt;
    const SentinelChange own = sentinel_change(from->second, to->second, 0.0);
    change.relative[colour] = own.relative;
    change.variance[colour] = own.u * own.u;
  }
  return change;
}

/// The sentinel next to a white in its part: both then say how bright the light was at one time.
const SentinelVisit* sentinel_beside(const std::vector<SentinelVisit>& sentinels,
                                     const SessionParts& parts, const WhiteLevel::Visit& white) {
  const SentinelVisit* nearest = nullptr;
  const auto apart_s = [&](const SentinelVisit& visit) {
    return std::abs(devices::to_seconds(visit.at) - white.time_s);
  };
  for (const SentinelVisit& visit : sentinels) {
    if (parts.at(visit.at) != white.part) continue;
    if (nearest == nullptr || apart_s(visit) < apart_s(*nearest)) nearest = &visit;
  }
  return nearest;
}

/// Sets two whites the bridge's factor apart: each gives way as far as its noise lets it.
void put_apart(const PartBridge& bridge, WhiteLevel::Visit& before, WhiteLevel::Visit& after) {
  for (int colour = 0; colour < 3; ++colour) {
    const double own = before.relative_sigma[colour] * before.relative_sigma[colour];
    const double other = after.relative_sigma[colour] * after.relative_sigma[colour];
    if (!(own + other > 0.0)) continue;
    const double wanted = 1.0 + bridge.relative[colour];
    const double too_far =
        std::log(after.constant[colour] / before.constant[colour] / wanted) / (own + other);
    before.constant[colour] *= std::exp(too_far * own);
    after.constant[colour] *= std::exp(-too_far * other);
  }
}

/// From the last white of each part to the first of the next that has one. Whites are left as they
/// are unless a bridge is applied: a session that was interrupted and nothing else is the
/// uninterrupted one.
std::vector<PartBridge> bridge_whites(const std::vector<SentinelVisit>& sentinels,
                                      const ColourLayout& colours, const SessionParts& parts,
                                      double u_monitor, std::vector<WhiteLevel::Visit>& visits) {
  std::vector<PartBridge> bridges;
  for (std::size_t i = 1; i < visits.size(); ++i) {
    WhiteLevel::Visit& before = visits[i - 1];
    WhiteLevel::Visit& after = visits[i];
    if (before.part == after.part) continue;
    const LevelChange white{after.constant / before.constant - 1.0,
                            before.relative_sigma.square() + after.relative_sigma.square()};
    const SentinelVisit* from = sentinel_beside(sentinels, parts, before);
    const SentinelVisit* to = sentinel_beside(sentinels, parts, after);
    std::optional<LevelChange> sentinel;
    if (from != nullptr && to != nullptr) {
      sentinel = change_between(from->reading, to->reading, colours);
    }
    PartBridge bridge = bridge_parts(white, sentinel, u_monitor);
    bridge.part = after.part;
    bridge.at_s = after.time_s;
    if (bridge.is_applied()) put_apart(bridge, before, after);
    bridges.push_back(bridge);
  }
  return bridges;
}

/// Of the parts in which the sentinel changed by more than twice what it is uncertain by.
std::vector<WhiteLevel::Sentinel> telling_sentinels(const std::vector<SentinelVisit>& visits,
                                                    const ColourLayout& colours,
                                                    const SessionParts& parts, double u_monitor) {
  std::map<std::size_t, const SentinelVisit*> firsts;
  std::set<std::size_t> telling;
  std::vector<WhiteLevel::Sentinel> sentinels;
  for (const SentinelVisit& visit : visits) {
    const std::size_t part = parts.at(visit.at);
    const SentinelVisit& first = *firsts.try_emplace(part, &visit).first->second;
    WhiteLevel::Sentinel found{part, devices::to_seconds(visit.at), brdf::Rgb::Ones()};
    bool whole = true;
    for (int colour = 0; colour < 3; ++colour) {
      const std::string& channel = colours.channels().at(colours.channel_of(colour));
      const auto before = first.reading.find(channel);
      const auto now = visit.reading.find(channel);
      if (before == first.reading.end() || now == visit.reading.end()) {
        whole = false;
        continue;
      }
      const SentinelChange change = sentinel_change(before->second, now->second, u_monitor);
      found.relative[colour] = 1.0 + change.relative;
      if (std::abs(change.relative) > 2.0 * change.u) telling.insert(part);
    }
    const bool later = sentinels.empty() || sentinels.back().time_s < found.time_s;
    if (whole && later) sentinels.push_back(found);
  }
  std::erase_if(sentinels, [&](const auto& each) { return !telling.contains(each.part); });
  return sentinels;
}

/// Of its own noise that a white must have at least; a usual one has thousands.
constexpr double kWhiteSigmas = 20.0;

struct Sums {
  double signal = 0.0;
  double expected = 0.0;
  double variance = 0.0;
  double used = 0.0;  ///< pixels
  double bad = 0.0;   ///< saturated or clipped pixels
};

}  // namespace

brdf::Rgb WhiteLevel::at(double time_s, std::size_t part) const {
  if (time_s <= visits.front().time_s) return visits.front().constant;
  for (std::size_t i = 1; i < visits.size(); ++i) {
    const Visit& before = visits[i - 1];
    const Visit& after = visits[i];
    if (time_s > after.time_s) continue;
    const auto bridge = std::find_if(bridges.begin(), bridges.end(), [&](const PartBridge& each) {
      return each.part == after.part && before.part != after.part;
    });
    if (bridge != bridges.end() && (bridge->is_applied() || bridge->is_refused())) {
      return carried(part < after.part ? before : after, time_s, part);
    }
    const double t = (time_s - before.time_s) / (after.time_s - before.time_s);
    if (before.part != after.part) {
      return before.constant + t * (after.constant - before.constant);
    }
    const brdf::Rgb from = before.constant / shape(before.time_s, part);
    const brdf::Rgb to = after.constant / shape(after.time_s, part);
    return (from + t * (to - from)) * shape(time_s, part);
  }
  return carried(visits.back(), time_s, part);
}

brdf::Rgb WhiteLevel::carried(const Visit& visit, double time_s, std::size_t part) const {
  if (visit.part != part) return visit.constant;
  return visit.constant * shape(time_s, part) / shape(visit.time_s, part);
}

brdf::Rgb WhiteLevel::shape(double time_s, std::size_t part) const {
  std::vector<const Sentinel*> own;
  for (const Sentinel& each : sentinels) {
    if (each.part == part) own.push_back(&each);
  }
  if (own.size() < 2) return brdf::Rgb::Ones();         // one has nothing to be compared with
  const auto slope = [&](std::size_t i) -> brdf::Rgb {  // from i to i + 1
    return (own[i + 1]->relative - own[i]->relative) / (own[i + 1]->time_s - own[i]->time_s);
  };
  if (time_s >= own.front()->time_s && time_s <= own.back()->time_s) {
    std::size_t i = 0;
    while (i + 2 < own.size() && own[i + 1]->time_s < time_s) ++i;
    return own[i]->relative + (time_s - own[i]->time_s) * slope(i);
  }
  // Beyond them as it went most of the time: a step was once, a drift goes on.
  brdf::Rgb usual;
  for (int colour = 0; colour < 3; ++colour) {
    std::vector<double> slopes;
    for (std::size_t i = 0; i + 1 < own.size(); ++i) slopes.push_back(slope(i)[colour]);
    const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
    std::nth_element(slopes.begin(), middle, slopes.end());
    usual[colour] = *middle;
  }
  const Sentinel& end = time_s < own.front()->time_s ? *own.front() : *own.back();
  // What comes of an archive that somebody made up is still a number.
  constexpr double kLeast = 0.1;
  return (end.relative + (time_s - end.time_s) * usual).max(kLeast * end.relative);
}

double WhiteLevel::drift() const {
  const brdf::Rgb change = visits.back().constant / visits.front().constant - 1.0;
  int largest = 0;
  change.abs().maxCoeff(&largest);
  return change[largest];
}

double WhiteLevel::u_unseen() const {
  double change = std::abs(drift());
  double disagreement = 0.0;
  for (const PartBridge& bridge : bridges) {
    if (bridge.is_applied()) change = std::max(change, std::abs(bridge.change_relative));
    if (bridge.is_refused()) {
      disagreement = std::max(disagreement, std::abs(bridge.disagreement_relative));
    }
  }
  return std::hypot(change / std::sqrt(12.0), disagreement / std::sqrt(3.0));
}

bool WhiteLevel::is_unbridged(std::size_t part) const {
  return std::any_of(bridges.begin(), bridges.end(), [part](const PartBridge& bridge) {
    return bridge.is_refused() && bridge.part <= part;
  });
}

WhiteLevel white_level(const SessionReader& archive, const instrument::Instrument& instrument,
                       const ReductionOptions& options, const ColourLayout& colours,
                       const SessionParts& parts, const std::vector<MeanDark>& darks,
                       const std::set<std::string>& monitored) {
  WhiteLevel level;
  for (const Visit& visit : visits_of(archive, parts)) {
    if (visit.frames.size() != colours.channels().size()) continue;  // a visit cut short
    const BackgroundMaps background =
        background_maps(archive, instrument.sensor, darks[visit.part], visit.lamp_off);
    std::vector<ChannelSignal> signals;
    for (const std::string& channel : colours.channels()) {
      signals.push_back(
          merge_frames(archive, instrument, visit.frames.at(channel), background, monitored));
    }
    if (std::any_of(signals.begin(), signals.end(),
                    [](const ChannelSignal& signal) { return signal.monitor_failed; })) {
      level.warnings.push_back(fmt::format(
          "white at {:.0f} s: the lamp monitor read nothing, left out", signals.front().time_s));
      continue;
    }
    const rig::Joints& joints = visit.frames.begin()->second.front()->joints;
    const rig::RigPose pose = rig::forward(instrument.rig, joints);
    const Eigen::Vector2d centre =
        options.white_in_frame ? options.white_patch_mm : Eigen::Vector2d::Zero();
    const double whole_mm = options.white_half_width_mm.value_or(options.sample_half_width_mm);
    const double half_width = options.white_in_frame ? options.white_patch_half_width_mm
                                                     : whole_mm - options.edge_margin_mm;
    std::array<Sums, 3> sums;
    const int width = instrument.camera.width_px;
    for (int row = 0; row < instrument.camera.height_px; ++row) {
      for (int column = 0; column < width; ++column) {
        const auto geometry = instrument::pixel_geometry(instrument, pose, column, row);
        if (!geometry) continue;
        if ((geometry->point_in_sample_mm.head<2>() - centre).cwiseAbs().maxCoeff() > half_width) {
          continue;
        }
        const brdf::Rgb white = instrument::white_brdf(instrument.white, geometry->directions);
        const auto pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(column);
        for (int colour = 0; colour < 3; ++colour) {
          const ChannelSignal& signal = signals[colours.channel_of(colour)];
          if (!ColourLayout::carries(signal.pixel_format, column, row, colour)) continue;
          Sums& sum = sums[static_cast<std::size_t>(colour)];
          if (signal.merged.state[pixel] == instrument::PixelState::defective) continue;
          if (signal.merged.state[pixel] != instrument::PixelState::measured) {
            sum.bad += 1.0;
            continue;
          }
          sum.used += 1.0;
          sum.signal += signal.merged.dn_per_s[pixel];
          sum.variance += signal.merged.variance[pixel];
          sum.expected += instrument::signal_over_constant(instrument, *geometry, white[colour]);
        }
      }
    }
    WhiteLevel::Visit found;
    found.part = visit.part;
    bool usable = true;
    for (int colour = 0; colour < 3; ++colour) {
      const Sums& sum = sums[static_cast<std::size_t>(colour)];
      const ChannelSignal& signal = signals[colours.channel_of(colour)];
      // A level that is not told from noise is none.
      usable = usable && sum.expected > 0.0 &&
               sum.signal > kWhiteSigmas * std::sqrt(sum.variance) &&
               sum.bad <= kMaxBadFraction * (sum.used + sum.bad);
      found.constant[colour] = sum.signal / (sum.expected * signal.monitor);
      found.relative_sigma[colour] = std::sqrt(sum.variance) / sum.signal;
      found.time_s += signal.time_s / 3.0;
    }
    if (usable) {
      level.visits.push_back(found);
    } else {
      level.warnings.push_back(
          fmt::format("white at {:.0f} s: dark or saturated, left out", signals.front().time_s));
    }
  }
  if (level.visits.empty()) {
    throw DataFormatError(archive.folder(), "white frames",
                          "found none that can be used, expected at least one visit to the white");
  }
  const std::vector<SentinelVisit> sentinels = sentinel_visits(archive);
  const double u_monitor = instrument.u_lamp_relative;
  level.bridges = bridge_whites(sentinels, colours, parts, u_monitor, level.visits);
  level.sentinels = telling_sentinels(sentinels, colours, parts, u_monitor);
  return level;
}

std::vector<PartBridge> bridges(const SessionReader& archive,
                                const instrument::Instrument& instrument,
                                const ReductionOptions& options) {
  const SessionParts parts(archive);
  if (parts.count() < 2) return {};
  check_sizes(archive, instrument);
  return white_level(archive, instrument, options, ColourLayout(archive, archive.folder()), parts,
                     mean_darks(archive, parts, instrument), monitored_channels(archive))
      .bridges;
}

}  // namespace gonio::acquisition
