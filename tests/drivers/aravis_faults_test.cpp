// The driver and an emulated camera over loopback: faults and ends of connections, each with its
// code and within its deadline, none as a good frame.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "wire_camera.h"
#include "wire_expectations.h"

namespace gonio::aravis_camera {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using emulator_faults::Fault;
using gige_emulator::Feature;
using namespace std::chrono_literals;

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

TEST(AravisFaults, PayloadThatIsNoImagesIsProtocol) {
  WireCamera wire;
  wire.options().open_patience = 0ms;
  for (const double bytes : {320.0 * 256.0 * 2.0 - 1.0, 4294967295.0}) {
    wire.emulator().set(Feature::payload_bytes, bytes);
    expect_error(DeviceErrc::Protocol, "PayloadSize is", kControlDeadline, [&] { wire.open(); });
  }
  wire.emulator().set(Feature::payload_bytes, 320.0 * 256.0 * 2.0 + 1000.0);  // with chunks
  EXPECT_TRUE(shows_pattern(wire.open().capture(1ms), 12, {0, 0, 320, 256}));
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

/// Speaks the control protocol (GVCP, GigE Vision 2.0, 14 to 16) and has memory, but is no camera.
class NoCamera {
 public:
  explicit NoCamera(const char* at) : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_port = htons(3956);
    inet_pton(AF_INET, at, &own.sin_addr);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
    thread_ = std::thread([this] { answer_all(); });
  }
  ~NoCamera() {
    shutdown(socket_, SHUT_RDWR);  // wakes recvfrom, though it was never connected
    thread_.join();
    close(socket_);
  }
  NoCamera(const NoCamera&) = delete;
  NoCamera& operator=(const NoCamera&) = delete;

  /// Before anybody asks.
  void write(std::size_t address, const std::string& text) {
    std::copy(text.begin(), text.end(), memory_.begin() + static_cast<std::ptrdiff_t>(address));
  }

 private:
  void answer_all() {
    std::array<unsigned char, 1024> ask{};
    sockaddr_in from{};
    socklen_t size = sizeof from;
    while (recvfrom(socket_, ask.data(), ask.size(), 0, reinterpret_cast<sockaddr*>(&from),
                    &size) >= 12) {
      // status, command + 1, length, request; then what the command gives back.
      std::vector<unsigned char> out{0, 0, ask[2], static_cast<unsigned char>(ask[3] + 1),
                                     0, 0, ask[6], ask[7]};
      const std::size_t address = static_cast<std::size_t>(ask[10]) << 8U | ask[11];
      std::size_t bytes = 4;
      if (ask[3] == 0x84) {  // READMEM: address, reserved, count
        out.insert(out.end(), ask.begin() + 8, ask.begin() + 12);
        bytes = static_cast<std::size_t>(ask[14]) << 8U | ask[15];
      }
      for (std::size_t i = 0; i < bytes; ++i) out.push_back(memory_[(address + i) % 65536]);
      out[4] = static_cast<unsigned char>((out.size() - 8) >> 8U);
      out[5] = static_cast<unsigned char>(out.size() - 8);
      sendto(socket_, out.data(), out.size(), 0, reinterpret_cast<const sockaddr*>(&from), size);
    }
  }

  int socket_;
  std::vector<unsigned char> memory_ = std::vector<unsigned char>(65536);
  std::thread thread_;
};

TEST(AravisFaults, WhatIsNoCameraIsSaidToBeNoneAndNothingIsPrinted) {
  WireCamera wire;
  wire.options().device = "127.0.0.3";
  // Where the address of the description stands (bootstrap register First URL), and what is there.
  constexpr std::size_t kFirstUrl = 0x200;
  const std::vector<std::pair<std::string, std::string>> descriptions = {
      {"", ""},
      {"no address", ""},
      {"Local:device.xml;8000;6", "<html>"},
      {"Local:device.zip;8000;20", "PK garbage"},
      {"Local:device.xml;8000;ffffffff", "<RegisterDescription>"}};
  for (const auto& [url, text] : descriptions) {
    NoCamera other("127.0.0.3");
    other.write(kFirstUrl, url);
    other.write(0x8000, text);
    testing::internal::CaptureStderr();
    expect_error(DeviceErrc::Protocol, "what answers at 127.0.0.3 is no GigE Vision",
                 kControlDeadline, [&] { wire.open(); });
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << url;
  }
}

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

}  // namespace
}  // namespace gonio::aravis_camera
