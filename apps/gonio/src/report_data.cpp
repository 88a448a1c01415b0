#include "report_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "gonio/acquisition/trust_notes.h"
#include "gonio/basis/siblings.h"
#include "gonio/basis/uncertainty.h"
#include "gonio/devices/clock.h"
#include "gonio/quality/physics_checks.h"
#include "gonio/quality/verdict.h"
#include "provenance.h"
#include "session_calibration.h"

namespace gonio::cli {
namespace {

double begins_s(const acquisition::FrameRecord& frame) {
  return devices::to_seconds(frame.exposure_start);
}
double ends_s(const acquisition::FrameRecord& frame) {
  return begins_s(frame) + devices::to_seconds(frame.exposure);
}

/// Where the time from the beginning to the end, or to the last frame, went: what lies before a
/// frame is the way to it, or the readout of the one before.
std::vector<report::TimingEntry> timing_of(const acquisition::SessionReader& archive) {
  std::vector<double> resumed_s;
  for (const acquisition::SessionNote& note : archive.notes()) {
    if (note.kind == acquisition::kResumedNote) resumed_s.push_back(devices::to_seconds(note.at));
  }
  auto resumed = resumed_s.begin();
  double around_s = 0.0;
  double checks_s = 0.0;
  double travel_s = 0.0;
  double exposure_s = 0.0;
  double readout_s = 0.0;
  double interrupted_s = 0.0;
  double now_s = 0.0;
  int point_before = -1;
  for (const acquisition::FrameRecord& frame : archive.frames()) {
    for (; resumed != resumed_s.end() && *resumed <= begins_s(frame); ++resumed) {
      interrupted_s += std::max(0.0, *resumed - now_s);
      now_s = std::max(now_s, *resumed);
      point_before = -1;
    }
    const double before_s = std::max(0.0, begins_s(frame) - now_s);
    const double exposed_s = devices::to_seconds(frame.exposure);
    if (frame.point >= 0) {
      (frame.point == point_before ? readout_s : travel_s) += before_s;
      exposure_s += exposed_s;
    } else {
      (frame.kind == acquisition::FrameKind::sentinel ? checks_s : around_s) +=
          before_s + exposed_s;
    }
    point_before = frame.point;
    now_s = std::max(now_s, ends_s(frame));
  }
  const double parked_s =
      archive.finished() ? std::max(0.0, devices::to_seconds(*archive.finished_at()) - now_s) : 0.0;
  return {{"Homing, darks and whites", around_s},
          {"Travel, settling and home checks", travel_s},
          {"Exposures", exposure_s},
          {"Readout and bracketing", readout_s},
          {"Sentinels", checks_s},
          {"Interruptions", interrupted_s},
          {"Parking and changing the target", parked_s}};
}

/// The rows of points that count, in time: the last of each.
std::vector<acquisition::PointRecord> last_rows(const acquisition::SessionReader& archive) {
  std::vector<acquisition::PointRecord> rows = archive.points();
  std::map<int, std::size_t> last;
  for (std::size_t i = 0; i < rows.size(); ++i) last[rows[i].point] = i;
  std::size_t index = 0;
  std::erase_if(rows,
                [&](const acquisition::PointRecord& row) { return last[row.point] != index++; });
  return rows;
}

/// Sets when the point was come to and how long it took, by the frames that its last row ends.
void set_times(const acquisition::SessionReader& archive, const acquisition::PointRecord& row,
               report::MeasuredPose& pose) {
  const double finished_s = devices::to_seconds(row.finished_at);
  const auto& frames = archive.frames();
  auto first = frames.end();
  for (auto frame = frames.begin(); frame != frames.end() && begins_s(*frame) <= finished_s;
       ++frame) {
    const bool of_another = frame == frames.begin() || std::prev(frame)->point != row.point;
    if (frame->point == row.point && of_another) first = frame;
  }
  if (first == frames.end()) return;
  pose.dwell_s = std::max(0.0, finished_s - begins_s(*first));
  if (first != frames.begin()) {
    pose.travel_s = std::max(0.0, begins_s(*first) - ends_s(*std::prev(first)));
  }
}

void add_poses_and_timing(const StoredSession& session, report::ReportData& data) {
  const acquisition::SessionReader& archive = session.archive;
  for (const acquisition::PointRecord& point : last_rows(archive)) {
    report::MeasuredPose pose;
    pose.pose = point.point;
    pose.direction = point.commanded;
    if (point.joints.size() == session.instrument.rig.axes.size()) {
      brdf::DirectionPair pair =
          rig::forward(session.instrument.rig, point.joints).directions_at(Eigen::Vector3d::Zero());
      if (point.branch == 'C' || point.branch == 'D') std::swap(pair.wi, pair.wo);
      pose.direction = brdf::half_diff_from_directions(pair);
    }
    pose.branch = point.branch;
    pose.outcome = acquisition::to_string(point.outcome);
    set_times(archive, point, pose);
    data.poses.push_back(std::move(pose));
  }
  data.timing = timing_of(archive);
}

/// Least and most of the lamp monitor's readings over the first of their channel, minus 1.
std::optional<std::pair<double, double>> monitor_range(const acquisition::SessionReader& archive) {
  std::map<std::string, double> first;
  std::optional<std::pair<double, double>> range;
  for (const acquisition::FrameRecord& frame : archive.frames()) {
    if (frame.channel.empty() || !(frame.monitor > 0.0)) continue;
    const double change =
        frame.monitor / first.try_emplace(frame.channel, frame.monitor).first->second - 1.0;
    if (!range) range.emplace(0.0, 0.0);
    range->first = std::min(range->first, change);
    range->second = std::max(range->second, change);
  }
  return range;
}

report::CheckResult lamp_row(const acquisition::SessionReader& archive,
                             const acquisition::Reduction& reduction) {
  using report::CheckStatus;
  std::string text;
  if (reduction.white_drift_relative) {
    text = fmt::format(
        "closing white over opening by the monitor {:+.2f} % in the worst channel, usual within "
        "{:g} %",
        100.0 * *reduction.white_drift_relative, 100.0 * acquisition::kUsualDrift);
  } else {
    text = "there is but one white";
  }
  if (const auto range = monitor_range(archive)) {
    text += fmt::format(
        "; the monitor itself read {:+.2f} to {:+.2f} % off its first readings, which is taken out",
        100.0 * range->first, 100.0 * range->second);
  }
  const double drift = std::abs(reduction.white_drift_relative.value_or(0.0));
  return {"Lamp",
          !reduction.white_drift_relative     ? CheckStatus::not_applicable
          : drift <= acquisition::kUsualDrift ? CheckStatus::passed
                                              : CheckStatus::remark,
          text};
}

report::CheckResult sentinel_row(const acquisition::SessionReader& archive,
                                 const acquisition::Reduction& reduction) {
  using report::CheckStatus;
  const std::vector<acquisition::SentinelVisit> visits = acquisition::sentinel_visits(archive);
  if (visits.size() < 2) {
    return {"Sentinel", CheckStatus::not_applicable, "a session this short looks at none"};
  }
  double worst = 0.0;
  for (const acquisition::SentinelVisit& visit : visits) {
    for (const auto& [channel, level] : visit.reading) {
      const auto first = visits.front().reading.find(channel);
      if (first == visits.front().reading.end()) continue;
      const double change = level.level_dn_per_s / first->second.level_dn_per_s - 1.0;
      if (std::abs(change) > std::abs(worst)) worst = change;
    }
  }
  const auto count = [&archive](const char* kind) {
    return std::count_if(archive.notes().begin(), archive.notes().end(),
                         [kind](const auto& note) { return std::string_view(note.kind) == kind; });
  };
  std::vector<std::string> remarks;
  if (const auto steps = count(acquisition::kSentinelStepNote); steps > 0) {
    remarks.push_back(fmt::format("{} step(s)", steps));
  }
  if (const auto missed = count(acquisition::kNoSentinelNote); missed > 0) {
    remarks.push_back(fmt::format("{} could not be read", missed));
  }
  for (const acquisition::PartBridge& bridge : reduction.bridges) {
    if (bridge.is_refused() || bridge.is_applied()) remarks.push_back(to_text(bridge));
  }
  std::string text =
      fmt::format("{} readings of a fixed pose on the sample, at most {:+.2f} % off the first",
                  visits.size(), 100.0 * worst);
  for (const std::string& remark : remarks) text += "; " + remark;
  return {"Sentinel", remarks.empty() ? CheckStatus::passed : CheckStatus::remark, text};
}

}  // namespace

std::vector<report::CheckResult> session_checks(const acquisition::SessionReader& archive,
                                                const acquisition::Reduction& reduction) {
  using report::CheckStatus;
  const std::vector<acquisition::PairAgreement>& pairs = reduction.pairs;
  const bool agree =
      std::all_of(pairs.begin(), pairs.end(), [](const auto& pair) { return pair.agrees(); });
  std::vector<report::CheckResult> rows{lamp_row(archive, reduction),
                                        sentinel_row(archive, reduction)};
  rows.push_back({"Points measured twice",
                  pairs.empty() ? CheckStatus::not_applicable
                  : agree       ? CheckStatus::passed
                                : CheckStatus::remark,
                  pairs.empty() ? "none: --repeat-pairs and --reciprocity-pairs ask for them"
                                : to_text(pairs)});
  return rows;
}

report::ReportData session_report(const StoredSession& session) {
  const acquisition::SessionReader& archive = session.archive;
  report::ReportData data;
  data.material = metadata(archive, "sample_id");
  add_poses_and_timing(session, data);
  const auto fact = [&](const char* name, const std::string& value) {
    if (!value.empty()) data.session.push_back({name, value});
  };
  fact("Sample", metadata(archive, "sample_id"));
  fact("Operator", metadata(archive, "operator"));
  fact("Note", metadata(archive, "note"));
  fact("Rig", metadata(archive, "rig"));
  fact("Camera", metadata(archive, "camera"));
  fact("Lamp", metadata(archive, "lamp_channels"));
  fact("White reference", metadata(archive, "white_reference"));
  fact("Constants", metadata(archive, "calibration"));
  fact("Calibration", calibration_text(archive.metadata()));
  fact("Used despite", metadata(archive, "calibration_accepted_despite"));
  if (metadata(archive, "driver") == "simulated") {
    fact("Data", "simulated rig; material " + metadata(archive, "simulated_material") + ", seed " +
                     metadata(archive, "seed"));
  }
  data.provenance = {{"Software", "gonio " + version_text()},
                     {"Session recorded by",
                      metadata(archive, "software") + " (" + metadata(archive, "revision") + ")"},
                     {"Session started (UTC)", metadata(archive, "provenance_started_utc")},
                     {"Calibration SHA-256", metadata(archive, "calibration_sha256")},
                     {"Plan SHA-256", metadata(archive, "plan_sha256")}};
  for (const std::string& damage : archive.damage()) data.warnings.push_back("Archive: " + damage);
  if (!archive.finished()) data.warnings.emplace_back("The session was interrupted.");
  if (const auto suspects = acquisition::suspect_points(archive); !suspects.empty()) {
    data.warnings.push_back(fmt::format("{} of {} points are suspect by the session's own checks.",
                                        suspects.size(), data.poses.size()));
  }
  for (const acquisition::SessionNote& note : archive.notes()) {
    if (note.kind == "warning" || note.kind == acquisition::kNoSentinelNote) {
      data.warnings.push_back(note.text);
    }
    if (note.kind == acquisition::kSuspectNote) {
      data.warnings.push_back("Suspect at " +
                              fmt::format("{:.0f} s, ", devices::to_seconds(note.at)) + note.text);
    }
    const bool larger = note.text.find("more than the usual") != std::string::npos;
    if (note.kind == acquisition::kHomeDeltaNote && larger) {
      data.warnings.push_back("Home delta: " + note.text);
    }
  }
  return data;
}

std::vector<report::FittedSample> fitted_samples(const samples::SampleSet& samples,
                                                 const basis::Fit& fit) {
  std::vector<report::FittedSample> fitted;
  for (std::size_t i = 0; i < samples.samples.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    fitted.push_back({samples.samples[i], fit.fitted_per_sr.row(row).transpose().array(),
                      fit.standardised.row(row).transpose().array()});
  }
  return fitted;
}

std::vector<report::FittedSample> fitted_samples(const samples::SampleSet& samples,
                                                 const brdf::BrdfTable& table) {
  const brdf::TableBrdf model(table);
  std::vector<report::FittedSample> fitted;
  for (const samples::Sample& sample : samples.samples) {
    report::FittedSample each;
    each.sample = sample;
    each.fitted_per_sr = model.evaluate(sample.direction);
    const brdf::Rgb variance = sample.sigma_per_sr.square() + sample.u_common_per_sr.square();
    each.standardised = (variance > 0.0)
                            .select((sample.value_per_sr - each.fitted_per_sr) / variance.sqrt(),
                                    brdf::Rgb::Constant(std::numeric_limits<double>::quiet_NaN()));
    fitted.push_back(std::move(each));
  }
  return fitted;
}

std::string to_text(const quality::HomogeneityCheck& check) {
  return fmt::format(
      "values differ by {:.1f} % rms between places of the sample in all {} poses alike; an even "
      "one shows as much by chance in {:.1f} % of cases",
      100.0 * check.rms, check.poses, 100.0 * check.p_value);
}

report::CheckResult evenness(const samples::SampleSet& samples, const basis::Fit& fit) {
  using report::CheckStatus;
  const quality::HomogeneityCheck check = quality::check_homogeneity(samples, fit.fitted_per_sr);
  if (!check.applicable) {
    return {"Even sample", CheckStatus::not_applicable,
            "needs eight poses with several places of the sample each"};
  }
  return {"Even sample", check.passed ? CheckStatus::passed : CheckStatus::remark, to_text(check)};
}

void add_trust(const basis::Basis& basis, const samples::SampleSet& samples, const basis::Fit& fit,
               report::MethodResult& method, report::ReportData& data) {
  std::optional<basis::Uncertainty> bands;
  if (fit.left_out_residuals.size() > 0 &&
      basis::count_groups(basis.materials) >= basis::kFewestGroupsForBands) {
    bands = basis::uncertainty(basis, fit);
    const double factor = bands->factor_95;
    method.lower_95 = std::make_shared<brdf::BrdfTable>(basis::limit(basis, fit, *bands, -factor));
    method.upper_95 = std::make_shared<brdf::BrdfTable>(basis::limit(basis, fit, *bands, factor));
  }
  const quality::Verdict verdict =
      quality::judge(basis, samples, fit, *method.table, bands ? &*bands : nullptr);
  data.verdict = verdict.line;
  data.trusted = verdict.trusted;
}

std::vector<report::CheckResult> self_checks(const brdf::BrdfTable& table, const basis::Fit* fit) {
  using report::CheckStatus;
  std::vector<report::CheckResult> checks;
  const quality::EnergyCheck energy =
      quality::check_energy(brdf::TableBrdf(table), table.scale(), quality::kEnergyTolerance);
  if (energy.applicable) {
    checks.push_back({"Energy", energy.passed ? CheckStatus::passed : CheckStatus::failed,
                      fmt::format("reflects at most {:.1f} % of the light that falls in",
                                  100.0 * energy.largest)});
  } else {
    checks.push_back(
        {"Energy", CheckStatus::not_applicable, "no absolute scale, so no limit to compare with"});
  }
  if (fit != nullptr) {
    const double innovation = fit->innovation_chi2_per_sample;
    checks.push_back(
        {"Like the training materials",
         innovation <= quality::kInnovationLimit ? CheckStatus::passed : CheckStatus::remark,
         fmt::format("chi2 of the samples against the prior {:.2f} per value (about 1 "
                     "for a material like those trained on)",
                     innovation)});
    checks.push_back({"Samples explained",
                      fit->chi2_per_sample <= 3.0 ? CheckStatus::passed : CheckStatus::remark,
                      fmt::format("chi2 of what the fit leaves of its own samples {:.2f} per "
                                  "value: below 1 for a fit, which follows them; above 3 it cannot",
                                  fit->chi2_per_sample)});
  }
  const std::size_t clamped = quality::clamped_cells(table);
  const std::size_t cells = brdf::lattice::cells_above_horizon(table.convention()).size();
  const double share = static_cast<double>(clamped) / static_cast<double>(cells);
  checks.push_back({"Never negative",
                    share <= quality::kClampedLimit ? CheckStatus::passed : CheckStatus::remark,
                    fmt::format("{:.2f} % of the directions were clamped at zero", 100.0 * share)});
  return checks;
}

}  // namespace gonio::cli
