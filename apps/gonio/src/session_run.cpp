#include "session_run.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ctime>
#include <memory>
#include <optional>

#include "asking_changer.h"
#include "calibration_setup.h"
#include "gonio/console/failures.h"
#include "gonio/files/sha256.h"
#include "gonio/instrument/calibration_file.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/simulated_rig.h"
#include "gonio/version/version.h"

namespace gonio::cli {
namespace {

constexpr const char* kRigText = "rig.toml";
constexpr const char* kPlanText = "plan.csv";
constexpr const char* kCalibrationText = "calibration.json";

acquisition::SessionMetadata metadata_of(const SessionSetup& session,
                                         const std::string& calibration, OpenedRig& rig) {
  const devices::CameraInfo camera = rig.devices().camera->info();
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
      {"camera", camera.model + " " + camera.serial},
      {"lamp_channels", lamp},
      {"calibration", session.instrument.id},
      {"calibration_sha256", files::sha256_of_bytes(calibration)},
      {"plan_sha256", files::sha256_of_bytes(session.plan_text)},
      {"white_reference", session.instrument.white.id},
      {"provenance_started_utc",
       fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))}};
  if (session.calibration) {
    metadata.insert(session.calibration->metadata.begin(), session.calibration->metadata.end());
    const std::string despite = fmt::format("{}", fmt::join(session.calibration->reasons(), "; "));
    if (!despite.empty()) metadata["calibration_accepted_despite"] = despite;
  }
  metadata.insert(session.alignment.begin(), session.alignment.end());
  if (session.simulated) {
    metadata["simulated_material"] = session.material_name;
    metadata["seed"] = std::to_string(session.seed);
  } else {
    for (const DeviceIdentity& each : rig.identities()) {
      metadata["device_" + each.device] = each.identity;
    }
  }
  return metadata;
}

void check(const acquisition::DeviceSet& devices, const SessionSetup& session) {
  if (session.calibration && !session.accept_calibration) session.calibration->require_usable();
  try {
    acquisition::check_before_motion(devices, session.instrument, session.plan,
                                     session.rig.session);
  } catch (const acquisition::PreflightError& error) {
    throw UsageError(error.what());
  }
}

std::unique_ptr<OpenedRig> open_simulated(const SessionSetup& session) {
  return open_simulated_rig(simulated_world(session.rig, session.material.model, session.seed));
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

void check_session(const SessionSetup& session) {
  const auto rig = open_simulated(session);
  check(rig->devices(), session);
}

acquisition::SessionResult run_session(const Console& console, SessionSetup session,
                                       std::stop_token stop) {
  // What can be refused is refused before a device is opened.
  if (!session.simulated) check_session(session);
  const auto rig = session.simulated ? open_simulated(session)
                                     : open_hardware_rig(session.rig, Parts::all, stop);
  // A world in this process may stand in for a rig of metal, whose devices it is not.
  const bool own_devices = !session.simulated || session.rig.driver == RigFile::Driver::simulated;
  if (session.calibration && own_devices) session.calibration->use.serials = serials_of(*rig);
  AskingChanger person(rig->devices().changer);
  const acquisition::DeviceSet devices = with_changer(rig->devices(), session, person);
  check(devices, session);
  const std::string calibration = instrument::to_json(session.instrument);
  Progress progress(console, "measuring");
  const std::optional<double> time_scale =
      session.simulated ? session.rig.world.time_scale : std::optional(rig->time_scale());
  const auto show = [&](const acquisition::SessionProgress& now) {
    const double whole = now.elapsed_s + now.remaining_s;
    const std::string words =
        now.phase == "point" ? fmt::format("point {} of {}", now.done + 1, now.total) : now.phase;
    // The time left is the session's own; one in a world at no pace passes it much faster.
    if (time_scale) {
      progress.update(whole > 0.0 ? now.elapsed_s / whole : 0.0, words,
                      now.remaining_s / *time_scale);
    } else {
      progress.update(now.total > 0 ? static_cast<double>(now.done) / now.total : 0.0, words);
    }
    console.detail(fmt::format("  {:8.1f} s  {}", now.elapsed_s, words));
  };
  acquisition::SessionWriter archive(session.archive, metadata_of(session, calibration, *rig),
                                     {{kRigText, rig_file_text(session.rig, false)},
                                      {kPlanText, session.plan_text},
                                      {kCalibrationText, calibration}});
  acquisition::SessionResult result =
      acquisition::run_session(devices, session.instrument, session.plan, session.rig.session,
                               archive, show, std::move(stop));
  rig->require_safe();
  return result;
}

StoredSession open_session(const std::filesystem::path& folder, const std::string& calibration) {
  if (!std::filesystem::exists(folder / "session.sqlite")) {
    throw UsageError(folder.string() + ": found no session.sqlite, expected a session archive");
  }
  acquisition::SessionReader archive(folder);
  const auto configuration = [&](const char* name) {
    const auto found = archive.configuration().find(name);
    if (found == archive.configuration().end()) {
      throw UsageError(folder.string() + ": configuration: found no " + name);
    }
    return found->second;
  };
  RigFile rig = rig_file_from_text(configuration(kRigText), folder / kRigText);
  instrument::Instrument instrument =
      calibration.empty() ? instrument::instrument_from_json(configuration(kCalibrationText),
                                                             folder / kCalibrationText)
                          : instrument_of(rig, calibration);
  return {std::move(archive), std::move(rig), std::move(instrument)};
}

std::string metadata(const acquisition::SessionReader& archive, const std::string& key) {
  const auto found = archive.metadata().find(key);
  return found == archive.metadata().end() ? std::string() : found->second;
}

acquisition::Reduction reduce_session(const StoredSession& session,
                                      const acquisition::ReductionOptions& options) {
  acquisition::Reduction reduction =
      acquisition::reduce(session.archive, session.instrument, options);
  const std::string scale = metadata(session.archive, "radiometric_scale");
  if (!scale.empty()) {
    reduction.samples.scale =
        blame(session.archive.folder(), [&] { return brdf::radiometric_scale_from_string(scale); });
  }
  return reduction;
}

}  // namespace gonio::cli
