#include "session_run.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <iostream>

#include "gonio/console/failures.h"
#include "gonio/files/sha256.h"
#include "gonio/instrument/calibration_file.h"
#include "gonio/setup/simulated_rig.h"
#include "gonio/sim/sim_goniometer.h"
#include "gonio/version/version.h"

namespace gonio::cli {
namespace {

constexpr const char* kRigText = "rig.toml";
constexpr const char* kPlanText = "plan.csv";
constexpr const char* kCalibrationText = "calibration.json";

/// A person at the terminal, who changes the target of the simulated rig.
class AskingChanger final : public devices::TargetChanger {
 public:
  explicit AskingChanger(devices::TargetChanger& changer) : changer_(changer) {}

  const std::string& name() const override { return name_; }
  devices::Target mounted() const override { return changer_.mounted(); }
  void mount(devices::Target target) override {
    if (changer_.mounted() == target) return;
    fmt::print(stderr, "Mount the {}, then press Enter (q and Enter to give up): ",
               target == devices::Target::white ? "white reference" : "sample");
    std::string answer;
    if (!std::getline(std::cin, answer) || answer == "q") {
      throw devices::DeviceError(devices::DeviceErrc::Stopped, name_,
                                 "nobody confirmed that the target was changed");
    }
    changer_.mount(target);
  }

 private:
  devices::TargetChanger& changer_;
  std::string name_ = "operator";
};

acquisition::SessionMetadata metadata_of(const SimulatedSession& session,
                                         const std::string& calibration,
                                         const devices::CameraInfo& camera,
                                         const std::vector<devices::LightChannel>& channels) {
  std::string lamp;
  for (const devices::LightChannel& channel : channels) {
    lamp +=
        fmt::format("{}{} {:g} nm", lamp.empty() ? "" : ", ", channel.name, channel.wavelength_nm);
  }
  return {{"sample_id", session.labels.sample_id},
          {"operator", session.labels.operator_name},
          {"note", session.labels.note},
          {"software", std::string("gonio ") + version()},
          {"revision", revision()},
          {"rig", session.rig.rig.name},
          {"driver", "simulated"},
          {"simulated_material", session.material_name},
          {"radiometric_scale", std::string(brdf::to_string(session.material.scale))},
          {"seed", std::to_string(session.seed)},
          {"camera", camera.model + " " + camera.serial},
          {"lamp_channels", lamp},
          {"calibration", session.instrument.id},
          {"calibration_sha256", files::sha256_of_bytes(calibration)},
          {"plan_sha256", files::sha256_of_bytes(session.plan_text)},
          {"white_reference", session.instrument.white.id},
          {"provenance_started_utc",
           fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))}};
}

void check(const acquisition::DeviceSet& devices, const SimulatedSession& session) {
  try {
    acquisition::check_before_motion(devices, session.instrument, session.plan,
                                     session.rig.session);
  } catch (const acquisition::PreflightError& error) {
    throw UsageError(error.what());
  }
}

sim::SimGoniometer world_of(const SimulatedSession& session) {
  return sim::SimGoniometer(simulated_world(session.rig, session.material.model, session.seed));
}

}  // namespace

void check_simulated(const SimulatedSession& session) {
  sim::SimGoniometer world = world_of(session);
  check(devices_of(world), session);
}

acquisition::SessionResult run_simulated(const Console& console, const SimulatedSession& session,
                                         std::stop_token stop) {
  sim::SimGoniometer world = world_of(session);
  acquisition::DeviceSet devices = devices_of(world);
  AskingChanger person(world.target_changer());
  if (session.ask_person && session.rig.session.white == acquisition::WhitePlacement::manual) {
    devices.changer = &person;
  }
  check(devices, session);
  const std::string calibration = instrument::to_json(session.instrument);
  Progress progress(console, "measuring");
  const auto show = [&](const acquisition::SessionProgress& now) {
    const double whole = now.elapsed_s + now.remaining_s;
    const std::string words =
        now.phase == "point" ? fmt::format("point {} of {}", now.done + 1, now.total) : now.phase;
    // The time left is the session's own; a simulated one passes it much faster.
    if (session.rig.world.time_scale) {
      progress.update(whole > 0.0 ? now.elapsed_s / whole : 0.0, words,
                      now.remaining_s / *session.rig.world.time_scale);
    } else {
      progress.update(now.total > 0 ? static_cast<double>(now.done) / now.total : 0.0, words);
    }
    console.detail(fmt::format("  {:8.1f} s  {}", now.elapsed_s, words));
  };
  acquisition::SessionWriter archive(
      session.archive,
      metadata_of(session, calibration, devices.camera->info(), devices.light->channels()),
      {{kRigText, rig_file_text(session.rig, false)},
       {kPlanText, session.plan_text},
       {kCalibrationText, calibration}});
  return acquisition::run_session(devices, session.instrument, session.plan, session.rig.session,
                                  archive, show, std::move(stop));
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
