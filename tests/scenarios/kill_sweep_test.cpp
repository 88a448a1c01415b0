// Sweep A: with drift and homing scatter off, a session that was killed at any write, sync or
// rename, cut off by a power failure there, or failed there on a full or broken disk, and then
// resumed, gives the samples of the uninterrupted one to the byte. GONIO_KILL_SWEEP=all takes every
// moment instead of a sample of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <optional>
#include <set>

#include "gonio/acquisition/resume.h"
#include "gonio/brdf/builtin_materials.h"
#include "gonio/errors/errors.h"
#include "gonio/files/text_file.h"
#include "recorded_disk.h"
#include "simulated_session.h"
#include "temporary_folder.h"

namespace gonio {
namespace {

using acquisition::ResumeState;
using acquisition::SessionReader;
using acquisition::SessionResult;
using acquisition::SessionWriter;
using Progress = std::function<void(const acquisition::SessionProgress&)>;

const std::vector<std::array<double, 3>> kTwelveDirections{
    {3.0, 12.0, 28.0},  {39.0, 60.0, 89.0},  {15.0, 30.0, 130.0}, {2.0, 60.0, 180.0},
    {20.0, 20.0, 60.0}, {5.0, 20.0, 40.0},   {10.0, 25.0, 90.0},  {8.0, 40.0, 100.0},
    {25.0, 30.0, 70.0}, {30.0, 45.0, 110.0}, {12.0, 35.0, 20.0},  {18.0, 35.0, 150.0}};

constexpr std::chrono::seconds kOutage{100};

using Loss = RecordedDisk::Loss;
constexpr std::array<Loss, 4> kLosses{Loss::nothing, Loss::unsynced, Loss::at_random,
                                      Loss::half_write};

/// A world of 64 x 52 px in which only noise is random. Without play: from which side an axis took
/// it up at its home is not known.
sim::SimOptions steady_world() {
  sim::SimOptions world = sim::nominal_options(brdf::builtin_materials().front().model, 7);
  constexpr double kCoarser = 5.0;
  sim::CameraOptions& camera = world.camera;
  camera.width_px = 64;
  camera.height_px = 52;
  camera.fx_px /= kCoarser;
  camera.fy_px /= kCoarser;
  camera.cx_px = 31.5;
  camera.cy_px = 25.5;
  world.lamp.drift_sigma = 0.0;
  world.lamp.warm_up_amplitude = 0.0;
  world.same_noise_again = true;
  sim::AxisOptions axis;
  axis.homing_sigma = Angle();
  axis.positioning_sigma = Angle();
  world.axes.assign(world.rig.axes.size(), axis);
  return world;
}

class KillSweep : public testing::Test {
 protected:
  KillSweep() {
    options_.white_frames = 1;
    options_.dark_frames = 2;
    options_.relative_sigma = 0.02;
    options_.spot_half_width_mm = 4.0;
    reduction_.spot_half_width_mm = 4.0;
    reduction_.grid = 3;
  }

  acquisition::DeviceSet devices(sim::SimGoniometer& world) const {
    acquisition::DeviceSet set = devices_of(world);
    set.begin_subject = [&world](std::uint64_t subject) { world.begin_subject(subject); };
    return set;
  }

  /// Runs it, and looks at the rig after whatever end.
  SessionResult run(sim::SimGoniometer& world, SessionWriter& archive, const Progress& progress,
                    const acquisition::SessionPart& part = {}) const {
    struct Safe {
      sim::SimGoniometer& world;
      ~Safe() {
        for (std::size_t i = 0; i < world.axis_count(); ++i) {
          EXPECT_THROW(world.stage(i).begin_move_to(Angle()), devices::DeviceError)
              << "axis " << i << " was not stopped";
        }
        constexpr double kDark = 0.1;  // of a lit channel's reading
        EXPECT_LT(world.lamp_monitor().read(), kDark) << "the shutter is open";
      }
    };
    const Safe safe{world};
    return acquisition::run_session(devices(world), known_, plan_, options_, archive, progress, {},
                                    part);
  }

  SessionResult begin(const std::filesystem::path& folder, const Progress& progress = {}) const {
    sim::SimGoniometer world(steady_world());
    SessionWriter archive(folder, {{"sample_id", "plate"}}, {});
    return run(world, archive, progress);
  }

  SessionResult resume(const std::filesystem::path& folder, const Progress& progress = {}) const {
    files::ProcessLock lock(acquisition::session_lock(folder));
    const ResumeState state = acquisition::resume_state(SessionReader(folder));
    sim::SimOptions later = steady_world();
    later.begins_at = state.may_begin_at + kOutage;
    later.power_ups = static_cast<std::uint64_t>(state.parts);
    sim::SimGoniometer world(later);
    SessionWriter archive = SessionWriter::resume(folder, std::move(lock), later.begins_at,
                                                  world.clock().now(), "in a test");
    acquisition::SessionPart part;
    part.done = state.done;
    return run(world, archive, progress, part);
  }

  std::string samples_of(const std::filesystem::path& folder) const {
    const TemporaryFolder scratch;
    samples::write_samples(scratch.path() / "samples.csv",
                           acquisition::reduce(SessionReader(folder), known_, reduction_).samples);
    return files::read_text_file(scratch.path() / "samples.csv");
  }

  /// Whether a session had begun at all: what it is to do stands in the archive.
  static bool begun(const std::filesystem::path& folder) {
    try {
      return !SessionReader(folder).metadata().empty();
    } catch (const std::exception&) {
      return false;
    }
  }

  /// The whole promise, for an archive whose writer died after `acknowledged` points; -1: before it
  /// was there.
  void expect_resumes(const std::filesystem::path& folder, int acknowledged) {
    if (!begun(folder)) {
      EXPECT_LT(acknowledged, 0);
      ++never_begun_;
      return;
    }
    const ResumeState before = acquisition::resume_state(SessionReader(folder));
    EXPECT_GE(static_cast<int>(before.done.size()), acknowledged);
    EXPECT_THAT(before.again, testing::IsEmpty());
    EXPECT_TRUE(before.finished || resume(folder).complete);
    const SessionReader after(folder);
    EXPECT_TRUE(after.finished());
    EXPECT_THAT(after.damage(), testing::IsEmpty());
    EXPECT_EQ(after.points().size(), plan_.points.size()) << "none was acknowledged twice";
    EXPECT_LE(begun_twice(after), 1);
    EXPECT_EQ(samples_of(folder), wanted_);
    ++resumed_;
  }

  /// Points with frames of both parts.
  static int begun_twice(const SessionReader& archive) {
    std::chrono::nanoseconds resumed = std::chrono::nanoseconds::max();
    for (const auto& note : archive.notes()) {
      if (note.kind == "resumed") resumed = note.at;
    }
    std::set<int> before;
    std::set<int> both;
    for (const auto& frame : archive.frames()) {
      if (frame.point < 0) continue;
      if (frame.exposure_start < resumed) {
        before.insert(frame.point);
      } else if (before.contains(frame.point)) {
        both.insert(frame.point);
      }
    }
    return static_cast<int>(both.size());
  }

  /// Every so many of them, or all.
  static std::size_t stride(std::size_t count, std::size_t wanted) {
    const char* all = std::getenv("GONIO_KILL_SWEEP");
    if (all != nullptr && std::string(all) == "all") return 1;
    // Odd, so that all kinds of operations have their turn.
    return std::max<std::size_t>(1, count / wanted) | 1U;
  }

  instrument::Instrument known_ = nominal_instrument(steady_world());
  acquisition::MeasurementPlan plan_ = plan_of(known_, kTwelveDirections);
  acquisition::SessionOptions options_;
  acquisition::ReductionOptions reduction_;
  std::string wanted_;  ///< samples of the uninterrupted session
  int never_begun_ = 0;
  int resumed_ = 0;
};

TEST_F(KillSweep, LosesNothingWhereverTheProcessOrThePowerEnds) {
  ASSERT_EQ(plan_.points.size(), 12U);
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  RecordedDisk disk(whole);
  std::vector<std::size_t> acknowledged_at;  // number of operations, per number of points
  begin(whole, [&](const acquisition::SessionProgress& now) {
    while (acknowledged_at.size() <= static_cast<std::size_t>(now.done)) {
      acknowledged_at.push_back(disk.count());
    }
  });
  const std::size_t count = disk.count();
  ASSERT_EQ(acknowledged_at.size(), 13U);
  wanted_ = samples_of(whole);
  const std::size_t step = stride(count, 50);
  std::size_t turn = 0;
  for (std::size_t k = 0; k <= count; k += step) {
    for (std::size_t l = 0; l < kLosses.size(); ++l) {
      if (step > 1 && l != turn % kLosses.size()) continue;
      SCOPED_TRACE(testing::Message() << "operation " << k << " of " << count << ", loss " << l);
      const TemporaryFolder disk_after;
      const std::filesystem::path cut = disk_after.path() / "session";
      disk.restore(k, kLosses[l], k, cut);
      const auto acknowledged =
          std::upper_bound(acknowledged_at.begin(), acknowledged_at.end(), k) -
          acknowledged_at.begin() - 1;
      expect_resumes(cut, static_cast<int>(acknowledged));
      if (HasFailure()) return;
    }
    ++turn;
  }
  EXPECT_GT(resumed_, never_begun_);
  std::printf("%zu operations, every %zu: %d resumed, %d never begun\n", count, step, resumed_,
              never_begun_);
}

TEST_F(KillSweep, LosesNothingWhereverTheDiskFillsUpOrFails) {
  const TemporaryFolder folder;
  std::size_t count = 0;
  {
    RecordedDisk disk(folder.path() / "whole");
    begin(folder.path() / "whole");
    count = disk.count();
  }
  wanted_ = samples_of(folder.path() / "whole");
  const std::size_t step = stride(count, 20);
  for (std::size_t k = 1; k < count; k += step) {
    SCOPED_TRACE(testing::Message() << "operation " << k << " of " << count);
    const TemporaryFolder disk_after;
    const std::filesystem::path cut = disk_after.path() / "session";
    int acknowledged = -1;
    {
      RecordedDisk disk(cut);
      disk.fail_from(k, k % 2 == 0 ? ENOSPC : EIO);
      bool failed = false;
      try {
        begin(cut, [&](const acquisition::SessionProgress& now) { acknowledged = now.done; });
      } catch (const FileError&) {
        failed = true;
      }
      // Only the log of a finished session may be left as it is without a word.
      EXPECT_TRUE(failed || SessionReader(cut).finished());
    }
    expect_resumes(cut, acknowledged);
    if (HasFailure()) return;
  }
  std::printf("%zu operations, every %zu: %d resumed, %d never begun\n", count, step, resumed_,
              never_begun_);
}

TEST_F(KillSweep, LosesNothingWhereverAResumedSessionEndsAgain) {
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  const std::filesystem::path cut = folder.path() / "cut";
  {
    RecordedDisk disk(whole);
    std::size_t within_the_fifth = 0;
    begin(whole, [&](const acquisition::SessionProgress& now) {
      constexpr std::size_t kSomeOfItsFrames = 25;
      if (now.done == 4) within_the_fifth = disk.count() + kSomeOfItsFrames;
    });
    disk.restore(within_the_fifth, RecordedDisk::Loss::half_write, 0, cut);
  }
  wanted_ = samples_of(whole);
  const TemporaryFolder again;
  std::filesystem::copy(cut, again.path() / "session", std::filesystem::copy_options::recursive);
  RecordedDisk disk(again.path() / "session");
  std::vector<std::size_t> acknowledged_at(4, 0);
  EXPECT_TRUE(resume(again.path() / "session", [&](const acquisition::SessionProgress& now) {
                while (acknowledged_at.size() <= static_cast<std::size_t>(now.done)) {
                  acknowledged_at.push_back(disk.count());
                }
              }).complete);
  const std::size_t count = disk.count();
  ASSERT_EQ(acknowledged_at.size(), 13U);
  const std::size_t step = stride(count, 25);
  std::size_t turn = 0;
  for (std::size_t k = 0; k <= count; k += step, ++turn) {
    for (std::size_t l = 0; l < kLosses.size(); ++l) {
      if (step > 1 && l != turn % kLosses.size()) continue;
      SCOPED_TRACE(testing::Message() << "operation " << k << " of " << count << ", loss " << l);
      const TemporaryFolder disk_after;
      const std::filesystem::path twice = disk_after.path() / "session";
      disk.restore(k, kLosses[l], k, twice);
      const auto acknowledged =
          std::upper_bound(acknowledged_at.begin(), acknowledged_at.end(), k) -
          acknowledged_at.begin() - 1;
      expect_resumes(twice, static_cast<int>(acknowledged));
      if (HasFailure()) return;
    }
  }
  EXPECT_EQ(never_begun_, 0);
  std::printf("%zu operations, every %zu: %d resumed twice\n", count, step, resumed_);
}

TEST_F(KillSweep, DoesNothingWithAFinishedSession) {
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  EXPECT_TRUE(begin(whole).complete);
  EXPECT_TRUE(acquisition::resume_state(SessionReader(whole)).finished);
  EXPECT_THROW(resume(whole), std::logic_error);
}

TEST_F(KillSweep, MeasuresAPointAgainWhoseFrameWasSpoilt) {
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  RecordedDisk disk(whole);
  std::size_t after_five = 0;
  begin(whole, [&](const acquisition::SessionProgress& now) {
    if (now.done == 5 && after_five == 0) after_five = disk.count();
  });
  wanted_ = samples_of(whole);
  const std::filesystem::path cut = folder.path() / "cut";
  disk.restore(after_five, RecordedDisk::Loss::nothing, 0, cut);
  std::string spoilt;
  const SessionReader archive(cut);
  for (const auto& frame : archive.frames()) {
    if (frame.point == 3) spoilt = frame.file;
  }
  std::filesystem::resize_file(cut / spoilt, 100);
  const ResumeState state = acquisition::resume_state(SessionReader(cut));
  EXPECT_THAT(state.again, testing::ElementsAre(testing::HasSubstr("point 3")));
  EXPECT_EQ(state.done.size(), 4U);
  EXPECT_TRUE(resume(cut).complete);
  EXPECT_EQ(samples_of(cut), wanted_);
}

}  // namespace
}  // namespace gonio
