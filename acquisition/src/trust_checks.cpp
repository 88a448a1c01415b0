#include "trust_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "gonio/acquisition/reduction.h"
#include "gonio/devices/homing_report.h"
#include "gonio/errors/errors.h"
#include "home_deltas.h"
#include "light_watch.h"
#include "session_checks.h"
#include "session_parts.h"
#include "standing_capture.h"

namespace gonio::acquisition {
namespace {

/// Of the monitor's reading at the white. Lamps age and drift by less; a dark monitor reads less.
constexpr double kLitFraction = 0.5;
/// Of the monitor within one bracket, relative. It reads steady light to a tenth of that.
constexpr double kLargestFlicker = 0.03;

const devices::HomingReport* homing_report(const devices::RotationStage* stage) {
  return dynamic_cast<const devices::HomingReport*>(stage);
}

}  // namespace

TrustChecks::TrustChecks(GuardedDevices& devices, const instrument::Instrument& instrument,
                         const MeasurementPlan& plan, const SessionOptions& options,
                         SessionWriter& archive, const SessionPart& part,
                         const rig::Joints& sentinel_pose)
    : devices_(devices),
      instrument_(instrument),
      options_(options),
      archive_(archive),
      part_(part),
      pose_(sentinel_pose) {
  tells_home_delta_ = tells_home_delta(devices.devices());
  // A plan read back from an archive does not tell its time, but the part before had sentinels.
  sentinel_on_ =
      has_sentinel(plan, options) || (options.sentinel_every > 0 && !part.sentinel.empty());
  for (const auto& [channel, level] : part.sentinel) exposures_[channel] = level.exposure;
}

bool TrustChecks::due(std::size_t points_since) const {
  if (!sentinel_on_ || points_since == 0) return false;
  return points_since >= static_cast<std::size_t>(options_.sentinel_every) ||
         devices_.now() - last_check_ >= options_.sentinel_interval;
}

bool TrustChecks::compare_with_last_part(const Distrust& distrust) {
  last_check_ = devices_.now();
  compared_with_last_part_ = true;
  const std::size_t axes = devices_.devices().stages.size();
  if (part_.last_joints.size() == axes) return judge_homing(part_.last_joints, true, distrust);
  for (std::size_t i = 0; i < axes; ++i) devices_.forget_homing(i);
  if (const std::string text = axes_that_cannot_tell(); !text.empty()) {
    archive_.note(devices_.now(), kHomeDeltaNote, home_delta_text({text}, false, false));
  }
  return false;
}

std::string TrustChecks::compare_light_with_last_part() {
  if (part_.last_joints.empty()) return {};
  try {
    ReductionOptions options;
    set_geometry(options_, options);
    const SessionReader archive(archive_.folder());
    const std::vector<PartBridge> found = bridges(archive, instrument_, options);
    if (found.empty() || found.back().part + 1 != SessionParts(archive).count()) return {};
    const std::string text = to_text(found.back());
    archive_.note(devices_.now(), found.back().is_refused() ? kUnbridgedNote : kBridgeNote, text);
    return found.back().is_refused() ? text : std::string();
  } catch (const DataFormatError& error) {
    // What was stored before must not end what can still be measured; reducing it will tell.
    archive_.note(devices_.now(), "warning", fmt::format("not bridged: {}", error.what()));
    return error.what();
  }
}

void TrustChecks::compare_after_loss(const rig::Joints& believed, const Distrust& distrust) {
  if (compared_with_last_part_) judge_homing(believed, true, distrust);
}

TrustChecks::Compared TrustChecks::check(const Distrust& distrust_axes,
                                         const Distrust& distrust_light) {
  Compared compared;
  compared.axes = !tells_home_delta_ || check_home(distrust_axes);
  compared.light = visit_sentinel(distrust_light);
  last_check_ = devices_.now();
  return compared;
}

bool TrustChecks::check_home(const Distrust& distrust) {
  // From home by their count the axes have no way to search that could meet a keep-out.
  const rig::Joints believed = devices_.move_to(instrument_.rig.home());
  try {
    devices_.home_all();
  } catch (const devices::DeviceError&) {
    // What those said that were homed before is not to be lost with the session.
    judge_homing(believed, false, distrust);
    throw;
  }
  return judge_homing(believed, false, distrust);
}

/// Each axis by its own homing. One that was not homed since it was judged is judged when it is, by
/// what its failed homings have told.
bool TrustChecks::judge_homing(const rig::Joints& believed, bool after_outage,
                               const Distrust& distrust) {
  std::vector<std::string> texts;
  std::vector<std::string> lost;
  bool compared = tells_home_delta_;
  const auto& stages = devices_.devices().stages;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const HomingEvidence evidence = devices_.homing_evidence(i);
    const devices::HomingReport* report = homing_report(stages[i]);
    if (report == nullptr || !report->tells()) continue;
    if (!evidence.stood && !evidence.homed) {
      compared = false;
      continue;
    }
    devices_.forget_homing(i);
    HomeDelta delta = home_delta(stages[i]->name(), evidence, believed.at(i), after_outage);
    compared = compared && delta.compared;
    texts.push_back(std::move(delta.text));
    if (!delta.lost.empty()) lost.push_back(std::move(delta.lost));
  }
  if (!lost.empty()) distrust(fmt::format("{}", fmt::join(lost, "; ")));
  if (std::string text = axes_that_cannot_tell(); !text.empty()) texts.push_back(std::move(text));
  if (!texts.empty()) {
    archive_.note(devices_.now(), kHomeDeltaNote, home_delta_text(texts, after_outage, compared));
  }
  return compared;
}

/// Said once in a part; empty after that, and where all axes can.
std::string TrustChecks::axes_that_cannot_tell() {
  if (std::exchange(said_who_cannot_tell_, true)) return "";
  std::vector<std::string> names;
  for (const devices::RotationStage* stage : devices_.devices().stages) {
    const devices::HomingReport* report = homing_report(stage);
    if (report == nullptr || !report->tells()) names.push_back(stage->name());
  }
  if (names.empty()) return "";
  return fmt::format("{} cannot tell: {}", fmt::join(names, ", "),
                     sentinel_on_
                         ? "a slip shows at the sentinels alone, and of a matte sample not there"
                         : "nothing in this session shows that such an axis slipped");
}

bool TrustChecks::visit_sentinel(const Distrust& distrust) {
  if (!sentinel_on_) return true;
  const SentinelFound found = read_sentinel(distrust);
  if (!found.unsteady.empty()) {
    if (found.saturated) {
      if (distrust) distrust(found.unsteady);
      throw devices::DeviceError(devices::DeviceErrc::Fault, devices_.devices().camera->name(),
                                 found.unsteady);
    }
    archive_.note(devices_.now(), kNoSentinelNote, "no sentinel this time: " + found.unsteady);
    return false;
  }
  if (!found.reading) {
    sentinel_on_ = false;
    archive_.note(devices_.now(), kNoSentinelNote,
                  "the sample is too dark at the sentinel's pose: no sentinels in this session");
    return true;
  }
  const bool compared = last_.has_value();
  compare_sentinel(*found.reading, distrust);
  archive_.note(devices_.now(), kSentinelNote, sentinel_text(*found.reading));
  last_ = SentinelVisit{devices_.now(), *found.reading};
  return compared;
}

TrustChecks::SentinelFound TrustChecks::read_sentinel(const Distrust& distrust) {
  devices_.move_to(pose_);
  // The pixels of the pose itself: those of what was read back would differ at the edges.
  const Regions regions = regions_of(instrument_, rig::forward(instrument_.rig, pose_),
                                     Eigen::Vector2d::Zero(), options_.sample_half_width_mm, 1);
  if (regions.empty()) return {};
  SentinelReading reading;
  for (const devices::LightChannel& channel : devices_.devices().light->channels()) {
    for (int tries = 0;; ++tries) {
      std::string unsteady;
      bool saturated = false;
      if (!exposures_.contains(channel.name)) {
        devices_.light(channel.name);
        FrameRecord record;
        record.kind = FrameKind::sentinel;
        record.channel = channel.name;
        const BracketResult found = take_bracket(devices_, instrument_, options_, regions,
                                                 options_.first_exposure, record, archive_);
        require_lit(channel.name, found.highest_monitor);
        unsteady = flicker(channel.name, found.lowest_monitor, found.highest_monitor);
        if (unsteady.empty()) {
          if (found.dark_regions == found.regions || found.saturated_regions > 0) return {};
          exposures_[channel.name] = found.start;
        }
      }
      if (unsteady.empty()) {
        ChannelFound found =
            read_channel(channel.name, exposures_.at(channel.name), regions.front());
        unsteady = std::move(found.unsteady);
        saturated = found.saturated;
        reading[channel.name] = found.level;
      }
      if (unsteady.empty()) break;
      if (tries >= options_.retries) return {std::nullopt, std::move(unsteady), saturated};
      archive_.note(devices_.now(), kSentinelAgainNote, unsteady);
    }
  }
  for (const auto& [channel, level] : reading) {
    // A sentinel that went dark is no reading to go on with: the lamp is off without a monitor, or
    // something stands in the light.
    if (level.level_dn_per_s > 0.0) continue;
    const std::string why =
        fmt::format("the sentinel is dark in channel {}: is the lamp on?", channel);
    if (distrust) distrust(why);
    throw devices::DeviceError(devices::DeviceErrc::Fault, devices_.devices().light->name(), why);
  }
  return {std::move(reading), {}, false};
}

TrustChecks::ChannelFound TrustChecks::read_channel(const std::string& channel,
                                                    std::chrono::nanoseconds exposure,
                                                    const std::vector<std::size_t>& pixels) {
  const instrument::SensorModel& sensor = instrument_.sensor;
  const auto mean_dn = [&](const devices::Frame& frame) {
    double sum = 0.0;
    for (const std::size_t pixel : pixels) {
      sum += sensor.response.linear_dn(frame.pixels_dn[pixel] - frame.black_level_dn);
    }
    return sum / static_cast<double>(pixels.size());
  };
  FrameRecord record;
  record.kind = FrameKind::sentinel;
  record.channel = channel;
  devices_.light(channel);
  double lit_dn = 0.0;
  double monitor = 0.0;
  bool saturated = false;
  LightWatch light(devices_);
  for (int i = 0; i < kSentinelFrames; ++i) {
    FrameRecord own = record;
    const devices::Frame frame =
        capture_standing(devices_, exposure, own, [&] { light.during(exposure); });
    own.monitor = light.read();
    saturated = saturated || std::any_of(pixels.begin(), pixels.end(), [&](std::size_t pixel) {
                  return frame.pixels_dn[pixel] >= frame.saturation_level_dn;
                });
    lit_dn += mean_dn(frame) / kSentinelFrames;
    monitor += own.monitor / kSentinelFrames;
    archive_.append(std::move(own), frame);
  }
  devices_.close_shutter();
  require_lit(channel, light.highest());
  ChannelFound found;
  found.unsteady = flicker(channel, light.lowest(), light.highest());
  // In the exposure that was chosen for it: light or camera changed by much.
  found.saturated = saturated;
  if (saturated) found.unsteady = "the sentinel saturates in channel " + channel;
  if (!found.unsteady.empty()) return found;
  FrameRecord dark = record;
  dark.channel.clear();
  const devices::Frame frame = capture_standing(devices_, exposure, dark);
  const double dark_dn = mean_dn(frame);
  archive_.append(std::move(dark), frame);

  const double signal_dn = lit_dn - dark_dn;
  const double read_dn = sensor.gain_dn_per_e * sensor.read_noise_e;
  const double read_variance = read_dn * read_dn + 1.0 / 12.0;
  const double lit_variance = read_variance + sensor.gain_dn_per_e * std::max(0.0, lit_dn);
  const double dark_variance = read_variance + sensor.gain_dn_per_e * std::max(0.0, dark_dn);
  SentinelLevel& level = found.level;
  level.exposure = exposure;
  if (!(signal_dn > 0.0)) return found;
  // A channel that its monitor does not see is compared as it is.
  const double divisor = lit_monitor_.contains(channel) ? monitor : 1.0;
  level.level_dn_per_s =
      signal_dn / (devices::to_seconds(exposure) + sensor.shutter_offset_s) / divisor;
  level.relative_sigma = std::sqrt((lit_variance / kSentinelFrames + dark_variance) /
                                   static_cast<double>(pixels.size())) /
                         signal_dn;
  return found;
}

void TrustChecks::compare_sentinel(const SentinelReading& reading, const Distrust& distrust) {
  if (!last_) return;  // over an interruption the whites are compared too, by the reduction
  const double dt_s = devices::to_seconds(devices_.now() - last_->at);
  std::vector<std::string> steps;
  for (const auto& [channel, level] : reading) {
    const auto before = last_->reading.find(channel);
    if (before == last_->reading.end()) continue;
    const SentinelChange change =
        sentinel_change(before->second, level, instrument_.u_lamp_relative);
    // What drifts evenly is no step: the whites and sentinels about a point tell its level.
    const double beyond_drift = change.relative - slope_per_s_[channel] * dt_s;
    slope_per_s_[channel] = change.relative / dt_s;
    const double limit = kStepSigmas * change.u;
    if (std::abs(change.relative) <= limit || std::abs(beyond_drift) <= limit) continue;
    steps.push_back(
        fmt::format("the sentinel changed by {:+.2f} % in channel {} since the last "
                    "check, expected within {:.2f} %",
                    100.0 * change.relative, channel, 100.0 * limit));
  }
  if (steps.empty()) return;
  const std::string text = fmt::format("{}", fmt::join(steps, "; "));
  archive_.note(devices_.now(), kSentinelStepNote, text);
  distrust(text);
}

void TrustChecks::set_lit_monitor(const std::string& channel, double highest_reading) {
  // A monitor that is blind to a channel, or none: nothing can be told from it. By the highest: of
  // a lamp that is on and off in turn the lowest reading looks blind.
  constexpr double kBlind = 0.02;
  if (highest_reading > kBlind) lit_monitor_[channel] = highest_reading;
}

void TrustChecks::require_lit(const std::string& channel, double highest_reading) const {
  const auto lit = lit_monitor_.find(channel);
  if (lit == lit_monitor_.end() || highest_reading >= kLitFraction * lit->second) return;
  throw devices::DeviceError(
      devices::DeviceErrc::Fault, devices_.devices().light->name(),
      fmt::format("its monitor reads {:.3f} in channel {}, {:.3f} at the white: is the lamp on?",
                  highest_reading, channel, lit->second));
}

std::string TrustChecks::flicker(const std::string& channel, double lowest_reading,
                                 double highest_reading) const {
  if (!lit_monitor_.contains(channel)) return {};
  if (highest_reading <= (1.0 + kLargestFlicker) * lowest_reading) return {};
  return fmt::format("the lamp monitor read {:.3f} to {:.3f} in channel {}, expected within {:g} %",
                     lowest_reading, highest_reading, channel, 100.0 * kLargestFlicker);
}

}  // namespace gonio::acquisition
