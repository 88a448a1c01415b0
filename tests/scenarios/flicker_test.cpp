// A lamp that flickers while a white or a point is taken, with periods about those of the frames
// and their parts, where readings before and after a frame are alike.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <tuple>

#include "gonio/acquisition/trust_notes.h"
#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::SessionProgress;
using acquisition::SessionReader;
using Time = std::chrono::nanoseconds;

constexpr int kFlickeringPoint = 1;
/// Of a point's mean, taken again: noise of other frames. Flicker of 20 % makes it ten times that.
constexpr double kSameWithin = 0.01;
constexpr int kOnsets = 3;

/// Phase that flickers, the period in those of a frame (exposure and readout), and how many times
/// as bright it is in every other half of one.
using Flicker = std::tuple<std::string, double, double>;
constexpr double kBrighter = 1.2;
constexpr double kOff = 0.001;

class FlickerTest : public SteadySession, public testing::WithParamInterface<Flicker> {
 protected:
  FlickerTest() {
    plan_ = plan_of(known_, {kTwelveDirections.begin() + 4, kTwelveDirections.begin() + 6});
    options_.sentinel_every = 0;
  }

  bool is_struck(const SessionProgress& now) const {
    return now.phase == std::get<0>(GetParam()) &&
           (now.phase != "point" || now.done == kFlickeringPoint);
  }

  /// Each point is as in the undisturbed session, or, where it flickered still when it was taken
  /// again, marked as suspect: no other than the struck one.
  void expect_good_or_marked(const std::filesystem::path& session,
                             const std::filesystem::path& undisturbed) const {
    std::map<int, std::pair<double, double>> sums;
    const auto found = reduced(session).samples.samples;
    const auto wanted = reduced(undisturbed).samples.samples;
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (found[i].flags.find("suspect") != std::string::npos) {
        EXPECT_EQ(std::get<0>(GetParam()), "point") << "a white that flickers makes none suspect";
        EXPECT_EQ(found[i].pose, kFlickeringPoint) << "the light was steady there";
        continue;
      }
      for (int colour = 0; colour < 3; ++colour) {
        auto& [before, after] = sums[3 * wanted[i].pose + colour];
        before += wanted[i].value_per_sr[colour];
        after += found[i].value_per_sr[colour];
      }
    }
    for (const auto& [place, sum] : sums) {
      EXPECT_NEAR(sum.second / sum.first, 1.0, kSameWithin)
          << "point " << place / 3 << ", colour " << place % 3;
    }
  }

  TemporaryFolder folder_;
};

TEST_P(FlickerTest, LeavesNothingBadThatLooksGood) {
  std::optional<Time> from;
  std::optional<Time> until;
  const std::filesystem::path whole = folder_.path() / "whole";
  {
    sim::SimGoniometer world(world_);
    acquisition::SessionWriter archive(whole, {}, {});
    run(world, archive, [&](const SessionProgress& now) {
      if (from && !until) until = world.clock().now();
      if (!from && is_struck(now)) from = world.clock().now();
    });
  }
  ASSERT_TRUE(from && until);
  // In the session's course: the way to the pose, then frames one after the other.
  std::optional<Time> first_frame;
  Time frame_takes{0};
  const SessionReader undisturbed(whole);
  int frames = 0;
  for (const acquisition::FrameRecord& frame : undisturbed.frames()) {
    if (frame.exposure_start < *from || frame.exposure_start >= *until) continue;
    if (!first_frame) {
      first_frame = frame.exposure_start;
      frame_takes = frame.exposure + world_.camera.readout;
    }
    frames += frame.channel == "R" ? 1 : 0;
  }
  ASSERT_TRUE(first_frame);
  ASSERT_EQ(frames, 1) << "the bracket has two frames: their readings are no test of this";

  const double times = std::get<2>(GetParam());
  const auto half_period =
      std::chrono::duration_cast<Time>(frame_takes * std::get<1>(GetParam())) / 2;
  for (int onset = 0; onset < kOnsets; ++onset) {
    SCOPED_TRACE(testing::Message() << "onset " << onset);
    world_.lamp.events.clear();
    bool up = true;
    for (Time at = *first_frame - 2 * half_period * (onset + 1) / kOnsets; at < *until;
         at += half_period, up = !up) {
      world_.lamp.events.push_back({at, {}, up ? times : 1.0 / times, true});
    }
    if (!up) world_.lamp.events.push_back({*until, {}, 1.0 / times, true});
    const std::filesystem::path session = folder_.path() / std::to_string(onset);
    try {
      begin(session);
    } catch (const devices::DeviceError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("no steady light at the white"));
    }
    world_.lamp.events.clear();
    if (!SessionReader(session).finished()) {
      EXPECT_TRUE(resume(session).complete);
    }
    expect_good_or_marked(session, whole);
    const SessionReader archive(session);
    const auto& notes = archive.notes();
    const bool again = std::any_of(notes.begin(), notes.end(), [](const auto& note) {
      return note.kind == acquisition::kSuspectNote || note.kind == acquisition::kWhiteAgainNote;
    });
    EXPECT_TRUE(again) << "not seen";
  }
}

std::string name_of(const testing::TestParamInfo<Flicker>& info) {
  return std::get<0>(info.param) + "_" +
         std::to_string(static_cast<int>(1000.0 * std::get<1>(info.param) + 0.5)) +
         (std::get<2>(info.param) == kOff ? "_off" : "");
}

INSTANTIATE_TEST_SUITE_P(Periods, FlickerTest,
                         testing::Combine(testing::Values("white", "point"),
                                          testing::Values(2.0, 1.02, 1.0, 2.0 / 3.0, 0.5, 1.0 / 3.0,
                                                          0.15),
                                          testing::Values(kBrighter)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(OnAndOff, FlickerTest,
                         testing::Combine(testing::Values("white", "point"),
                                          testing::Values(1.0, 0.5), testing::Values(kOff)),
                         name_of);

}  // namespace
}  // namespace gonio
