// The driver and an emulated camera over loopback: pixels, settings, faults, ends of connections.

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <fstream>
#include <functional>
#include <thread>

#include "private_loopback.h"
#include "wire_camera.h"

namespace gonio::aravis_camera {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using emulator_faults::Fault;
using emulator_faults::FaultRule;
using gige_emulator::Feature;
using namespace std::chrono_literals;

const auto* const kLoopback = testing::AddGlobalTestEnvironment(new PrivateLoopback({"127.0.0.2"}));

// Of a control channel that does not answer: five times half a second inside Aravis.
constexpr auto kControlDeadline = 2500ms;
// What a busy machine may add to a deadline.
constexpr auto kSlack = 2000ms;

FaultRule rule(Fault fault, std::optional<std::uint64_t> count = std::nullopt,
               std::uint64_t skip = 0) {
  FaultRule made;
  made.fault = fault;
  made.count = count;
  made.skip = skip;
  return made;
}

/// Runs `action`, which must throw a DeviceError of this code in time.
void expect_error(DeviceErrc code, const std::string& part, std::chrono::milliseconds deadline,
                  const std::function<void()>& action) {
  const auto start = std::chrono::steady_clock::now();
  try {
    action();
    FAIL() << "no error";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_EQ(error.device(), "camera");
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
  EXPECT_LE(std::chrono::steady_clock::now() - start, deadline + kSlack);
}

bool shows_pattern(const devices::Frame& frame, int bits, const Region& region) {
  for (int row = 0; row < region.height; ++row) {
    for (int column = 0; column < region.width; ++column) {
      if (row + region.y == 0 && column + region.x == 0) continue;  // counts exposures
      const unsigned converted = PatternCamera::value(row + region.y, column + region.x);
      const unsigned expected = bits >= 12 ? converted << (bits - 12) : converted >> (12 - bits);
      if (frame.at(row, column) != expected) return false;
    }
  }
  return true;
}

class AravisFormats : public testing::TestWithParam<WireFormat> {};

TEST_P(AravisFormats, EveryPixelArrivesAsTheSensorGaveIt) {
  WireCamera wire(std::string(GetParam().name), {}, 20.0, 66, 38);
  AravisCamera camera = wire.open();
  const devices::Frame frame = camera.capture(1ms);
  EXPECT_EQ(frame.pixel_format, GetParam().layout);
  EXPECT_EQ(frame.width_px, 66);
  EXPECT_EQ(frame.height_px, 38);
  EXPECT_TRUE(shows_pattern(frame, GetParam().bits, {0, 0, 66, 38}));
}

std::string format_name(const testing::TestParamInfo<WireFormat>& info) {
  return std::string(info.param.name);
}

INSTANTIATE_TEST_SUITE_P(Wire, AravisFormats,
                         testing::ValuesIn(wire_formats().begin(), wire_formats().end()),
                         format_name);

TEST(AravisWire, ShowsTheRegionOfInterest) {
  WireCamera wire("Mono12p");
  wire.options().region = {40, 20, 128, 64};
  AravisCamera camera = wire.open();
  EXPECT_EQ(camera.info().width_px, 128);
  EXPECT_EQ(camera.info().height_px, 64);
  EXPECT_TRUE(shows_pattern(camera.capture(1ms), 12, {40, 20, 128, 64}));
}

TEST(AravisWire, GainAndBlackLevelActOnThePixelsAndAreInTheFrame) {
  WireCamera wire("Mono12");
  wire.options().gain_db = 6.0;
  wire.options().black_level_dn = 100.0;
  const devices::Frame frame = wire.open().capture(1ms);
  EXPECT_EQ(frame.gain_db, 6.0);
  EXPECT_EQ(frame.black_level_dn, 100.0);
  // 6 dB are a factor of 1.9953.
  const int row = 0;
  const int column = 10;
  EXPECT_NEAR(frame.at(row, column), 100.0 + 1.9953 * (PatternCamera::value(row, column) - 64.0),
              1.0);
}

TEST(AravisWire, SettingsOutsideTheCamerasRangeAreRefused) {
  WireCamera wire;
  wire.options().gain_db = 40.0;
  expect_error(DeviceErrc::LimitViolation, "Gain", kControlDeadline, [&] { wire.open(); });
  wire.options().gain_db = 0.0;
  wire.options().region = {0, 0, 640, 480};
  expect_error(DeviceErrc::LimitViolation, "", kControlDeadline, [&] { wire.open(); });
  wire.options().region = {};
  wire.options().trigger_line = "Line7";
  expect_error(DeviceErrc::Fault, "Line7", kControlDeadline, [&] { wire.open(); });
}

TEST(AravisWire, IsFoundAndSaysWhoItIs) {
  WireCamera wire;
  const std::vector<CameraDeviceInfo> found = list_cameras();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].vendor, "Gonio");
  EXPECT_EQ(found[0].model, "pattern");
  EXPECT_EQ(found[0].serial, "P-0001");
  EXPECT_EQ(found[0].address, "127.0.0.1");
  EXPECT_EQ(found[0].protocol, "GigEVision");
  wire.options().device = found[0].id;
  wire.options().serial = "P-0001";
  AravisCamera camera = wire.open();
  EXPECT_EQ(camera.info().model, "pattern");
  EXPECT_EQ(camera.info().serial, "P-0001");
  EXPECT_EQ(camera.identity().exposure_feature, "ExposureTime");
  EXPECT_EQ(camera.identity().gain_feature, "Gain");
  camera.capture(1ms);
}

TEST(AravisWire, CameraWithoutTestPacketsStaysAtItsPacketSize) {
  WireCamera wire;
  wire.options().packet_size = 0;
  const auto start = std::chrono::steady_clock::now();
  AravisCamera camera = wire.open();
  EXPECT_LE(std::chrono::steady_clock::now() - start, kSlack);
  EXPECT_EQ(camera.identity().packet_size, 9000);
  EXPECT_TRUE(shows_pattern(camera.capture(1ms), 12, {0, 0, 320, 256}));
}

TEST(AravisWire, TemperatureIsTheSensors) {
  WireCamera wire;
  AravisCamera camera = wire.open();
  wire.emulator().set(Feature::temperature_c, 44.25);
  EXPECT_EQ(camera.temperature_c(), 44.25);
}

TEST(AravisWire, TwoCamerasAnswerAtTwoAddresses) {
  WireCamera wire;
  PatternCamera other_pattern(wire.clock(), devices::PixelFormat::mono, 64, 32);
  gige_emulator::GigeCameraOptions other_options;
  other_options.address = "127.0.0.2";
  other_options.serial = "P-0002";
  const gige_emulator::GigeCamera other(other_options, other_pattern, wire.clock(), wire.faults());
  AravisCamera first = wire.open();
  wire.options().device = "127.0.0.2";
  AravisCamera second = wire.open();
  EXPECT_EQ(first.info().serial, "P-0001");
  EXPECT_EQ(second.info().serial, "P-0002");
  EXPECT_EQ(first.capture(1ms).width_px, 320);
  EXPECT_EQ(second.capture(1ms).width_px, 64);
}

TEST(AravisWire, EmulatedCameraRefusesAnAddressItCannotHave) {
  WireCamera wire;
  PatternCamera pattern(wire.clock(), devices::PixelFormat::mono, 64, 32);
  gige_emulator::GigeCameraOptions options;
  EXPECT_THROW(gige_emulator::GigeCamera(options, pattern, wire.clock(), wire.faults()),
               std::runtime_error);  // one is there
  options.address = "192.0.2.1";     // documentation only, RFC 5737
  EXPECT_THROW(gige_emulator::GigeCamera(options, pattern, wire.clock(), wire.faults()),
               std::runtime_error);
  options.address = "camera.local";
  EXPECT_THROW(gige_emulator::GigeCamera(options, pattern, wire.clock(), wire.faults()),
               std::invalid_argument);
  options.address = "127.0.0.2";
  options.serial = std::string(16, '7');
  EXPECT_THROW(gige_emulator::GigeCamera(options, pattern, wire.clock(), wire.faults()),
               std::invalid_argument);
}

TEST(AravisWire, NobodyAtTheAddressIsDisconnected) {
  WireCamera wire;
  wire.options().device = "127.0.0.2";
  wire.options().open_patience = 0ms;
  expect_error(DeviceErrc::Disconnected, "no camera answers at 127.0.0.2", 2 * kControlDeadline,
               [&] { wire.open(); });
}

TEST(AravisWire, ControlChannelLivesDuringALongExposureAtRealPace) {
  WireCamera wire("Mono12", {}, 1.0);  // longer than the heartbeat's 3 s
  AravisCamera camera = wire.open();
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(camera.capture(4s).exposure, 4s);
  EXPECT_GE(std::chrono::steady_clock::now() - start, 4s);
  camera.capture(1ms);
  EXPECT_EQ(camera.counters().retried, 0U);
  EXPECT_EQ(camera.counters().reconnects, 0U);
}

TEST(AravisWire, HardwareTriggerTakesTheFrameOfThePulse) {
  WireCamera wire;
  wire.options().trigger_line = "Line1";
  wire.options().frame_margin = 5000ms;
  AravisCamera camera = wire.open();
  std::atomic<bool> done = false;
  // Until the camera has begun to wait a pulse may come too early.
  std::thread pulses([&] {
    while (!done) {
      wire.emulator().pulse();
      std::this_thread::yield();
    }
  });
  const devices::Frame frame = camera.capture(1ms);
  done = true;
  pulses.join();
  EXPECT_TRUE(shows_pattern(frame, 12, {0, 0, 320, 256}));
}

// --- faults: each with its code and within its deadline, none as a good frame ------------------

TEST(AravisFaults, LostPacketsAreRepeatedAndCounted) {
  WireCamera wire("Mono12", {rule(Fault::lost_packets, 2)});
  AravisCamera camera = wire.open();
  EXPECT_TRUE(shows_pattern(camera.capture(1ms), 12, {0, 0, 320, 256}));
  EXPECT_EQ(camera.counters().incomplete, 2U);
  EXPECT_EQ(camera.counters().retried, 2U);
  EXPECT_EQ(camera.counters().frames, 1U);
}

TEST(AravisFaults, LostPacketsForEverAreProtocol) {
  WireCamera wire("Mono12", {rule(Fault::lost_packets)});
  AravisCamera camera = wire.open();
  expect_error(DeviceErrc::Protocol, "packets are missing", 3 * 600ms,
               [&] { camera.capture(1ms); });
}

TEST(AravisFaults, WrongExposureIsProtocolAndNeverAFrame) {
  WireCamera wire("Mono12", {rule(Fault::wrong_exposure)});
  wire.options().retries = 1;
  AravisCamera camera = wire.open();
  expect_error(DeviceErrc::Protocol, "exposure is 3000 us, asked 2000 us", 2 * 600ms,
               [&] { camera.capture(2ms); });
  EXPECT_EQ(camera.counters().wrong_settings, 2U);
}

TEST(AravisFaults, WrongExposureThatWearsOffIsRepeated) {
  WireCamera wire("Mono12", {rule(Fault::wrong_exposure, 1)});
  AravisCamera camera = wire.open();
  EXPECT_EQ(camera.capture(2ms).exposure, 2ms);
  EXPECT_EQ(camera.counters().retried, 1U);
}

TEST(AravisFaults, DuplicateFrameIdIsNoFrame) {
  // Aravis takes it for a late packet of the frame before and lets nothing through.
  WireCamera wire("Mono12", {rule(Fault::duplicate_frame_id, 1, 1)});
  wire.options().retries = 0;
  AravisCamera camera = wire.open();
  camera.capture(1ms);
  expect_error(DeviceErrc::Timeout, "no frame", 600ms, [&] { camera.capture(1ms); });
  EXPECT_EQ(wire.faults().struck(Fault::duplicate_frame_id), 1U);
  EXPECT_EQ(camera.capture(1ms).pixels_dn.front(), 3);  // the third exposure, not the second
}

TEST(AravisFaults, MissingFrameIsTimeout) {
  WireCamera wire("Mono12", {rule(Fault::no_frame)});
  wire.options().retries = 1;
  AravisCamera camera = wire.open();
  expect_error(DeviceErrc::Timeout, "no frame within", 2 * 600ms, [&] { camera.capture(1ms); });
  EXPECT_EQ(camera.counters().timeouts, 2U);
}

TEST(AravisFaults, LateFrameIsNotTheNextOne) {
  // Twenty times slower than the driver was told: its frame comes when the driver has given up.
  WireCamera wire("Mono12", {}, 1.0);
  const devices::SteadyClock hurried(20.0);
  wire.options().retries = 0;
  AravisCamera camera(wire.options(), hurried);
  EXPECT_EQ(camera.capture(1ms).pixels_dn.front(), 1);
  expect_error(DeviceErrc::Timeout, "no frame", 600ms, [&] { camera.capture(900ms); });
  EXPECT_EQ(camera.capture(1ms).pixels_dn.front(), 3);
}

TEST(AravisFaults, AutomaticFeatureThatSwitchesItselfOnIsProtocol) {
  WireCamera wire;
  wire.options().retries = 0;
  AravisCamera camera = wire.open();
  for (const auto& [feature, value, name] :
       {std::tuple{Feature::exposure_auto, 2.0, "ExposureAuto is on"},
        std::tuple{Feature::gain_auto, 2.0, "GainAuto is on"},
        std::tuple{Feature::black_level_auto, 1.0, "BlackLevelAuto is on"},
        std::tuple{Feature::gamma_enable, 1.0, "GammaEnable is on"}}) {
    wire.emulator().set(feature, value);
    expect_error(DeviceErrc::Protocol, name, 600ms, [&] { camera.capture(1ms); });
    camera.capture(1ms);  // set right again
  }
  EXPECT_EQ(camera.counters().wrong_settings, 4U);
}

TEST(AravisFaults, ChangedPixelFormatOrWindowIsProtocol) {
  WireCamera wire;
  wire.options().retries = 0;
  AravisCamera camera = wire.open();
  camera.capture(1ms);
  wire.emulator().set(Feature::pixel_format, find_wire_format("Mono16")->code);
  expect_error(DeviceErrc::Protocol, "Mono16, asked Mono12", 600ms, [&] { camera.capture(1ms); });
  camera.capture(1ms);
  wire.emulator().set(Feature::width, 160.0);
  expect_error(DeviceErrc::Protocol, "160 x 256 px", 600ms, [&] { camera.capture(1ms); });
  EXPECT_TRUE(shows_pattern(camera.capture(1ms), 12, {0, 0, 320, 256}));
}

TEST(AravisFaults, CameraThatVanishesIsDisconnectedAndComesBackWithItsSettings) {
  WireCamera wire;
  wire.options().gain_db = 6.0;
  AravisCamera camera = wire.open();
  camera.capture(1ms);
  wire.emulator().unplug();
  expect_error(DeviceErrc::Disconnected, "", kControlDeadline, [&] { camera.capture(1ms); });
  wire.emulator().plug_in();
  const devices::Frame frame = camera.capture(1ms);
  EXPECT_EQ(frame.gain_db, 6.0);
  EXPECT_EQ(frame.frame_id, 1U);
  EXPECT_EQ(camera.counters().reconnects, 1U);
}

TEST(AravisFaults, CameraThatRestartsByItselfIsNoticed) {
  // Back before anybody asks: the control channel answers, but nothing is set any more.
  WireCamera wire("Mono12", {rule(Fault::dead_link, 1)});
  wire.options().retries = 0;
  AravisCamera camera = wire.open();
  EXPECT_THROW(camera.capture(1ms), DeviceError);
  for (int attempt = 0;; ++attempt) {
    ASSERT_LT(attempt, 5);
    try {
      EXPECT_EQ(camera.capture(1ms).exposure, 1ms);
      break;
    } catch (const DeviceError& error) {
      EXPECT_NE(error.code(), DeviceErrc::Fault) << error.what();
    }
  }
}

/// Takes control of a camera as a program does that dies right after: a GVCP write of the control
/// channel privilege, and never a heartbeat.
class DeadOwner {
 public:
  explicit DeadOwner(const char* address) : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    to_.sin_family = AF_INET;
    to_.sin_port = htons(3956);
    inet_pton(AF_INET, address, &to_.sin_addr);
    // GigE Vision 2.0, 16: key, flags (acknowledge), WRITEREG, length, request, address, value.
    send({0x42, 0x01, 0x00, 0x82, 0x00, 0x08, 0x00, 0x01, 0x00, 0x00, 0x0A, 0x00, 0, 0, 0, 2});
    std::array<unsigned char, 64> answer{};
    const timeval patience{2, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    took_ = recv(socket_, answer.data(), answer.size(), 0) > 0;
  }
  ~DeadOwner() { close(socket_); }
  DeadOwner(const DeadOwner&) = delete;
  DeadOwner& operator=(const DeadOwner&) = delete;

  bool took() const { return took_; }

 private:
  void send(const std::array<unsigned char, 16>& packet) const {
    sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to_),
           sizeof to_);
  }

  int socket_;
  sockaddr_in to_{};
  bool took_ = false;
};

TEST(AravisFaults, CameraOfADeadOwnerIsFreeWhenItsHeartbeatRunsOut) {
  WireCamera wire;
  const DeadOwner owner("127.0.0.1");
  ASSERT_TRUE(owner.took());
  AravisCamera camera = wire.open();
  camera.capture(1ms);
}

TEST(AravisFaults, CameraOfAnotherProgramIsRefused) {
  WireCamera wire;
  AravisCamera owner = wire.open();
  wire.options().open_patience = 0ms;
  expect_error(DeviceErrc::Disconnected, "another program controls the camera",
               2 * kControlDeadline, [&] { wire.open(); });
  owner.capture(1ms);
}

// --- the throughput bar, as far as it is about correctness --------------------------------------

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
// A receiver several times slower cannot keep up; what it does with a frame is looked at as well.
constexpr int kSide = 256;
constexpr int kFrames = 100;
constexpr double kFramesPerSecond = 25.0;
#else
constexpr int kSide = 1024;
constexpr int kFrames = 2000;
constexpr double kFramesPerSecond = 350.0;
#endif

TEST(AravisWire, NotOneOfTwoThousandFramesIsBadAtFullSpeed) {
  int allowed = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> allowed;
  if (allowed < 4 << 20) {
    GTEST_SKIP() << "net.core.rmem_max is " << allowed << ", 4194304 is needed";
  }
  WireCamera wire("Mono16", {}, 20.0, kSide, kSide);
  wire.emulator().show_when_free_running({wire.pattern().still()}, kFramesPerSecond);
  AravisCamera camera = wire.open();
  std::uint64_t bad = 0;
  // A machine busy with something else may let the receiver wait for longer than its buffer lasts:
  // one run of three without a bad frame shows that it is not the driver.
  for (int attempt = 0; attempt < 3; ++attempt) {
    const CameraCounters before = camera.counters();
    int seen = 0;
    int wrong = 0;
    camera.stream(1ms, [&](const devices::Frame& frame) {
      // Two pixels of every row; the benchmark is about speed, this about all of them being there.
      for (int row = 1; row < kSide; ++row) {
        for (const int column : {0, kSide - 1}) {
          wrong += frame.at(row, column) != PatternCamera::value(row, column) << 4 ? 1 : 0;
        }
      }
      return ++seen < kFrames;
    });
    EXPECT_EQ(seen, kFrames);
    EXPECT_EQ(wrong, 0);
    const CameraCounters after = camera.counters();
    bad = after.incomplete - before.incomplete + after.out_of_order - before.out_of_order;
    if (bad == 0) break;
  }
  EXPECT_EQ(bad, 0U);
}

}  // namespace
}  // namespace gonio::aravis_camera
