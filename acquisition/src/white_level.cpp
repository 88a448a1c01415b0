#include "white_level.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "gonio/acquisition/trust_notes.h"
#include "gonio/errors/errors.h"
#include "gonio/instrument/measurement_equation.h"
#include "white_bridging.h"

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
  if (time_s <= visits.front().time_s) return carried(visits.front(), time_s, part);
  for (std::size_t i = 1; i < visits.size(); ++i) {
    const Visit& before = visits[i - 1];
    const Visit& after = visits[i];
    if (time_s > after.time_s) continue;
    const double t = (time_s - before.time_s) / (after.time_s - before.time_s);
    if (share_light(before.part, after.part)) {
      const brdf::Rgb from = before.constant / shape(before.time_s, before.part);
      const brdf::Rgb to = after.constant / shape(after.time_s, after.part);
      return (from + t * (to - from)) * shape(time_s, part);
    }
    const auto bridge = std::find_if(bridges.begin(), bridges.end(), [&](const PartBridge& each) {
      return each.part == after.part;
    });
    const bool apart = bridge->is_applied() || bridge->is_refused();
    if (apart || shapes.contains(part)) {
      return carried(share_light(part, after.part) ? after : before, time_s, part);
    }
    return before.constant + t * (after.constant - before.constant);
  }
  return carried(visits.back(), time_s, part);
}

brdf::Rgb WhiteLevel::carried(const Visit& visit, double time_s, std::size_t part) const {
  if (!share_light(visit.part, part)) return visit.constant;
  return visit.constant * shape(time_s, part) / shape(visit.time_s, visit.part);
}

brdf::Rgb WhiteLevel::shape(double time_s, std::size_t part) const {
  const auto found = shapes.find(part);
  return found == shapes.end() ? brdf::Rgb::Ones() : found->second.level(time_s);
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

bool WhiteLevel::has_white(std::size_t part) const {
  return std::any_of(visits.begin(), visits.end(),
                     [part](const Visit& visit) { return visit.part == part; });
}

bool WhiteLevel::is_unbridged(std::size_t part) const {
  const bool behind = std::any_of(bridges.begin(), bridges.end(), [part](const PartBridge& bridge) {
    return bridge.is_refused() && bridge.part <= part;
  });
  if (behind) return true;
  const bool attached = std::any_of(visits.begin(), visits.end(), [&](const Visit& visit) {
    return share_light(visit.part, part);
  });
  const bool amid_one_light =
      std::any_of(bridges.begin(), bridges.end(), [part](const PartBridge& bridge) {
        return bridge.spans(part) && !bridge.is_applied() && !bridge.is_refused();
      });
  return !attached && !amid_one_light;
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
    throw NothingToReduce(archive.folder(), "white frames",
                          "found none that can be used, expected at least one visit to the white");
  }
  bridge_whites(part_sentinels(sentinel_visits(archive), colours, parts), parts.count(),
                instrument.u_lamp_relative, level);
  return level;
}

std::vector<PartBridge> bridges(const SessionReader& archive,
                                const instrument::Instrument& instrument,
                                const ReductionOptions& options) {
  const SessionParts parts(archive);
  if (parts.count() < 2) return {};
  require_of_instrument(archive, instrument);
  return white_level(archive, instrument, options, ColourLayout(archive, archive.folder()), parts,
                     mean_darks(archive, parts, instrument), monitored_channels(archive))
      .bridges;
}

}  // namespace gonio::acquisition
