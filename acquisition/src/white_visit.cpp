#include "white_visit.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "bracket.h"
#include "dark_frames.h"
#include "light_watch.h"
#include "standing_capture.h"
#include "white_pose.h"

namespace gonio::acquisition {
namespace {

// DeviceSet::begin_subject
constexpr std::uint64_t kWhiteSubject = 1;

/// What a bracket must have found for the white to be a reference.
void require_reference(const CaptureContext& context, const std::string& channel,
                       const BracketResult& found, WhiteVisit visit) {
  const auto refuse = [&](const std::string& text) {
    throw devices::DeviceError(devices::DeviceErrc::Fault, context.devices.devices().light->name(),
                               text);
  };
  if (found.dark_regions == found.regions) {
    const std::string text =
        fmt::format("the white is dark in channel {} even after {:g} s: is the lamp on?", channel,
                    devices::to_seconds(found.longest));
    // Without a white nothing that follows would be worth anything.
    if (visit != WhiteVisit::closing) refuse(text);
    context.warn(text);
  }
  if (found.saturated_regions == found.regions && visit != WhiteVisit::closing) {
    refuse(fmt::format("the white saturates in channel {} even at the shortest exposure", channel));
  }
  if (found.saturated_regions > 0) {
    context.warn(fmt::format("white saturates in channel {} at the shortest exposure", channel));
  }
}

/// One channel's bracket and its repetitions. Returns the lamp's flicker, as visit_white().
std::string take_channel(const CaptureContext& context, const std::string& channel,
                         const Regions& regions, WhiteVisit visit,
                         std::chrono::nanoseconds& longest, double& dimmest) {
  GuardedDevices& devices = context.devices;
  TrustChecks& checks = context.checks;
  devices.light(channel);
  FrameRecord record;
  record.kind = FrameKind::white;
  record.channel = channel;
  const BracketResult found = take_bracket(devices, context.instrument, context.options, regions,
                                           context.options.first_exposure, record, context.archive);
  if (visit != WhiteVisit::opening) checks.require_lit(channel, found.highest_monitor);
  checks.set_lit_monitor(channel, found.highest_monitor);
  if (context.exposures) {
    context.exposures->see_white(channel, devices.joints(), found.brightest_dn_per_s);
  }
  longest = std::max(longest, found.longest);
  dimmest = std::min(dimmest, found.dimmest_dn_per_s);
  require_reference(context, channel, found, visit);
  LightWatch light(devices);
  for (int i = 1; i < context.options.white_frames; ++i) {
    FrameRecord repeat = record;
    repeat.monitor = light.read();
    const devices::Frame frame =
        capture_standing(devices, found.start, repeat, [&] { light.during(found.start); });
    context.archive.append(std::move(repeat), frame);
  }
  light.read();
  return checks.flicker(channel, std::min(found.lowest_monitor, light.lowest()),
                        std::max(found.highest_monitor, light.highest()));
}

}  // namespace

std::string visit_white(const CaptureContext& context, const rig::Joints& joints,
                        WhiteVisit visit) {
  begin_subject(context, kWhiteSubject);
  GuardedDevices& devices = context.devices;
  const bool in_frame = context.options.white == WhitePlacement::in_frame;
  if (!in_frame) devices.mount(devices::Target::white);
  devices.move_to(joints);
  const Regions regions = white_regions(context.instrument, context.options, devices.joints());
  auto longest = std::chrono::nanoseconds(0);
  double dimmest = std::numeric_limits<double>::infinity();
  for (const devices::LightChannel& channel : context.channels) {
    std::string flicker = take_channel(context, channel.name, regions, visit, longest, dimmest);
    if (!flicker.empty()) {
      context.archive.note(devices.now(), kWhiteAgainNote, flicker);
      return flicker;
    }
  }
  devices.close_shutter();
  std::string room = take_lamp_off(context, -1, longest, regions, dimmest);
  if (!room.empty()) return room;
  if (!in_frame) devices.mount(devices::Target::sample);
  return {};
}

}  // namespace gonio::acquisition
