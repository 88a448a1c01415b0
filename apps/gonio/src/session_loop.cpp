#include "session_loop.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <set>

#include "gonio/acquisition/resume.h"
#include "gonio/devices/clock.h"
#include "gonio/errors/errors.h"
#include "patch_geometry.h"
#include "planning.h"

namespace gonio::cli {
namespace {

using acquisition::AddedPoint;
using acquisition::Decision;
using acquisition::LoggedDecision;
using acquisition::PointOutcome;
using acquisition::SessionReader;
using acquisition::SessionSoFar;

constexpr double kGridStep_deg = 5.0;
/// Of a value where nothing was measured yet, by a fit of the points so far, as a logarithm.
constexpr double kFitPoint = 0.2;
/// Points that do not fit are looked after so many times: more of them are no outliers.
constexpr std::size_t kMostChecks = 3;

design::PoseCandidates candidates_of(const rig::Inverse& inverse) {
  design::PoseCandidates candidates;
  candidates.allowed = [&inverse](const brdf::HalfDiff& pose) {
    return inverse.maybe_reachable(pose);
  };
  if (!inverse.closed_form()) {
    candidates.accept = [&inverse](const brdf::HalfDiff& pose) {
      return !inverse.solve(pose).poses.empty();
    };
  }
  candidates.poses = design::pose_grid(kGridStep_deg, candidates.allowed);
  return candidates;
}

}  // namespace

/// What a decision follows from.
struct SessionLoop::Known {
  const SessionSoFar& now;
  const SessionReader& archive;
  std::vector<LoggedDecision> log;
  std::vector<brdf::HalfDiff> measured;
  std::vector<brdf::HalfDiff> kept;       ///< measured and left
  std::vector<brdf::HalfDiff> not_to_be;  ///< of points that could not be measured
  std::set<int> replaced;
  std::set<int> checked;
  std::size_t planned = 0;  ///< points before the first that was added

  Known(const SessionSoFar& so_far, const SessionReader& reader)
      : now(so_far), archive(reader), log(acquisition::decisions(reader)) {
    std::size_t added_count = 0;
    for (const LoggedDecision& each : log) {
      for (const AddedPoint& added : each.decision.added) {
        if (added.replaces) replaced.insert(*added.replaces);
        if (added.checks) checked.insert(*added.checks);
        ++added_count;
      }
    }
    planned = now.plan.points.size() - std::min(added_count, now.plan.points.size());
    for (const auto& [point, outcome] : now.done) {
      const brdf::HalfDiff& direction = direction_of(point);
      if (outcome == PointOutcome::Measured) {
        measured.push_back(direction);
      } else {
        not_to_be.push_back(direction);
      }
    }
    kept = measured;
    for (const int point : now.left) kept.push_back(direction_of(point));
  }

  const brdf::HalfDiff& direction_of(int point) const {
    return now.plan.points.at(static_cast<std::size_t>(point)).direction;
  }
  /// Whether this was said since the last point.
  bool is_said() const {
    return !log.empty() && log.back().decision.kind == Decision::Kind::remark &&
           (archive.points().empty() || log.back().at >= archive.points().back().finished_at);
  }
};

SessionLoop::SessionLoop(LoopSettings settings, const instrument::Instrument& instrument,
                         const RigFile& rig, std::filesystem::path archive,
                         brdf::RadiometricScale scale, const Console* console)
    : settings_(std::move(settings)),
      instrument_(instrument),
      rig_(rig),
      archive_(std::move(archive)),
      scale_(scale),
      console_(console),
      inverse_(instrument.rig, rig.branches),
      next_(*settings_.basis, candidates_of(inverse_), patch_of({rig, instrument}), [&] {
        const KnownRig known{rig, instrument};
        return planned_noise(&known);
      }()) {}

std::optional<Decision> SessionLoop::decide(const SessionSoFar& now) {
  // An archive of thousands of points is not read after each of them for nothing.
  const bool all_measured = std::ranges::all_of(
      now.done, [](const auto& point) { return point.second == PointOutcome::Measured; });
  if (!settings_.until_db && !now.left.empty() && all_measured) return std::nullopt;
  std::optional<Decision> decision = decide(now, SessionReader(archive_));
  if (decision && console_ != nullptr) {
    if (decision->kind == Decision::Kind::remark) {
      console_->warn(decision->reason);
    } else {
      console_->say(decision->reason);
    }
  }
  return decision;
}

std::optional<Decision> SessionLoop::decide(const SessionSoFar& now,
                                            const SessionReader& archive) const {
  const Known known(now, archive);
  if (Answer replaced = replacement(known)) return replaced;
  if (!settings_.until_db && !now.left.empty()) return std::nullopt;
  return judged(known);
}

/// For the first point that could not be measured and has no replacement yet.
SessionLoop::Answer SessionLoop::replacement(const Known& known) const {
  // Where so much fails it is no matter of the directions.
  if (known.replaced.size() >= known.planned) return std::nullopt;
  for (const auto& [point, outcome] : known.now.done) {
    if (outcome == PointOutcome::Measured || known.replaced.contains(point)) continue;
    AddedPoint added;
    added.replaces = point;
    if (Answer found = one_more(
            known, known.kept, added,
            fmt::format("point {} ({}) ended as {}: ", point, to_text(known.direction_of(point)),
                        acquisition::to_string(outcome)),
            std::nullopt)) {
      return found;
    }
  }
  return std::nullopt;
}

/// By what a fit of all samples so far foresees.
SessionLoop::Answer SessionLoop::judged(const Known& known) const {
  if (known.measured.size() < static_cast<std::size_t>(quality::kFewestJudged)) return std::nullopt;
  if (known.is_said()) return std::nullopt;
  const std::optional<quality::Prospect> seen = look(known.archive);
  if (!seen) return std::nullopt;
  if (known.now.left.empty()) {
    if (Answer check = check_of_outlier(known, *seen)) return check;
  }
  if (settings_.until_db) return towards_wish(known, seen);
  const auto most = static_cast<std::size_t>(settings_.max_points);
  if (!seen->doubtful || known.kept.size() >= most) return std::nullopt;
  return one_more(known, known.kept, {},
                  quality::doubt_text(seen->outlook) +
                      fmt::format("; a picture of it is expected at {:.1f} dB: ",
                                  seen->outlook.expected_psnr_db),
                  seen->outlook.expected_psnr_db);
}

SessionLoop::Answer SessionLoop::check_of_outlier(const Known& known,
                                                  const quality::Prospect& seen) const {
  if (known.checked.size() >= kMostChecks) return std::nullopt;
  for (const int point : seen.outliers) {
    if (known.checked.contains(point) || !known.now.done.contains(point)) continue;
    // Next to it, where it tells nothing for as long as nobody believes it.
    std::vector<brdf::HalfDiff> others;
    const brdf::HalfDiff& doubted = known.direction_of(point);
    for (const brdf::HalfDiff& each : known.kept) {
      if (design::pose_distance(each, doubted) > Angle()) others.push_back(each);
    }
    AddedPoint added;
    added.checks = point;
    return one_more(known, others, added,
                    fmt::format("point {} ({}) does not fit the others: ", point, to_text(doubted)),
                    seen.outlook.expected_psnr_db);
  }
  return std::nullopt;
}

SessionLoop::Answer SessionLoop::towards_wish(const Known& known,
                                              const std::optional<quality::Prospect>& seen) const {
  const double wanted_db = *settings_.until_db;
  const double expected_db = seen->outlook.expected_psnr_db;
  const std::size_t measured = known.measured.size();
  Decision decision;
  decision.expected_psnr_db = expected_db;
  if (seen->reaches(wanted_db)) {
    decision.kind = Decision::Kind::enough;
    decision.dropped = known.now.left;
    decision.reason = fmt::format(
        "enough after {} points: a picture of it is expected at {:.1f} dB, {:g} dB and a margin of "
        "{:g} dB were asked for{}",
        measured, expected_db, wanted_db, quality::kStopMargin_db,
        decision.dropped.empty() ? "" : fmt::format("; {} left out", decision.dropped.size()));
    return decision;
  }
  if (!known.now.left.empty()) return std::nullopt;
  const int more = settings_.max_points - static_cast<int>(measured);
  if (more > 0) {
    return one_more(known, known.kept, {},
                    fmt::format("a picture of it is expected at {:.1f} dB after {} points, {:g} dB "
                                "are asked for: ",
                                expected_db, measured, wanted_db),
                    expected_db);
  }
  decision.kind = Decision::Kind::remark;
  decision.reason = fmt::format(
      "{:g} dB are not reached: a picture of it is expected at {:.1f} dB after {} points, the most "
      "allowed (a margin of {:g} dB is kept); {}",
      wanted_db, expected_db, measured, quality::kStopMargin_db,
      // What the training materials gain by more points says nothing of one that is unlike them.
      seen->doubtful
          ? quality::doubt_text(seen->outlook) + ": what more points would add is not known"
          : fmt::format("of the training materials as many again would better the usual one by "
                        "{:.1f} dB",
                        next_.gain_db(known.kept, static_cast<int>(measured))));
  return decision;
}

/// The best pose beside `kept` that can be stood in, as a decision.
SessionLoop::Answer SessionLoop::one_more(const Known& known,
                                          const std::vector<brdf::HalfDiff>& kept, AddedPoint added,
                                          std::string reason,
                                          std::optional<double> expected_psnr_db) const {
  std::vector<brdf::HalfDiff> avoid = known.not_to_be;
  constexpr int kTries = 10;  // keep-outs may bar the way to what the rig could reach
  for (int i = 0; i < kTries; ++i) {
    const std::optional<brdf::HalfDiff> direction = next_.next(kept, avoid);
    if (!direction) break;
    for (const rig::PoseSolution& pose : inverse_.solve(*direction).poses) {
      if (!known.now.refusal({*direction, pose, 0.0, 0.0}).empty()) continue;
      added.point = static_cast<int>(known.now.plan.points.size());
      added.direction = *direction;
      added.pose = pose;
      Decision decision;
      decision.reason =
          fmt::format("{}point {} ({}) is added", reason, added.point, to_text(*direction));
      decision.added = {added};
      decision.expected_psnr_db = expected_psnr_db;
      return decision;
    }
    avoid.push_back(*direction);
  }
  return std::nullopt;
}

std::optional<quality::Prospect> SessionLoop::look(const SessionReader& archive) const {
  // A session that cannot be judged goes on as it was planned: it must not end by its judge, which
  // would end its resumption as well.
  try {
    acquisition::Reduction reduced = acquisition::reduce(archive, instrument_, rig_.reduction);
    reduced.samples.scale = scale_;
    std::optional<quality::Prospect> seen = quality::prospect(*settings_.basis, reduced.samples);
    if (seen) {
      coefficients_ = seen->coefficients;
      expected_psnr_db_ = seen->outlook.expected_psnr_db;
    }
    return seen;
  } catch (const DataFormatError&) {
    return std::nullopt;
  } catch (const NumericalError&) {
    return std::nullopt;
  }
}

std::optional<acquisition::ExpectedSample> SessionLoop::expected() const {
  if (coefficients_.size() == 0) return std::nullopt;
  acquisition::ExpectedSample sample;
  sample.brdf = [basis = settings_.basis, coefficients = coefficients_](
                    std::size_t, const brdf::DirectionPair& pair) -> brdf::Rgb {
    const basis::BasisRow row = basis::BasisRows(*basis).at(brdf::half_diff_from_directions(pair));
    brdf::Rgb value;
    for (int colour = 0; colour < 3; ++colour) {
      value[colour] = std::max(
          0.0, basis->mapping.inverse(row.mean + row.q.dot(coefficients.col(colour)), row.weight));
    }
    return value;
  };
  sample.point_sigma_ln = kFitPoint;
  sample.source = "the fit so far";
  return sample;
}

std::vector<std::string> replay_decisions(const SessionLoop& loop, const SessionReader& archive,
                                          const rig::RigDescription& rig,
                                          const acquisition::MeasurementPlan& planned) {
  std::vector<std::string> differences;
  for (std::size_t i = 0; i < archive.notes().size(); ++i) {
    const acquisition::SessionNote& note = archive.notes()[i];
    if (note.kind != acquisition::kDecisionNote) continue;
    const SessionReader before = archive.before_note(i);
    const acquisition::ResumeState state = acquisition::resume_state(before);
    acquisition::SessionPart part = acquisition::part_to_resume(state);
    acquisition::MeasurementPlan plan = planned;
    for (const LoggedDecision& each : state.decisions) {
      acquisition::add_points(each.decision, plan);
    }
    // A point that failed is done until a session is resumed.
    std::map<int, PointOutcome> last;
    for (const acquisition::PointRecord& point : before.points()) last[point.point] = point.outcome;
    for (const auto& [point, outcome] : last) {
      if (outcome != PointOutcome::Measured) part.done[point] = outcome;
    }
    const std::set<int> of_plan = acquisition::points_left(part, plan.points.size());
    const std::vector<int> left(of_plan.begin(), of_plan.end());
    const auto refusal = [&](const acquisition::PlannedPoint& point) {
      return acquisition::why_not_behind(rig, plan, point);
    };
    const std::optional<Decision> again = loop.decide({plan, part.done, left, refusal}, before);
    const std::string found = again ? acquisition::decision_text(*again) : "nothing";
    if (found == note.text) continue;
    differences.push_back(fmt::format("{:.1f} s: logged {}, recomputed {}",
                                      devices::to_seconds(note.at), note.text, found));
  }
  return differences;
}

}  // namespace gonio::cli
