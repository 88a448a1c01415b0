#include "dark_frames.h"

#include <algorithm>

#include "saturation.h"

namespace gonio::acquisition {
namespace {

// DeviceSet::begin_subject
constexpr std::uint64_t kDarkSubject = 0;

/// At the shortest exposure nothing but an open shutter fills half the pixels by half.
void require_dark(const CaptureContext& context, const devices::Frame& frame) {
  // A camera that does not say where it is full is believed to be as its calibration.
  const double full_dn = saturation_level_dn(context.instrument.sensor, frame.saturation_level_dn);
  const double bright_dn = 0.5 * (frame.black_level_dn + full_dn);
  const auto bright = std::count_if(frame.pixels_dn.begin(), frame.pixels_dn.end(),
                                    [&](std::uint16_t dn) { return dn > bright_dn; });
  if (2 * static_cast<std::size_t>(bright) < frame.pixels_dn.size()) return;
  throw devices::DeviceError(devices::DeviceErrc::Fault, context.devices.devices().light->name(),
                             "a dark frame is bright: is the shutter closed?");
}

/// A frame behind the closed shutter: an axis that creeps does no harm to it.
devices::Frame take(const CaptureContext& context, FrameRecord& record,
                    std::chrono::nanoseconds exposure) {
  record.joints = context.devices.last_reading();
  record.joints_spread.assign(record.joints.size(), Angle());
  return context.devices.capture(exposure);
}

}  // namespace

void take_darks(const CaptureContext& context) {
  begin_subject(context, kDarkSubject);
  context.devices.close_shutter();
  context.ambient.begin_darks();
  const auto shortest = context.devices.devices().camera->info().min_exposure;
  for (int i = 0; i < context.options.dark_frames; ++i) {
    FrameRecord record;
    record.kind = FrameKind::dark;
    const devices::Frame frame = take(context, record, shortest);
    require_dark(context, frame);
    context.ambient.add_dark(frame);
    context.archive.append(std::move(record), frame);
  }
}

std::string take_lamp_off(const CaptureContext& context, int point,
                          std::chrono::nanoseconds exposure, const Regions& regions,
                          double dimmest_dn_per_s) {
  FrameRecord record;
  record.kind = FrameKind::lamp_off;
  record.point = point;
  const devices::Frame frame = take(context, record, exposure);
  const bool white = point < 0;
  std::string changed = context.ambient.changed(
      frame, white ? devices::Target::white : devices::Target::sample, regions, dimmest_dn_per_s);
  // With its lamp-off frame a white counts as whole: not before it is known whether it is one.
  context.archive.together([&] {
    context.archive.append(std::move(record), frame);
    if (white && !changed.empty()) {
      context.archive.note(context.devices.now(), kWhiteAgainNote, changed);
    }
  });
  return changed;
}

}  // namespace gonio::acquisition
