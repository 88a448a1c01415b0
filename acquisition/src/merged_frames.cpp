#include "merged_frames.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "gonio/acquisition/reduction.h"
#include "gonio/devices/clock.h"
#include "gonio/errors/errors.h"
#include "saturation.h"

namespace gonio::acquisition {
namespace {

/// Of a lamp monitor, full scale 1: less is no reading, and nothing can be divided by it.
constexpr double kLeastReading = 1e-9;

double read_variance_dn2(const instrument::SensorModel& sensor) {
  const double read_dn = sensor.gain_dn_per_e * sensor.read_noise_e;
  return read_dn * read_dn + 1.0 / 12.0;
}

}  // namespace

void require_of_instrument(const SessionReader& archive, const instrument::Instrument& instrument) {
  const instrument::CameraModel& camera = instrument.camera;
  for (const FrameRecord& record : archive.frames()) {
    const auto [width, height] = archive.frame_size(record);
    if (width != camera.width_px || height != camera.height_px) {
      throw DataFormatError(archive.folder() / record.file, "frame size",
                            fmt::format("found {} x {} px, the calibration is for {} x {} px",
                                        width, height, camera.width_px, camera.height_px));
    }
    if (record.joints.size() != instrument.rig.axes.size()) {
      throw DataFormatError(archive.folder() / record.file, "joints",
                            fmt::format("found {}, the calibrated rig has {} axes",
                                        record.joints.size(), instrument.rig.axes.size()));
    }
  }
}

std::vector<MeanDark> mean_darks(const SessionReader& archive, const SessionParts& parts,
                                 const instrument::Instrument& instrument) {
  const auto pixel_count = static_cast<std::size_t>(instrument.camera.width_px) *
                           static_cast<std::size_t>(instrument.camera.height_px);
  MeanDark all{std::vector<double>(pixel_count, 0.0), 0};
  std::vector<MeanDark> darks(parts.count(), all);
  for (const FrameRecord& record : archive.frames()) {
    if (record.kind != FrameKind::dark) continue;
    const devices::Frame frame = archive.read_frame(record);
    for (MeanDark* dark : {&all, &darks[parts.of(record)]}) {
      for (std::size_t p = 0; p < pixel_count; ++p) dark->offset_dn[p] += frame.pixels_dn[p];
      ++dark->frames;
    }
  }
  for (MeanDark& dark : darks) {
    if (dark.frames == 0) dark = all;
    for (double& value : dark.offset_dn) {
      value = dark.frames > 0 ? value / dark.frames : instrument.sensor.black_level_dn;
    }
  }
  return darks;
}

BackgroundMaps background_maps(const SessionReader& archive, const instrument::SensorModel& sensor,
                               const MeanDark& dark, const FrameRecord* lamp_off) {
  const std::vector<double>& offset_dn = dark.offset_dn;
  BackgroundMaps maps;
  maps.offset_dn = offset_dn;
  maps.offset_variance_dn2 =
      dark.frames > 0 ? read_variance_dn2(sensor) / dark.frames : read_variance_dn2(sensor);
  if (lamp_off == nullptr) {
    maps.rate_dn_per_s.assign(offset_dn.size(), sensor.gain_dn_per_e * sensor.dark_current_e_per_s);
    return maps;
  }
  const devices::Frame frame = archive.read_frame(*lamp_off);
  const double exposure_s = exposed_s(archive, sensor, *lamp_off);
  maps.rate_dn_per_s.resize(offset_dn.size());
  double above_offset_dn = 0.0;
  for (std::size_t p = 0; p < offset_dn.size(); ++p) {
    const double signal_dn = sensor.response.linear_dn(frame.pixels_dn[p] - offset_dn[p]);
    maps.rate_dn_per_s[p] = signal_dn / exposure_s;
    above_offset_dn += signal_dn / static_cast<double>(offset_dn.size());
  }
  const double shot_variance_dn2 = sensor.gain_dn_per_e * std::max(0.0, above_offset_dn);
  maps.rate_variance_dn2_per_s2 =
      (read_variance_dn2(sensor) + shot_variance_dn2) / (exposure_s * exposure_s);
  return maps;
}

double exposed_s(const SessionReader& archive, const instrument::SensorModel& sensor,
                 const FrameRecord& record) {
  const double seconds = devices::to_seconds(record.exposure) + sensor.shutter_offset_s;
  if (!(seconds > 0.0)) {
    throw DataFormatError(
        archive.folder() / record.file, "exposure",
        fmt::format("found {:g} us, expected more than the {:g} us that the calibration's "
                    "shutter_offset_s takes off it",
                    1e6 * devices::to_seconds(record.exposure), -1e6 * sensor.shutter_offset_s));
  }
  return seconds;
}

std::set<std::string> monitored_channels(const SessionReader& archive) {
  std::set<std::string> channels;
  for (const FrameRecord& record : archive.frames()) {
    if (!record.channel.empty() && record.monitor > 0.0) channels.insert(record.channel);
  }
  return channels;
}

ChannelSignal merge_frames(const SessionReader& archive, const instrument::Instrument& instrument,
                           const std::vector<const FrameRecord*>& frames,
                           const BackgroundMaps& background,
                           const std::set<std::string>& monitored) {
  ChannelSignal signal;
  const bool has_monitor = !frames.empty() && monitored.count(frames[0]->channel) != 0;
  std::vector<devices::Frame> images;
  for (const FrameRecord* record : frames) {
    images.push_back(archive.read_frame(*record));
    signal.monitor += record->monitor / static_cast<double>(frames.size());
    signal.monitor_failed =
        signal.monitor_failed || (has_monitor && !(record->monitor > kLeastReading));
    signal.time_s +=
        devices::to_seconds(record->exposure_start) / static_cast<double>(frames.size());
    signal.longest_exposure_s =
        std::max(signal.longest_exposure_s, exposed_s(archive, instrument.sensor, *record));
    signal.pixel_format = images.back().pixel_format;
  }
  if (!has_monitor) signal.monitor = 1.0;
  instrument::SensorModel sensor = instrument.sensor;
  std::vector<instrument::Exposure> bracket;
  for (const devices::Frame& image : images) {
    bracket.push_back({image.pixels_dn, devices::to_seconds(image.exposure)});
    sensor.saturation_dn = saturation_level_dn(sensor, image.saturation_level_dn);
  }
  signal.merged = instrument::merge_bracket(sensor, bracket, instrument.camera.width_px,
                                            {background.offset_dn, background.rate_dn_per_s});
  // The maps' own noise is common to the bracket: it is added after the merge.
  const double t = signal.longest_exposure_s;
  const double background_variance =
      background.rate_variance_dn2_per_s2 + background.offset_variance_dn2 / (t * t);
  for (double& variance : signal.merged.variance) variance += background_variance;
  return signal;
}

ColourLayout::ColourLayout(const SessionReader& archive, const std::filesystem::path& place) {
  std::set<std::string> names;
  for (const FrameRecord& record : archive.frames()) {
    if (!record.channel.empty()) names.insert(record.channel);
  }
  if (names.empty()) throw NothingToReduce(place, "frames", "found none with the lamp on");
  channels_.assign(names.begin(), names.end());
  if (channels_.size() == 1) return;  // every colour comes from channel 0
  constexpr std::array<const char*, 3> kColours{"R", "G", "B"};
  for (std::size_t colour = 0; colour < kColours.size(); ++colour) {
    const auto found = std::find(channels_.begin(), channels_.end(), kColours[colour]);
    if (found == channels_.end() || channels_.size() != kColours.size()) {
      throw NothingToReduce(place, "channels",
                            fmt::format("found [{}], expected R, G, B or a single channel",
                                        fmt::join(channels_, ", ")));
    }
    channel_of_[colour] = static_cast<std::size_t>(found - channels_.begin());
  }
}

bool ColourLayout::carries(devices::PixelFormat format, int column, int row, int colour) {
  // Colours of the 2 x 2 cell, row by row, starting at the frame's top left pixel.
  constexpr std::array<std::array<int, 4>, 4> kPhases{
      {{0, 1, 1, 2}, {1, 0, 2, 1}, {1, 2, 0, 1}, {2, 1, 1, 0}}};
  std::size_t phase = 0;
  switch (format) {
    case devices::PixelFormat::mono:
      return true;
    case devices::PixelFormat::bayer_rggb:
      phase = 0;
      break;
    case devices::PixelFormat::bayer_grbg:
      phase = 1;
      break;
    case devices::PixelFormat::bayer_gbrg:
      phase = 2;
      break;
    case devices::PixelFormat::bayer_bggr:
      phase = 3;
      break;
  }
  return kPhases[phase][static_cast<std::size_t>((row % 2) * 2 + column % 2)] == colour;
}

}  // namespace gonio::acquisition
