#include "session_run.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "asking_changer.h"
#include "changer_wait.h"
#include "gonio/acquisition/time_left.h"
#include "gonio/console/failures.h"
#include "gonio/errors/errors.h"
#include "gonio/files/sha256.h"
#include "gonio/instrument/calibration_file.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/simulated_rig.h"
#include "gonio/version/version.h"
#include "plan_file.h"
#include "session_loop.h"
#include "session_preflight.h"
#include "session_teller.h"
#include "stored_session.h"

namespace gonio::cli {
namespace {

/// Who the devices are, as far as a session remembers.
acquisition::SessionMetadata device_metadata(const SessionSetup& session, OpenedRig& rig) {
  const devices::CameraInfo camera = rig.devices().camera->info();
  acquisition::SessionMetadata metadata{{"camera", camera.model + " " + camera.serial}};
  if (session.simulated) return metadata;
  for (const DeviceIdentity& each : rig.identities()) {
    metadata["device_" + each.device] = each.identity;
  }
  return metadata;
}

/// Throws UsageError when a session would go on with other devices.
void require_same_devices(const SessionSetup& session, const SessionToResume& resumed,
                          OpenedRig& rig) {
  for (const auto& [key, found] : device_metadata(session, rig)) {
    const auto expected = resumed.metadata.find(key);
    if (expected != resumed.metadata.end() && expected->second == found) continue;
    throw UsageError(
        fmt::format("{}: {} is {:?}, the session was begun with {:?}", session.archive.string(),
                    key, found, expected == resumed.metadata.end() ? "none" : expected->second),
        "connect the devices it was begun with, or begin a new session");
  }
}

std::string absolute_text(const std::filesystem::path& path) {
  return std::filesystem::absolute(path).lexically_normal().string();
}

acquisition::SessionMetadata metadata_of(const SessionSetup& session,
                                         const std::string& calibration, OpenedRig& rig) {
  std::string lamp;
  for (const devices::LightChannel& channel : rig.devices().light->channels()) {
    lamp +=
        fmt::format("{}{} {:g} nm", lamp.empty() ? "" : ", ", channel.name, channel.wavelength_nm);
  }
  acquisition::SessionMetadata metadata{
      {"sample_id", session.labels.sample_id},
      {"operator", session.labels.operator_name},
      {"note", session.labels.note},
      {"software", std::string("gonio ") + version()},
      {"revision", revision()},
      {"rig", session.rig.rig.name},
      {"driver", session.simulated ? "simulated" : "hardware"},
      {"radiometric_scale", std::string(brdf::to_string(session.material.scale))},
      {"lamp_channels", lamp},
      {"calibration", session.instrument.id},
      {"calibration_sha256", files::sha256_of_bytes(calibration)},
      {"plan_sha256", files::sha256_of_bytes(session.plan_text)},
      {"white_reference", session.instrument.white.id},
      {"rig_file", session.rig.path.empty() ? "" : absolute_text(session.rig.path)},
      {"provenance_started_utc",
       fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))}};
  if (session.calibration) {
    metadata.insert(session.calibration->metadata.begin(), session.calibration->metadata.end());
    const std::string despite = fmt::format("{}", fmt::join(session.calibration->reasons(), "; "));
    if (!despite.empty()) metadata["calibration_accepted_despite"] = despite;
  }
  metadata.insert(session.alignment.begin(), session.alignment.end());
  if (session.loop) metadata.merge(loop_metadata(*session.loop));
  if (session.simulated) {
    metadata["simulated_material"] = session.material_name;
    metadata["simulated_material_source"] = session.material_source;
    metadata["seed"] = std::to_string(session.seed);
  }
  metadata.merge(device_metadata(session, rig));
  return metadata;
}

/// Throws UsageError with the first refusal.
SessionPreflight check(const acquisition::DeviceSet& devices, const SessionSetup& session,
                       std::size_t points_done) {
  if (session.calibration && !session.accept_calibration) session.calibration->require_usable();
  SessionPreflight preflight = preflight_session(devices, session, points_done);
  if (const acquisition::Check* refusal = preflight.found.refusal()) {
    throw UsageError(refusal->text);
  }
  return preflight;
}

/// Says how long it will take, before anything moves. `time_scale`: seconds of the session for one
/// of the host; nothing: as fast as the host can.
void tell_forecast(const Console& console, const SessionSetup& session,
                   const SessionPreflight& preflight, const acquisition::SessionPart& part,
                   std::optional<double> time_scale) {
  const std::set<int> left = acquisition::points_left(part, session.plan.points.size());
  const acquisition::Estimate& whole_s = preflight.found.forecast->total_s;
  const acquisition::TimeLeft time(*preflight.found.itinerary, session.plan);
  const double left_s =
      left.size() == session.plan.points.size() ? whole_s.expected : time.from("home", left);
  // As if what is unknown were independent: of a part that is no less than it is.
  const double share = std::sqrt(left_s / whole_s.expected);
  const acquisition::Estimate of_part{left_s, left_s - share * (whole_s.expected - whole_s.low),
                                      left_s + share * (whole_s.high - whole_s.expected)};
  std::string text = fmt::format("{} point(s) to measure, about {}", left.size(), to_text(of_part));
  if (!time_scale || *time_scale != 1.0) text += " of session time";
  if (time_scale) {
    const double host_s = left_s / *time_scale;
    const std::time_t now = std::time(nullptr);
    const std::time_t end = now + static_cast<std::time_t>(host_s);
    constexpr double kHalfADay_s = 12.0 * 3600.0;
    text += fmt::format("; until about {}",
                        host_s < kHalfADay_s ? fmt::format("{:%H:%M}", fmt::localtime(end))
                                             : fmt::format("{:%d %b %H:%M}", fmt::localtime(end)));
  }
  console.say(text);
}

/// Space for the frames of the points that are not done, and for what comes around them.
class SessionReserve {
 public:
  /// What the interval asks for at most, or as expected where that does not fit.
  SessionReserve(const SessionSetup& session, const SessionPreflight& preflight,
                 const devices::CameraInfo& camera, std::size_t points_done)
      : points_(session.plan.points.size()) {
    const acquisition::DiskUse& use = *preflight.disk;
    const std::uint64_t wanted = use.free_bytes > use.needed_high_bytes + use.needed_bytes
                                     ? use.needed_high_bytes
                                     : use.needed_bytes;
    around_bytes_ = acquisition::archive_bytes(camera, 0);
    per_point_bytes_ =
        (wanted - std::min(wanted, around_bytes_)) / std::max<std::size_t>(points_, 1);
    reserve_.emplace(session.archive, needed_after(points_done));
  }

  /// Before the next point is measured: its own share is its to write.
  void give_back(std::size_t points_done) { reserve_->keep(needed_after(points_done + 1)); }

 private:
  std::uint64_t needed_after(std::size_t points_done) const {
    return around_bytes_ + (points_ - std::min(points_, points_done)) * per_point_bytes_;
  }

  std::size_t points_;
  std::uint64_t around_bytes_ = 0;
  std::uint64_t per_point_bytes_ = 0;
  std::optional<acquisition::DiskReserve> reserve_;
};

/// Time has gone on, and the axes were switched on again, since a session to resume died.
std::unique_ptr<OpenedRig> open_simulated(const SessionSetup& session,
                                          const std::optional<SessionToResume>& resumed = {}) {
  sim::SimOptions world = simulated_world(session.rig, session.material.model, session.seed);
  if (resumed) {
    world.begins_at = resumed->state.may_begin_at + resumed->outage;
    world.power_ups = static_cast<std::uint64_t>(resumed->state.parts);
    // Nobody has turned the axes meanwhile.
    for (std::size_t i = 0; i < resumed->state.last_joints.size() && i < world.axes.size(); ++i) {
      world.axes[i].stands_at = resumed->state.last_joints[i];
    }
  }
  return open_simulated_rig(world);
}

acquisition::SessionWriter resume_archive(const SessionSetup& session, SessionToResume& resumed,
                                          std::chrono::nanoseconds now) {
  return acquisition::SessionWriter::resume(
      session.archive, std::move(resumed.lock), resumed.state.may_begin_at + resumed.outage, now,
      fmt::format("by {} {} at {:%Y-%m-%dT%H:%M:%SZ}, {} of {} points done{}{}", "gonio", version(),
                  fmt::gmtime(std::time(nullptr)), resumed.state.done.size(),
                  session.plan.points.size(), resumed.despite.empty() ? "" : ", accepted though ",
                  resumed.despite));
}

/// With the changer that the white's placement asks for. `person` must outlive what is returned.
acquisition::DeviceSet with_changer(acquisition::DeviceSet devices, const SessionSetup& session,
                                    AskingChanger& person) {
  const bool manual = session.rig.session.white == acquisition::WhitePlacement::manual;
  if (manual && (session.ask_person || !session.simulated)) devices.changer = &person;
  return devices;
}

}  // namespace

acquisition::SessionMetadata alignment_metadata(const instrument::Alignment& alignment) {
  return {{"alignment", alignment.method},
          {"alignment_sample", alignment.sample},
          {"alignment_found_utc", fmt::format("{:%FT%TZ}", alignment.found)},
          {"alignment_tilt_x_deg", fmt::format("{:.5f}", alignment.tilt_x.degrees())},
          {"alignment_tilt_y_deg", fmt::format("{:.5f}", alignment.tilt_y.degrees())}};
}

acquisition::SessionResult run_session(const Console& console, SessionSetup session,
                                       std::stop_token stop, std::stop_token pause,
                                       std::optional<SessionToResume> resumed,
                                       monitor::SessionMonitor* monitor) {
  // What can be refused is refused before a device is opened.
  const std::size_t points_done = resumed ? resumed->state.done.size() : 0;
  if (!session.simulated) check(open_simulated(session)->devices(), session, points_done);
  const auto rig = session.simulated ? open_simulated(session, resumed)
                                     : open_hardware_rig(session.rig, Parts::all, stop);
  // A world in this process may stand in for a rig of metal, whose devices it is not.
  const bool own_devices = !session.simulated || session.rig.driver == RigFile::Driver::simulated;
  if (session.calibration && own_devices) session.calibration->use.serials = serials_of(*rig);
  // A pause that comes while a person is asked finds no point to finish: it ends this part as well.
  std::stop_source ends;
  const std::stop_callback forward(stop, [&ends] { ends.request_stop(); });
  acquisition::DeviceSet own = rig->devices();
  std::optional<ChangerWait> changer;
  if (own.changer != nullptr) {
    own.changer = &changer.emplace(*own.changer, console, ends.get_token());
  }
  AskingChanger person(own.changer, ends.get_token(), pause, [&ends] { ends.request_stop(); });
  const acquisition::DeviceSet devices = with_changer(own, session, person);
  const SessionPreflight preflight = check(devices, session, points_done);
  use_forecast(*preflight.found.forecast, session.plan);
  if (resumed) require_same_devices(session, *resumed, *rig);
  const std::string calibration = instrument::to_json(session.instrument);
  // Run as it is stored, to the last bit: a session that is resumed goes to the same places.
  const std::string poses = plan_text(session.instrument.rig, session.plan, {}, {});
  session.plan.points = stored_poses(poses, kPosesText, session.instrument.rig).points;
  acquisition::SessionPart part;
  if (resumed) part = acquisition::part_to_resume(resumed->state);
  const std::optional<double> time_scale =
      session.simulated ? session.rig.world.time_scale : std::optional(rig->time_scale());
  tell_forecast(console, session, preflight, part, time_scale);
  Progress progress(console, "measuring");
  std::optional<SessionReserve> reserve;  // once there is an archive
  if (monitor != nullptr) {
    monitor->runs_at(time_scale);
    if (resumed) monitor->were_done(resumed->state.done);
  }
  std::optional<SessionLoop> loop;
  if (session.loop) {
    loop.emplace(*session.loop, session.instrument, session.rig, session.archive,
                 session.material.scale, &console);
  }
  const auto show = [&](const acquisition::SessionProgress& now) {
    if (monitor != nullptr) monitor->on_progress(now);
    const double whole = now.elapsed_s + now.remaining_s;
    std::string words =
        now.point ? fmt::format("point {}, {} of {} done", *now.point, now.done, now.total)
                  : now.phase;
    if (loop && loop->wanted_psnr_db() && loop->expected_psnr_db()) {
      words += fmt::format(", {:.1f} dB expected", *loop->expected_psnr_db());
    }
    const double fraction = whole > 0.0 ? now.elapsed_s / whole : 0.0;
    // The time left is the session's own; one in a world at no pace passes it much faster.
    if (time_scale) {
      progress.update(fraction, words, now.remaining_s / *time_scale);
    } else {
      progress.update(fraction, words);
    }
    console.detail(
        fmt::format("  {:8.1f} s  {}, {:.0f} s left", now.elapsed_s, words, now.remaining_s));
    if (reserve) reserve->give_back(static_cast<std::size_t>(now.done));
  };
  acquisition::SessionWriter archive =
      resumed ? resume_archive(session, *resumed, devices.clock->now())
              : acquisition::SessionWriter(session.archive, metadata_of(session, calibration, *rig),
                                           {{kRigText, rig_file_text(session.rig, false)},
                                            {kPlanText, session.plan_text},
                                            {kPosesText, poses},
                                            {kCalibrationText, calibration}});
  SessionTeller teller(console, monitor, resumed.has_value());
  archive.observe(&teller);
  const acquisition::Expectation expectation = expectation_of(session);
  part.expectation = &expectation;
  reserve.emplace(session, preflight, devices.camera->info(), points_done);
  part.pause = std::move(pause);
  acquisition::SessionResult result =
      acquisition::run_session(devices, session.instrument, session.plan, session.rig.session,
                               archive, show, ends.get_token(), part, loop ? &*loop : nullptr);
  rig->require_safe();
  return result;
}

}  // namespace gonio::cli
