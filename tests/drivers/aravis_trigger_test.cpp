// What is of this exposure and what is not, over a link made of paper.

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "gonio/aravis_camera/aravis_camera.h"
#include "paper_camera.h"

namespace gonio::aravis_camera {
namespace {

using devices::DeviceErrc;
using namespace std::chrono_literals;

using AravisSoftwareTrigger = PaperTest;

TEST_F(AravisSoftwareTrigger, FrameBeforeItsExposureCouldEndIsRepeated) {
  paper_.script = {[](RawFrame& frame) { frame.arrived -= 90ms; }};
  EXPECT_EQ(camera().capture(100ms).exposure, 100ms);
  EXPECT_EQ(paper_.triggers, 2);
  EXPECT_EQ(paper_.restarts, 1);
  EXPECT_EQ(camera().counters().unexpected, 1U);
  EXPECT_EQ(camera().counters().retried, 1U);
}

TEST_F(AravisSoftwareTrigger, FrameThatIsAlwaysTooEarlyIsProtocol) {
  always([](RawFrame& frame) { frame.arrived -= 90ms; });
  expect_error(DeviceErrc::Protocol, "before its exposure could end",
               [&] { camera().capture(100ms); });
}

TEST_F(AravisSoftwareTrigger, QuickReadoutIsNotTooEarly) {
  AravisCameraOptions of = options();
  of.readout = 5s;  // an estimate of durations, no promise of the camera's
  camera(of).capture(100ms);
  EXPECT_EQ(camera().counters().unexpected, 0U);
}

/// Pulses on a line, in seconds: far from what a busy machine may add.
class AravisLineTrigger : public PaperTest {
 protected:
  AravisLineTrigger() {
    paper_.state.trigger_source = "Line1";
    paper_.state.exposure_us = 10e6;  // in force when it is opened
    paper_.identity.max_exposure_us = 100e6;
  }

  AravisCamera& line_camera() {
    AravisCameraOptions of = options();
    of.trigger_line = "Line1";
    of.retries = 0;
    of.readout = 1s;
    of.frame_margin = 100s;
    return camera(of);
  }

  /// A frame that arrives in `later`, its first pixel this number.
  void arrives(std::chrono::nanoseconds later, int number) {
    pages_.push_back(std::make_unique<std::vector<std::byte>>(paper_.bytes));
    pages_.back()->front() = static_cast<std::byte>(number);
    RawFrame frame = paper_.good_frame();
    frame.arrived += later;
    frame.bytes = *pages_.back();
    paper_.waiting.push_back(frame);
  }

 private:
  std::vector<std::unique_ptr<std::vector<std::byte>>> pages_;
};

TEST_F(AravisLineTrigger, WaitsForAFrameThatOthersTrigger) {
  expect_error(DeviceErrc::Timeout, "is Line1 pulsed?", [&] { line_camera().capture(10s); });
  EXPECT_EQ(paper_.triggers, 0);
}

TEST_F(AravisLineTrigger, StartsTheAcquisitionAnewForEveryFrame) {
  line_camera();
  arrives(13s, 1);  // whenever it comes: of the acquisition before
  paper_.on_restart = [this] { arrives(13s, 2); };
  EXPECT_EQ(line_camera().capture(10s).at(0, 0), 2);
  EXPECT_EQ(line_camera().capture(10s).at(0, 0), 2);
  EXPECT_EQ(paper_.restarts, 2);
}

// The others are about cameras that finish after a restart what they were exposing.

TEST_F(AravisLineTrigger, FrameBegunBeforeTheCallIsPassedOver) {
  paper_.finishes_after_restart = true;
  line_camera();
  arrives(-1s, 1);  // lies ready
  arrives(5s, 2);   // comes when what lay ready has been thrown away
  arrives(10s, 3);  // exposed after the call, but for the readout's second
  arrives(13s, 4);  // begun two seconds after the call
  const auto call = clock_.now();
  const devices::Frame frame = line_camera().capture(10s);
  EXPECT_EQ(frame.at(0, 0), 4);
  EXPECT_GT(frame.exposure_start, call + 1s);
  EXPECT_LT(frame.exposure_start, call + 3s);
  EXPECT_EQ(camera().counters().unexpected, 3U);
  EXPECT_EQ(camera().counters().id_gaps, 0U);
}

TEST_F(AravisLineTrigger, LongExposureBegunBeforeTheCallIsNotTakenForAShortOne) {
  paper_.finishes_after_restart = true;
  line_camera();
  arrives(8s, 1);  // of ten seconds, begun before; one of 1 s might come then
  arrives(14s, 2);
  EXPECT_EQ(line_camera().capture(1s).at(0, 0), 2);
  EXPECT_EQ(camera().counters().unexpected, 1U);
}

TEST_F(AravisLineTrigger, OnlyFramesThatAreTooEarlyIsTimeoutAndSaysSo) {
  paper_.finishes_after_restart = true;
  line_camera();
  arrives(5s, 1);
  arrives(6s, 2);
  expect_error(DeviceErrc::Timeout, "2 came too early", [&] { line_camera().capture(10s); });
}

}  // namespace
}  // namespace gonio::aravis_camera
