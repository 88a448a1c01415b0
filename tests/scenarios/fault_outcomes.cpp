#include "fault_outcomes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "gonio/acquisition/session_archive.h"
#include "gonio/acquisition/trust_notes.h"
#include "gonio/devices/device_error.h"
#include "gonio/errors/errors.h"

namespace gonio {

using acquisition::PointOutcome;
using acquisition::Reduction;
using acquisition::SessionReader;

bool is_beginning(const acquisition::SessionProgress& now, const std::string& phase) {
  return now.phase == phase && (phase != "point" || now.done == kStruckPoint);
}

FirstPart first_part(const std::function<acquisition::SessionResult()>& run,
                     const std::function<std::chrono::nanoseconds()>& now) {
  FirstPart part;
  try {
    part.result = run();
  } catch (const devices::DeviceError& error) {
    part.ended = true;
    part.error = error.what();
  } catch (const FileError& error) {
    part.ended = true;
    part.error = error.what();
  }
  part.at = now();
  return part;
}

std::vector<acquisition::SessionNote> SessionUnderFault::notes(const std::string& kind) const {
  std::vector<acquisition::SessionNote> found;
  const SessionReader archive(session);
  for (const acquisition::SessionNote& note : archive.notes()) {
    if (note.kind == kind) found.push_back(note);
  }
  return found;
}

void SessionUnderFault::expect_in_time(const FirstPart& part,
                                       std::chrono::nanoseconds outcome) const {
  if (cell.within_s == 0.0 || !part.struck) return;
  EXPECT_LE(devices::to_seconds(outcome - *part.struck), cell.within_s * time_scale)
      << "took too long";
}

void SessionUnderFault::expect_first_note_in_time(const FirstPart& part,
                                                  const std::string& kind) const {
  const auto found = notes(kind);
  ASSERT_FALSE(found.empty()) << "expected a note: " << kind;
  expect_in_time(part, found.front().at);
}

void SessionUnderFault::expect_outcome(const FirstPart& part) const {
  const std::string& outcome = cell.outcome;
  if (outcome == "ended") {
    EXPECT_TRUE(part.ended) << "went on";
    EXPECT_FALSE(part.error.empty());
    expect_in_time(part, part.at);
    if (cell.row != "disk") {
      EXPECT_THAT(notes("device error"), testing::SizeIs(1));
    }
    return;
  }
  EXPECT_FALSE(part.ended) << part.error;
  if (outcome == "paused" || outcome == "stopped") {
    EXPECT_FALSE(part.result.finished);
    EXPECT_THAT(notes(outcome), testing::SizeIs(1));
    expect_in_time(part, part.at);
    return;
  }
  if (outcome == "flagged") {
    EXPECT_TRUE(part.result.finished);
    const bool one_point = cell.phase == "point";
    EXPECT_EQ(part.result.complete, !one_point);
    EXPECT_FALSE(reduced().warnings.empty()) << "nothing is said";
    return;
  }
  EXPECT_TRUE(part.result.finished);
  EXPECT_TRUE(part.result.complete);
  if (outcome == "retried") {
    expect_first_note_in_time(part, "retry");
  } else if (outcome == "redone") {
    expect_first_note_in_time(part, acquisition::kCameBackNote);
  } else if (outcome == "taken again") {
    const SessionReader archive(session);
    EXPECT_EQ(archive.points().size(), points + 1);
    const auto failed =
        std::find_if(archive.points().begin(), archive.points().end(),
                     [](const auto& p) { return p.outcome == PointOutcome::Failed; });
    ASSERT_NE(failed, archive.points().end());
    EXPECT_EQ(failed->point, kStruckPoint);
    expect_in_time(part, failed->finished_at);
  } else if (outcome == "suspect") {
    expect_first_note_in_time(part, acquisition::kSuspectNote);
    EXPECT_GT(SessionReader(session).points().size(), points) << "none taken again";
  } else {
    EXPECT_THAT(outcome, testing::AnyOf("harmless", "bridged", "complete"));
    EXPECT_EQ(SessionReader(session).points().size(), points);
  }
}

void SessionUnderFault::expect_good_samples(const Reduction& wanted_samples,
                                            double same_within) const {
  const Reduction found = reduced();
  std::map<std::pair<int, int>, const samples::Sample*> by_place;
  std::set<int> flagged;
  for (const samples::Sample& sample : found.samples.samples) {
    by_place[{sample.pose, sample.spot}] = &sample;
    if (sample.flags.find("suspect") != std::string::npos) flagged.insert(sample.pose);
  }
  std::map<int, std::pair<double, double>> sums;
  for (const samples::Sample& wanted : wanted_samples.samples.samples) {
    const auto place = by_place.find({wanted.pose, wanted.spot});
    if (place == by_place.end()) {
      EXPECT_TRUE(cell.outcome == "flagged" && wanted.pose == kStruckPoint)
          << "a sample of point " << wanted.pose << " is missing";
      continue;
    }
    auto& [before, after] = sums[wanted.pose];
    before += wanted.value_per_sr.sum();
    after += place->second->value_per_sr.sum();
    if (flagged.contains(wanted.pose)) continue;
    for (int colour = 0; colour < 3; ++colour) {
      constexpr double kSigmas = 5.0;
      EXPECT_NEAR(
          place->second->value_per_sr[colour], wanted.value_per_sr[colour],
          kSigmas * std::hypot(place->second->sigma_per_sr[colour], wanted.sigma_per_sr[colour]) +
              place->second->u_common_per_sr[colour])
          << "point " << wanted.pose << ", spot " << wanted.spot << ", colour " << colour;
    }
  }
  for (const auto& [point, sum] : sums) {
    if (flagged.contains(point) || cell.outcome == "flagged") continue;
    EXPECT_NEAR(sum.second / sum.first, 1.0, same_within) << "point " << point;
  }
}

}  // namespace gonio
