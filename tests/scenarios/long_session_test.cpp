// Eight hours of a session's time and five thousand points: what a process holds does not grow.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <vector>

#include "steady_session.h"

namespace gonio {
namespace {

constexpr int kPoints = 5000;
constexpr double kEightHours_s = 8.0 * 3600.0;
/// A little more than eight hours.
constexpr double kDimmer = 63.0;
constexpr double kFlat = 0.05;
constexpr int kLooks = 20;

/// What this process holds in memory that no file backs, MB (proc(5), /proc/pid/statm, pages:
/// second field less third). Pages of the program come in when they are first used: that is no
/// growth.
double held_mb() {
  std::ifstream statm("/proc/self/statm");
  double size = 0.0;
  double resident = 0.0;
  double of_files = 0.0;
  statm >> size >> resident >> of_files;
  return (resident - of_files) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

std::ptrdiff_t open_descriptors() {
  const std::filesystem::directory_iterator begin("/proc/self/fd");
  return std::distance(begin, std::filesystem::directory_iterator());
}

class LongSession : public SteadySession {
 protected:
  LongSession() {
    take_nominal_errors(world_);  // checks have something to look at
    // The simulator keeps a number for each second of a lamp that drifts, and channel: not the
    // session's.
    world_.lamp.drift_sigma = 0.0;
    world_.camera.height_px = 64;
    world_.camera.cy_px = 31.5;
    known_ = nominal_instrument(world_);
    // So dim that exposures take seconds.
    for (sim::LampChannelOptions& channel : world_.lamp.channels) {
      for (double& band : channel.intensity_w_per_sr) band /= kDimmer;
    }
    std::vector<std::array<double, 3>> directions;
    for (int i = 0; i < kPoints; ++i) {
      std::array<double, 3> direction = kTwelveDirections[static_cast<std::size_t>(i) % 12];
      direction[0] += 0.002 * (i / 12);  // no direction may stand twice in a plan
      directions.push_back(direction);
    }
    plan_ = plan_of(known_, directions);
  }
};

TEST_F(LongSession, HoldsNoMoreMemoryAndFilesInTheEndThanInTheBeginning) {
  const TemporaryFolder folder;
  struct Look {
    double memory_mb = 0.0;
    std::ptrdiff_t descriptors = 0;
  };
  std::map<int, Look> looks;  // by points done
  const acquisition::SessionResult result =
      begin(folder.path() / "session", [&](const acquisition::SessionProgress& now) {
        if (now.done % (kPoints / kLooks) != 0 || looks.contains(now.done)) return;
        const Look& look = looks[now.done] = {held_mb(), open_descriptors()};
        std::printf("%4d points, %5.2f h: %.2f MB, %td descriptors\n", now.done,
                    now.elapsed_s / 3600.0, look.memory_mb, look.descriptors);
      });
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.measured, kPoints);
  EXPECT_GE(result.duration_s, kEightHours_s);
  ASSERT_EQ(looks.size(), kLooks + 1U);
  // Before the first point not everything has been used yet.
  looks.erase(0);
  const Look first = looks.begin()->second;
  for (const auto& [points, look] : looks) {
    EXPECT_NEAR(look.memory_mb, first.memory_mb, kFlat * first.memory_mb) << points << " points";
    EXPECT_EQ(look.descriptors, first.descriptors) << points << " points";
  }
}

}  // namespace
}  // namespace gonio
