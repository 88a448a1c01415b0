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
      // The lamp-off frame comes last.
      if (open && !visits.back().lamp_off) visits.pop_back();
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
  return visits;
}

/// From the last white of each part to the first of the next that has one. A monitor's reading is
/// in both, and is known to `u_monitor`.
std::vector<WhiteBridge> bridges_between(const std::vector<WhiteLevel::Visit>& visits,
                                         double u_monitor) {
  std::vector<WhiteBridge> bridges;
  for (std::size_t i = 1; i < visits.size(); ++i) {
    const WhiteLevel::Visit& before = visits[i - 1];
    const WhiteLevel::Visit& after = visits[i];
    if (before.part == after.part) continue;
    const brdf::Rgb change = after.constant / before.constant - 1.0;
    const brdf::Rgb u = (before.relative_sigma.square() + after.relative_sigma.square() +
                         2.0 * u_monitor * u_monitor)
                            .sqrt();
    int worst = 0;
    (change.abs() / u).maxCoeff(&worst);
    bridges.push_back({after.part, after.time_s, change[worst], u[worst]});
  }
  return bridges;
}

/// Of the parts in which the sentinel changed by more than twice what it is uncertain by.
std::vector<WhiteLevel::Sentinel> telling_sentinels(const SessionReader& archive,
                                                    const ColourLayout& colours,
                                                    const SessionParts& parts, double u_monitor) {
  const std::vector<SentinelVisit> visits = sentinel_visits(archive);
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
    const auto bridge = std::find_if(bridges.begin(), bridges.end(), [&](const WhiteBridge& each) {
      return each.part == after.part && before.part != after.part;
    });
    if (bridge != bridges.end() && bridge->is_applied()) {
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

double WhiteLevel::largest_change() const {
  double largest = std::abs(drift());
  for (const WhiteBridge& bridge : bridges) {
    if (bridge.is_applied()) largest = std::max(largest, std::abs(bridge.change_relative));
  }
  return largest;
}

WhiteLevel white_level(const SessionReader& archive, const instrument::Instrument& instrument,
                       const ReductionOptions& options, const ColourLayout& colours,
                       const SessionParts& parts, const std::vector<MeanDark>& darks,
                       const std::set<std::string>& monitored, const std::filesystem::path& place) {
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
    throw DataFormatError(place, "white frames",
                          "found none that can be used, expected at least one visit to the white");
  }
  level.bridges = bridges_between(level.visits, instrument.u_lamp_relative);
  level.sentinels = telling_sentinels(archive, colours, parts, instrument.u_lamp_relative);
  return level;
}

}  // namespace gonio::acquisition
