// A long session on a rig that is only as noisy as rigs are: no check may find anything.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gonio/acquisition/trust_notes.h"
#include "steady_session.h"

namespace gonio {
namespace {

class CleanSession : public SteadySession {
 protected:
  CleanSession() {
    take_nominal_errors(world_);
    // As many checks as eight hours have by their time, and more by their points.
    constexpr int kRounds = 20;
    std::vector<std::array<double, 3>> directions;
    for (int round = 0; round < kRounds; ++round) {
      for (std::array<double, 3> direction : kTwelveDirections) {
        direction[0] += 0.01 * round;  // no direction may stand twice in a plan
        directions.push_back(direction);
      }
    }
    plan_ = plan_of(known_, directions);
    options_.sentinel_every = 4;
  }
};

TEST_F(CleanSession, SuspectsNothing) {
  const TemporaryFolder folder;
  const std::filesystem::path session = folder.path() / "session";
  EXPECT_TRUE(begin(session).complete);
  const acquisition::SessionReader archive(session);
  const auto visits = acquisition::sentinel_visits(archive);
  EXPECT_GE(visits.size(), 60U);
  double worst = 0.0;  // of what makes a step, 1
  for (std::size_t i = 1; i < visits.size(); ++i) {
    for (const auto& [channel, level] : visits[i].reading) {
      const acquisition::SentinelChange change = acquisition::sentinel_change(
          visits[i - 1].reading.at(channel), level, known_.u_lamp_relative);
      worst = std::max(worst, std::abs(change.relative) / change.u);
    }
  }
  std::printf("%zu sentinels, largest change %.2f u\n", visits.size(), worst);
  for (const acquisition::SessionNote& note : archive.notes()) {
    EXPECT_NE(note.kind, acquisition::kSuspectNote) << note.text;
    if (note.kind == acquisition::kHomeDeltaNote) {
      EXPECT_THAT(note.text, testing::Not(testing::HasSubstr("more than the usual")));
    }
  }
}

}  // namespace
}  // namespace gonio
