// Sweep B: with lamp drift and warm-up, homing and positioning scatter on, sessions that were
// killed and resumed agree with an uninterrupted one of other noise within their uncertainty.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "recorded_disk.h"
#include "steady_session.h"

namespace gonio {
namespace {

/// The nominal world's errors. No fixed pattern: it is in a sample's sigma and the same in two
/// sessions of one sensor.
sim::SimOptions drifting_world() {
  const sim::SimOptions nominal = sim::nominal_options(brdf::builtin_materials().front().model, 7);
  sim::SimOptions world = steady_world();
  world.lamp = nominal.lamp;
  world.axes = nominal.axes;
  world.camera.prnu = 0.0;
  world.camera.dsnu_e = 0.0;
  world.same_noise_again = false;
  return world;
}

class DriftingKills : public SteadySession {
 protected:
  DriftingKills() {
    world_ = drifting_world();
    known_ = nominal_instrument(world_);
    // What is left of the whites' noise moves all samples of a session together.
    options_.white_frames = 16;
    outage_ = std::chrono::minutes(10);
  }

  /// Killed at a random write, sync or rename after the first point, and resumed.
  samples::SampleSet killed_and_resumed(std::uint64_t seed) {
    world_.noise_seed = seed;
    const TemporaryFolder folder;
    const std::filesystem::path whole = folder.path() / "whole";
    const std::filesystem::path cut = folder.path() / "cut";
    {
      RecordedDisk disk(whole);
      std::size_t first = 0;
      std::size_t last = 0;
      begin(whole, [&](const acquisition::SessionProgress& now) {
        if (now.done == 1) first = disk.count();
        if (now.phase == "point") last = disk.count();
      });
      std::mt19937_64 random(seed);
      disk.restore(first + random() % (last - first), RecordedDisk::Loss::unsynced, seed, cut);
    }
    EXPECT_TRUE(resume(cut).complete);
    return reduced(cut).samples;
  }
};

TEST_F(DriftingKills, AgreeWithTheUninterruptedSessionWithinTheirUncertainty) {
  constexpr std::uint64_t kSessions = 8;
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  world_.noise_seed = 100;
  begin(whole);
  const samples::SampleSet wanted = reduced(whole).samples;
  double sum = 0.0;
  double squares = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= kSessions; ++seed) {
    const samples::SampleSet found = killed_and_resumed(seed);
    ASSERT_EQ(found.samples.size(), wanted.samples.size());
    for (std::size_t i = 0; i < wanted.samples.size(); ++i) {
      const samples::Sample& a = wanted.samples[i];
      const samples::Sample& b = found.samples[i];
      ASSERT_EQ(a.pose, b.pose);
      for (int c = 0; c < 3; ++c) {
        const double z = (b.value_per_sr[c] - a.value_per_sr[c]) /
                         std::hypot(a.sigma_per_sr[c], b.sigma_per_sr[c]);
        sum += z;
        squares += z * z;
        ++count;
      }
    }
  }
  RecordProperty("mean_z", std::to_string(sum / count));
  RecordProperty("chi2_per_dof", std::to_string(squares / count));
  std::printf("%d values: mean z %.3f, chi^2/dof %.3f\n", count, sum / count, squares / count);
  EXPECT_GT(squares / count, 0.8);
  EXPECT_LT(squares / count, 1.25);
}

}  // namespace
}  // namespace gonio
