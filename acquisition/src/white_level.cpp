#include "white_level.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "gonio/errors/errors.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::acquisition {
namespace {

/// Frames of one visit to the white: no frame of the sample lies between them.
struct Visit {
  std::size_t part = 0;
  std::map<std::string, std::vector<const FrameRecord*>> frames;  ///< by channel
  const FrameRecord* lamp_off = nullptr;
};

std::vector<Visit> visits_of(const SessionReader& archive, const SessionParts& parts) {
  std::vector<Visit> visits;
  bool open = false;
  std::size_t part = 0;
  for (const FrameRecord& record : archive.frames()) {
    if (parts.of(record) != part) {
      // The lamp-off frame comes last.
      if (open && !visits.back().lamp_off) visits.pop_back();
      open = false;
      part = parts.of(record);
    }
    if (record.kind == FrameKind::white) {
      if (!open) visits.push_back({part, {}, nullptr});
      open = true;
      visits.back().frames[record.channel].push_back(&record);
    } else if (record.kind == FrameKind::lamp_off && record.point < 0 && open) {
      visits.back().lamp_off = &record;
    } else if (record.kind == FrameKind::sample) {
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
      return part < after.part ? before.constant : after.constant;
    }
    const double t = (time_s - before.time_s) / (after.time_s - before.time_s);
    return before.constant + t * (after.constant - before.constant);
  }
  return visits.back().constant;
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
      usable = usable && sum.expected > 0.0 && sum.signal > 0.0 &&
               sum.bad <= kMaxBadFraction * (sum.used + sum.bad);
      found.constant[colour] = sum.signal / (sum.expected * signal.monitor);
      found.relative_sigma[colour] = std::sqrt(sum.variance) / sum.signal;
      found.time_s += signal.time_s / 3.0;
    }
    if (usable) level.visits.push_back(found);
  }
  if (level.visits.empty()) {
    throw DataFormatError(place, "white frames",
                          "found none that can be used, expected at least one visit to the white");
  }
  level.bridges = bridges_between(level.visits, instrument.u_lamp_relative);
  return level;
}

}  // namespace gonio::acquisition
