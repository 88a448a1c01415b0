#include "point_visit.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "bracket.h"
#include "dark_frames.h"

namespace gonio::acquisition {

PointFrames take_point_frames(const CaptureContext& context, int point,
                              const std::optional<ExpectedSample>& expected) {
  GuardedDevices& devices = context.devices;
  const instrument::Instrument& instrument = context.instrument;
  const SessionOptions& options = context.options;
  const Regions regions = regions_of(instrument, rig::forward(instrument.rig, devices.joints()),
                                     Eigen::Vector2d::Zero(), options.sample_half_width_mm);
  if (regions.empty()) {
    context.warn(fmt::format("point {}: the sample is not in the camera's view", point));
    return {};
  }
  auto longest = std::chrono::nanoseconds(0);
  auto start = options.first_exposure;
  std::map<std::string, std::chrono::nanoseconds> predicted;
  if (context.exposures) {
    predicted = context.exposures->at(static_cast<std::size_t>(point), devices.joints(), expected);
  }
  PointFrames result;
  double dimmest = std::numeric_limits<double>::infinity();
  bool all_saturated = false;
  bool all_dark = false;
  for (const devices::LightChannel& channel : context.channels) {
    devices.light(channel.name);
    FrameRecord record;
    record.kind = FrameKind::sample;
    record.point = point;
    record.channel = channel.name;
    if (predicted.contains(channel.name)) start = predicted.at(channel.name);
    const BracketResult found =
        take_bracket(devices, instrument, options, regions, start, record, context.archive);
    context.checks.require_lit(channel.name, found.highest_monitor);
    dimmest = std::min(dimmest, found.dimmest_dn_per_s);
    if (result.unsteady.empty()) {
      result.unsteady =
          context.checks.flicker(channel.name, found.lowest_monitor, found.highest_monitor);
    }
    start = found.start;
    longest = std::max(longest, found.longest);
    all_saturated = all_saturated || found.saturated_regions == found.regions;
    all_dark = all_dark || found.dark_regions == found.regions;
  }
  devices.close_shutter();
  std::string room = take_lamp_off(context, point, longest, regions, dimmest);
  if (result.unsteady.empty()) result.unsteady = std::move(room);
  result.outcome = all_saturated ? PointOutcome::Saturated
                   : all_dark    ? PointOutcome::TooDark
                                 : PointOutcome::Measured;
  return result;
}

}  // namespace gonio::acquisition
