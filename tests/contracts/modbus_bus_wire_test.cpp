// The bus alone on the wire: bytes, order, silences, and links that go and come.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <future>
#include <thread>

#include "gonio/modbus_emulator/frames.h"
#include "modbus_rig.h"
#include "temporary_folder.h"
#include "throws_device_error.h"

namespace gonio::contracts {
namespace {

using devices::DeviceErrc;
using modbus_bus::Request;
using Host = std::chrono::steady_clock;
using Bytes = modbus_emulator::Bytes;
using testing::ElementsAre;

/// The far end of a serial line, by hand.
class FarEnd {
 public:
  FarEnd() : master_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    std::array<char, 64> path{};
    EXPECT_EQ(::grantpt(master_), 0);
    EXPECT_EQ(::unlockpt(master_), 0);
    EXPECT_EQ(::ptsname_r(master_, path.data(), path.size()), 0);
    port_ = path.data();
    slave_ = ::open(path.data(), O_RDWR | O_NOCTTY);
    termios raw{};
    ::tcgetattr(slave_, &raw);
    ::cfmakeraw(&raw);
    ::tcsetattr(slave_, TCSANOW, &raw);
  }
  FarEnd(const FarEnd&) = delete;
  FarEnd& operator=(const FarEnd&) = delete;
  ~FarEnd() {
    ::close(slave_);
    ::close(master_);
  }

  const std::string& port() const { return port_; }

  /// The next `count` bytes, or fewer after 5 s.
  Bytes receive(std::size_t count) const {
    Bytes bytes;
    while (bytes.size() < count) {
      pollfd watched{master_, POLLIN, 0};
      if (::poll(&watched, 1, 5000) <= 0) break;
      std::uint8_t byte = 0;
      if (::read(master_, &byte, 1) == 1) bytes.push_back(byte);
    }
    return bytes;
  }
  void send(const Bytes& bytes) const {
    EXPECT_EQ(::write(master_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

 private:
  int master_;
  int slave_ = -1;
  std::string port_;
};

// Frames of hardware manuals: Leadshine CS2RS p. 50 (PR0), iEM-RS p. 18 to 20; a stage that sets a
// current (the manual's checksum DD 7B is a misprint); Oriental Motor's FAQ 0331.
const Bytes kPr0{0x07, 0x10, 0x62, 0x00, 0x00, 0x08, 0x10, 0x00, 0x01, 0x00, 0x00, 0x27, 0x10,
                 0x00, 0x00, 0x27, 0x10, 0x27, 0x10, 0x00, 0x00, 0x00, 0x10, 0x8D, 0x50};
const Bytes kPr0Answer{0x07, 0x10, 0x62, 0x00, 0x00, 0x08, 0xDE, 0x11};
const Bytes kSaveAll{0x01, 0x06, 0x18, 0x01, 0x22, 0x11, 0x06, 0x06};
const Bytes kInputs{0x01, 0x10, 0x01, 0x46, 0x00, 0x04, 0x08, 0x00, 0x00,
                    0x00, 0x28, 0x00, 0x00, 0x00, 0x29, 0x1C, 0x14};
const Bytes kPeakCurrent{0x01, 0x06, 0x01, 0x91, 0x00, 0x20, 0xD8, 0x03};
const Bytes kAzPosition{0x01, 0x10, 0x18, 0x02, 0x00, 0x02, 0x04,
                        0xFF, 0xFF, 0xFC, 0x18, 0x99, 0x58};
const Bytes kDamagedRequest{0x01, 0x83, 0x08, 0x40, 0xF6};

TEST(ModbusBusOnTheWire, SendsThePublishedFramesByteForByte) {
  const FarEnd end;
  const auto bus = modbus_bus::open_rtu({end.port()}, {.response_timeout = 2000ms, .retries = 0});
  const auto exchange = [&](int unit, const Request& request, const Bytes& expected,
                            const Bytes& answer) {
    auto done = std::async(std::launch::async, [&] { return bus->ask({"drive", unit}, request); });
    EXPECT_EQ(end.receive(expected.size()), expected);
    end.send(answer);
    EXPECT_THAT(done.get(), ElementsAre());
  };
  exchange(7, modbus_bus::write_registers(0x6200, {1, 0, 10000, 0, 10000, 10000, 0, 0x10}), kPr0,
           kPr0Answer);
  exchange(1, modbus_bus::write_register(0x1801, 0x2211), kSaveAll, kSaveAll);
  exchange(1, modbus_bus::write_register(0x0191, 0x0020), kPeakCurrent, kPeakCurrent);
  const auto head = [](const Bytes& request) {  // the answer to function 10 is the request's head
    return modbus_emulator::with_crc({request.begin(), request.begin() + 6});
  };
  exchange(1, modbus_bus::write_registers(0x0146, {0, 0x28, 0, 0x29}), kInputs, head(kInputs));
  exchange(1, modbus_bus::write_registers(0x1802, {0xFFFF, 0xFC18}), kAzPosition,
           head(kAzPosition));
}

TEST(ModbusBusOnTheWire, ReadsThePublishedExceptionOfADamagedRequest) {
  const FarEnd end;
  const auto bus = modbus_bus::open_rtu({end.port()}, {.response_timeout = 2000ms, .retries = 0});
  auto done = std::async(std::launch::async, [&] {
    return bus->ask({"drive", 1}, modbus_bus::read_holding_registers(0x0001));
  });
  end.receive(8);
  end.send(kDamagedRequest);
  EXPECT_THAT([&] { done.get(); }, ThrowsDeviceError(DeviceErrc::Protocol));
}

TEST(ModbusBusOnTheWire, BusyUnitIsAskedAgainAndThenATimeout) {
  const FarEnd end;
  const auto bus = modbus_bus::open_rtu({end.port()}, {.response_timeout = 2000ms, .retries = 1});
  const Request write = modbus_bus::write_register(0x6002, 0x0020);
  const Bytes busy = modbus_emulator::with_crc({0x01, 0x86, 0x06});
  const auto answered = [&](const Bytes& first, const Bytes& second) {
    // It has not acted on a request that it refused: repeating harms nothing.
    auto done = std::async(std::launch::async, [&] {
      bus->transact({"drive", 1}, write, {.repeatable = false});
    });
    end.receive(8);
    end.send(first);
    end.receive(8);
    end.send(second);
    done.get();
  };
  const Bytes echo = modbus_emulator::with_crc(modbus_bus::encode(1, write));
  EXPECT_NO_THROW(answered(busy, echo));
  EXPECT_THAT([&] { answered(busy, busy); }, ThrowsDeviceError(DeviceErrc::Timeout));
}

TEST(ModbusBusOnTheWire, LateAnswerOfARepeatedReadIsThrownAwayWithTheRead) {
  const FarEnd end;
  const auto bus = modbus_bus::open_rtu({end.port()}, {.response_timeout = 150ms, .retries = 2});
  const auto answer = [](std::uint8_t value) {
    return modbus_emulator::with_crc({0x01, 0x03, 0x02, 0x00, value});
  };
  auto done = std::async(std::launch::async, [&] {
    return bus->ask({"drive", 1}, modbus_bus::read_holding_registers(0x1003));
  });
  end.receive(8);  // unanswered in time
  end.receive(8);
  end.send(answer(1));  // the answer to the first attempt; it looks like that to the second
  end.send(answer(2));
  end.receive(8);
  end.send(answer(3));
  EXPECT_THAT(done.get(), ElementsAre(3));
}

TEST(ModbusBusOnTheWire, AnswerBehindNoiseIsNotTakenForTheAnswerToTheNextRequest) {
  const FarEnd end;
  const auto bus = modbus_bus::open_rtu({end.port()}, {.response_timeout = 150ms, .retries = 2});
  const auto answer = [](std::uint8_t value) {
    return modbus_emulator::with_crc({0x01, 0x03, 0x02, 0x00, value});
  };
  auto done = std::async(std::launch::async, [&] {
    return bus->ask({"drive", 1}, modbus_bus::read_holding_registers(0x1003));
  });
  end.receive(8);
  end.send({0x01, 0x03, 0x02, 0x00, 0x01, 0x00, 0x00});  // of an answer's length
  end.receive(8);
  end.send(answer(1));  // to the first attempt
  end.send(answer(2));
  end.receive(8);
  end.send(answer(3));
  EXPECT_THAT(done.get(), ElementsAre(3));
}

TEST(ModbusBusOnTheWire, StopOfADeadUnitIsOneTransaction) {
  constexpr auto kTimeout = 800ms;
  ModbusRig rig(Family::leadshine, {}, {.response_timeout = kTimeout, .retries = 2});
  const auto stage = rig.stage(0);
  stage->home(300s);
  rig.faults().add(rules({"dead_link@lamp_arm"})[0]);
  const auto begun = Host::now();
  stage->stop();
  // The rest is for the line and a busy host; two attempts would take twice as long.
  EXPECT_LT(Host::now() - begun, kTimeout + 700ms);
  EXPECT_EQ(rig.faults().struck(emulator_faults::Fault::dead_link), 1U);
  EXPECT_THAT([&] { stage->require_standing(); }, ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_EQ(rig.faults().struck(emulator_faults::Fault::dead_link), 4U);  // the second round
}

TEST(ModbusBusOnTheWire, RequestThatMustNotBeRepeatedIsSentOnce) {
  ModbusRig rig(Family::leadshine, {"dead_link@lamp_arm"}, {.response_timeout = 50ms});
  EXPECT_THAT(
      [&] {
        rig.rtu()->transact({"lamp_arm", 1}, modbus_bus::write_register(0x6002, 0x20),
                            {.repeatable = false});
      },
      ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_EQ(rig.faults().struck(emulator_faults::Fault::dead_link), 1U);
}

TEST(ModbusBusOnTheWire, UrgentRequestWaitsForOneTransactionAtMost) {
  constexpr auto kTimeout = 800ms;
  ModbusRig rig(Family::leadshine, {}, {.response_timeout = kTimeout, .retries = 0});
  const auto bus = rig.rtu();
  constexpr int kNobody = 99;
  std::atomic<bool> done = false;
  const auto hammer = [&] {
    while (!done) {
      try {
        bus->ask({"nobody", kNobody}, modbus_bus::read_holding_registers(0));
      } catch (const devices::DeviceError&) {
      }
    }
  };
  std::thread first(hammer);
  std::thread second(hammer);
  std::chrono::nanoseconds longest{0};
  for (int i = 0; i < 8; ++i) {
    const auto begun = Host::now();
    bus->transact({"lamp_arm", 1}, modbus_bus::write_register(0x6002, 0x40), {.urgent = true});
    longest = std::max<std::chrono::nanoseconds>(longest, Host::now() - begun);
    // Another phase of the others' attempts, 160 ms of the host's later.
    rig.world().clock().wait_until(rig.world().clock().now() + 8s);
  }
  done = true;
  first.join();
  second.join();
  // Its own transaction takes a few milliseconds; the rest is for a busy host. Two transactions
  // without an answer would take 1600 ms.
  EXPECT_LT(longest, kTimeout + 400ms);
}

TEST(ModbusBusOnTheWire, MotionThatWaitedBehindAStopIsNotSent) {
  ModbusRig rig(Family::leadshine, {}, {.response_timeout = 1500ms, .retries = 0});
  const auto stage = rig.stage(0);
  stage->home(300s);
  const Angle before = stage->wait_until_settled(300s);
  // Somebody without an answer has the line; the move waits behind him, then comes the stop.
  const std::size_t frames = rig.line().wire_log().intervals().size();
  auto silent = std::async(std::launch::async, [&] {
    EXPECT_THAT(
        [&] {
          rig.rtu()->ask({"nobody", 99}, modbus_bus::read_holding_registers(0));
        },
        ThrowsDeviceError(DeviceErrc::Timeout));
  });
  const auto patience = Host::now() + 5s;
  while (rig.line().wire_log().intervals().size() == frames && Host::now() < patience) {
    std::this_thread::yield();
  }
  auto move = std::async(std::launch::async, [&] { stage->begin_move_to(stage->limits().min); });
  const bool waits = move.wait_for(100ms) == std::future_status::timeout;
  stage->stop();
  if (waits) {
    EXPECT_THAT([&] { move.get(); }, ThrowsDeviceError(DeviceErrc::Stopped));
  }
  silent.get();
  stage->rearm();
  ASSERT_TRUE(waits) << "the move did not wait: nothing was shown";
  EXPECT_EQ(stage->wait_until_settled(300s), before);
}

TEST(ModbusBusOnTheWire, LeavesSilenceBetweenFramesAndTheLineItsTime) {
  ModbusRig rig(Family::leadshine);
  constexpr int kBaud = 9600;
  modbus_emulator::ModbusRtuLine line({.baud = kBaud, .parity = 'E'}, nullptr, rig.world().clock());
  line.add(3, modbus_emulator::lamp("lamp", rig.world().light_source()));
  const auto bus = modbus_bus::open_rtu({line.port(), kBaud, 'E', 1});
  constexpr int kReads = 10;
  for (int i = 0; i < kReads; ++i) {
    EXPECT_THAT(bus->ask({"lamp", 3}, modbus_bus::read_input_registers(0)), ElementsAre(312));
  }
  // 8 bytes there, 7 back, 11 bits each.
  constexpr double kCharacter_s = 11.0 / kBaud;
  const auto log = line.wire_log().intervals();
  ASSERT_EQ(log.size(), 2U * kReads);
  double busy_s = 0.0;
  for (std::size_t i = 0; i < log.size(); ++i) {
    busy_s += std::chrono::duration<double>(log[i].to - log[i].from).count();
    if (i == 0) continue;
    EXPECT_GE(std::chrono::duration<double>(log[i].from - log[i - 1].to).count(),
              3.5 * kCharacter_s - 1e-6);
  }
  EXPECT_NEAR(busy_s, kReads * 15 * kCharacter_s, 1e-4);
}

TEST(ModbusBusOnTheWire, HungUpPortIsDisconnectedUntilItIsBack) {
  const TemporaryFolder folder;
  const auto link = folder.path() / "port";
  ModbusRig rig(Family::leadshine);
  auto line = std::make_unique<modbus_emulator::ModbusRtuLine>(
      modbus_emulator::ModbusRtuLine::Options{.link = link}, nullptr, rig.world().clock());
  line->add(1, modbus_emulator::lamp("lamp", rig.world().light_source()));
  const auto bus = modbus_bus::open_rtu({line->port()}, {.reopen_interval = 0ms});
  const auto read = [&] { return bus->ask({"lamp", 1}, modbus_bus::read_input_registers(0)); };
  EXPECT_THAT(read(), ElementsAre(312));
  line.reset();
  for (int i = 0; i < 3; ++i) EXPECT_THAT(read, ThrowsDeviceError(DeviceErrc::Disconnected));
  line = std::make_unique<modbus_emulator::ModbusRtuLine>(
      modbus_emulator::ModbusRtuLine::Options{.link = link}, nullptr, rig.world().clock());
  line->add(1, modbus_emulator::lamp("lamp", rig.world().light_source()));
  EXPECT_THAT(read(), ElementsAre(312));
}

TEST(ModbusBusOnTheWire, ClosedConnectionIsDisconnectedUntilTheServerIsBack) {
  ModbusRig rig(Family::leadshine);
  const auto serve = [&](std::uint16_t port) {
    auto server = std::make_unique<modbus_emulator::ModbusTcpServer>(
        modbus_emulator::ModbusTcpServer::Options{.port = port}, nullptr, rig.world().clock());
    server->add(1, modbus_emulator::lamp("lamp", rig.world().light_source()));
    return server;
  };
  auto server = serve(0);
  const std::uint16_t port = server->port();
  const auto bus = modbus_bus::open_tcp({"127.0.0.1", port}, {.reopen_interval = 0ms});
  const auto read = [&] { return bus->ask({"lamp", 1}, modbus_bus::read_input_registers(0)); };
  EXPECT_THAT(read(), ElementsAre(312));
  server.reset();
  for (int i = 0; i < 3; ++i) EXPECT_THAT(read, ThrowsDeviceError(DeviceErrc::Disconnected));
  server = serve(port);
  EXPECT_THAT(read(), ElementsAre(312));
}

TEST(ModbusBusOnTheWire, ConnectionClosedWhileNothingIsAskedIsOpenedAnew) {
  ModbusRig rig(Family::leadshine);
  auto server = std::make_unique<modbus_emulator::ModbusTcpServer>(
      modbus_emulator::ModbusTcpServer::Options{}, nullptr, rig.world().clock());
  const std::uint16_t port = server->port();
  const auto bus = modbus_bus::open_tcp({"127.0.0.1", port});
  server.reset();
  server = std::make_unique<modbus_emulator::ModbusTcpServer>(
      modbus_emulator::ModbusTcpServer::Options{.port = port}, nullptr, rig.world().clock());
  server->add(1, modbus_emulator::lamp("lamp", rig.world().light_source()));
  EXPECT_THAT(bus->ask({"lamp", 1}, modbus_bus::read_input_registers(0)), ElementsAre(312));
}

/// A server of one connection that answers every request for one word with these twelve bytes but
/// the transaction.
class TcpFarEnd {
 public:
  explicit TcpFarEnd(Bytes answer)
      : listener_(::socket(AF_INET, SOCK_STREAM, 0)), answer_(std::move(answer)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    server_ = std::thread([this] { serve(); });
  }
  ~TcpFarEnd() {
    ::shutdown(listener_, SHUT_RDWR);
    server_.join();
    ::close(listener_);
  }
  TcpFarEnd(const TcpFarEnd&) = delete;
  TcpFarEnd& operator=(const TcpFarEnd&) = delete;

  std::uint16_t port() const { return port_; }

 private:
  void serve() {
    for (int peer; (peer = ::accept(listener_, nullptr, nullptr)) >= 0; ::close(peer)) {
      std::array<std::uint8_t, 12> request{};
      while (::recv(peer, request.data(), request.size(), MSG_WAITALL) == 12) {
        answer_[0] = request[0];
        answer_[1] = request[1];
        ::send(peer, answer_.data(), answer_.size(), MSG_NOSIGNAL);
      }
    }
  }

  int listener_;
  Bytes answer_;
  std::uint16_t port_ = 0;
  std::thread server_;
};

TEST(ModbusBusOnTheWire, TcpHeaderThatIsNoModbusIsABrokenProtocol) {
  const auto word_of = [](const Bytes& answer) {
    const TcpFarEnd end(answer);
    const auto bus =
        modbus_bus::open_tcp({"127.0.0.1", end.port()}, {.response_timeout = 2000ms, .retries = 0});
    return bus->ask({"lamp", 1}, modbus_bus::read_holding_registers(0x0001));
  };
  EXPECT_THAT(word_of({0, 0, 0, 0, 0, 5, 1, 3, 2, 0x12, 0x34}), ElementsAre(0x1234));
  EXPECT_THAT(
      [&] {
        word_of({0, 0, 0, 7, 0, 5, 1, 3, 2, 0x12, 0x34});
      },
      ThrowsDeviceError(DeviceErrc::Protocol));
  EXPECT_THAT(
      [&] {
        word_of({0, 0, 0, 0, 0, 9, 1, 3, 2, 0x12, 0x34});
      },
      ThrowsDeviceError(DeviceErrc::Protocol));
}

TEST(ModbusBusOnTheWire, HostMayHaveANameAndSeveralAddresses) {
  ModbusRig rig(Family::leadshine);
  modbus_emulator::ModbusTcpServer server({}, nullptr, rig.world().clock());  // at 127.0.0.1 only
  server.add(1, modbus_emulator::lamp("lamp", rig.world().light_source()));
  const auto bus = modbus_bus::open_tcp({"localhost", server.port()});
  EXPECT_THAT(bus->ask({"lamp", 1}, modbus_bus::read_input_registers(0)), ElementsAre(312));
  EXPECT_THAT(
      [] {
        modbus_bus::open_tcp({"no host", 502});
      },
      testing::Throws<devices::DeviceError>(testing::Property(
          &devices::DeviceError::what, testing::HasSubstr("cannot find the host"))));
}

TEST(ModbusBusOnTheWire, PortsAndAddressesThatDoNotOpenAreDisconnected) {
  EXPECT_THAT([] { modbus_bus::open_rtu({"/dev/no-such-port"}); },
              ThrowsDeviceError(DeviceErrc::Disconnected));
  EXPECT_THAT([] { modbus_bus::open_rtu({"/dev/null"}); },
              testing::ThrowsMessage<devices::DeviceError>(testing::HasSubstr("no serial port")));
  ModbusRig rig(Family::leadshine);
  const auto bus = rig.rtu();
  EXPECT_THAT([&] { modbus_bus::open_rtu({rig.line().port()}); },
              ThrowsDeviceError(DeviceErrc::Disconnected));  // one master
}

}  // namespace
}  // namespace gonio::contracts
