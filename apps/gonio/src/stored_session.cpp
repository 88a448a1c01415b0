#include "stored_session.h"

#include <fmt/format.h>

#include <charconv>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/console/failures.h"
#include "gonio/errors/errors.h"
#include "gonio/files/process_lock.h"
#include "gonio/instrument/calibration_file.h"
#include "plan_file.h"

namespace gonio::cli {
namespace {

DataFormatError unlike(const acquisition::SessionReader& archive, const std::string& key,
                       const std::string& expected) {
  constexpr std::size_t kMostShown = 40;  // of a text that should not be there
  return {archive.folder(), "metadata " + key,
          fmt::format("found {:?}, expected {}", metadata(archive, key).substr(0, kMostShown),
                      expected)};
}

std::uint64_t seed_of(const acquisition::SessionReader& archive) {
  const std::string text = metadata(archive, "seed");
  std::uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (error == std::errc() && end == text.data() + text.size()) return seed;
  throw unlike(archive, "seed", "a whole number");
}

/// What is measured from here on is reduced as the archive says.
void require_stored_scale(const acquisition::SessionReader& archive, const SessionSetup& session) {
  const std::string expected(brdf::to_string(session.material.scale));
  if (metadata(archive, "radiometric_scale") != expected) {
    throw unlike(archive, "radiometric_scale", expected);
  }
}

}  // namespace

void require_session(const std::filesystem::path& folder) {
  if (std::filesystem::exists(folder / "session.sqlite")) return;
  throw UsageError(folder.string() + ": found no session.sqlite, expected a session archive",
                   "one that was just begun has none until its devices are open and checked");
}

StoredSession open_session(const std::filesystem::path& folder, const std::string& calibration) {
  require_session(folder);
  return stored_session(acquisition::SessionReader(folder), calibration);
}

StoredSession stored_session(acquisition::SessionReader archive, const std::string& calibration) {
  const std::filesystem::path folder = archive.folder();
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
  const acquisition::SessionReader& archive = session.archive;
  acquisition::Reduction reduction = [&] {
    try {
      return acquisition::reduce(archive, session.instrument, options);
    } catch (const acquisition::NothingToReduce& error) {
      if (archive.finished()) throw;
      const bool measuring =
          files::lock_holder(acquisition::session_lock(archive.folder())).has_value();
      throw UsageError(error.what(), measuring
                                         ? "the session is being measured"
                                         : "the session did not come to its end; gonio resume " +
                                               archive.folder().string() + " goes on with it");
    }
  }();
  const std::string scale = metadata(archive, "radiometric_scale");
  if (!scale.empty()) {
    reduction.samples.scale =
        blame(archive.folder(), [&] { return brdf::radiometric_scale_from_string(scale); });
  }
  return reduction;
}

SessionSetup stored_setup(const StoredSession& stored) {
  const acquisition::SessionReader& archive = stored.archive;
  SessionSetup session;
  session.rig = stored.rig;
  session.rig.path = metadata(archive, "rig_file");  // what the rig file names lies beside it
  session.instrument = stored.instrument;
  session.archive = archive.folder();
  session.labels.sample_id = metadata(archive, "sample_id");
  const auto poses = archive.configuration().find(kPosesText);
  if (poses == archive.configuration().end()) {
    throw UsageError(fmt::format("{}: configuration: found no {}; an earlier version made it",
                                 archive.folder().string(), kPosesText));
  }
  session.plan = stored_poses(poses->second, archive.folder() / kPosesText, session.instrument.rig);
  const std::string driver = metadata(archive, "driver");
  session.simulated = driver == "simulated";
  if (!session.simulated && driver != "hardware") {
    throw unlike(archive, "driver", "simulated or hardware");
  }
  return session;
}

void set_stored_sample(const acquisition::SessionReader& archive, SessionSetup& session) {
  if (!session.simulated) {
    // Only its geometry is looked at, by the check before anything is opened.
    session.material = {std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5)),
                        brdf::RadiometricScale::si};
    require_stored_scale(archive, session);
    return;
  }
  const std::string source = metadata(archive, "simulated_material_source");
  if (source.empty()) {
    throw UsageError(archive.folder().string() +
                     ": does not say what lies on its simulated rig (made by gonio demo or an "
                     "earlier version)");
  }
  session.material = load_sample(named_material(source));
  session.seed = seed_of(archive);
  require_stored_scale(archive, session);
}

void add_decided_points(const acquisition::SessionReader& archive,
                        const acquisition::ResumeState& state, SessionSetup& session) {
  acquisition::MeasurementPlan added;
  for (const acquisition::LoggedDecision& logged : state.decisions) {
    for (const acquisition::AddedPoint& point : logged.decision.added) {
      const std::size_t expected = session.plan.points.size() + added.points.size();
      if (static_cast<std::size_t>(point.point) != expected) {
        throw DataFormatError(
            archive.folder(), "decisions",
            fmt::format("found point {} added, expected {}", point.point, expected));
      }
      if (point.pose.joints.size() != session.instrument.rig.axes.size()) {
        throw DataFormatError(
            archive.folder(), "decisions",
            fmt::format("point {}: found {} joints, the rig has {} axes", point.point,
                        point.pose.joints.size(), session.instrument.rig.axes.size()));
      }
      added.points.push_back({point.direction, point.pose, 0.0, 0.0});
    }
  }
  if (added.points.empty()) return;
  const rig::RigDescription& rig = session.instrument.rig;
  const acquisition::MeasurementPlan checked =
      realised_poses(plan_text(rig, added, {}, {}), archive.folder() / "decisions", rig);
  session.plan.points.insert(session.plan.points.end(), checked.points.begin(),
                             checked.points.end());
}

}  // namespace gonio::cli
