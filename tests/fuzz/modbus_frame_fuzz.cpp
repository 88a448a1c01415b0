// Both ends of Modbus: answers as the driver reads them, and requests as the emulated devices do.

#include <chrono>
#include <cstdlib>
#include <span>
#include <vector>

#include "gonio/devices/steady_clock.h"
#include "gonio/modbus_bus/request.h"
#include "gonio/modbus_emulator/devices.h"
#include "gonio/modbus_emulator/frames.h"
#include "trial.h"

namespace {

using Bytes = std::span<const std::uint8_t>;

class Dark final : public gonio::devices::LightSource {
 public:
  const std::string& name() const override { return name_; }
  std::vector<gonio::devices::LightChannel> channels() const override {
    return {{"R", 630.0}, {"G", 530.0}};
  }
  void light(const std::string&) override {}
  void close_shutter() noexcept override {}

 private:
  std::string name_ = "lamp";
};

void read_as_answer(Bytes bytes) {
  namespace bus = gonio::modbus_bus;
  const bus::Request requests[] = {bus::read_coils(3, 19),
                                   bus::read_holding_registers(0x1014, 2),
                                   bus::read_input_registers(0, 125),
                                   bus::write_coil(7, true),
                                   bus::write_register(0x6002, 0x40),
                                   bus::write_registers(0x58, {1, 2, 3})};
  for (const bus::Request& request : requests) {
    const bus::Answer answer = bus::decode(1, request, bytes);
    const std::size_t expected = request.reads() ? request.count : 0U;
    if (answer.kind == bus::Answer::Kind::good && answer.words.size() != expected) std::abort();
  }
}

void ask_devices(Bytes bytes) {
  namespace emulator = gonio::modbus_emulator;
  gonio::devices::SteadyClock clock;
  gonio::rig::Axis axis;
  axis.name = "tilt";
  axis.min = gonio::Angle::from_degrees(-90.0);
  axis.max = gonio::Angle::from_degrees(90.0);
  gonio::sim::Joint joint(axis, {}, 1, 0);
  Dark light;
  const emulator::DriveMechanics mechanics{&joint, &clock, {}, 100.0, false};
  const std::unique_ptr<emulator::RegisterDevice> devices[] = {
      emulator::leadshine_drive("tilt", mechanics, nullptr),
      emulator::az_drive("tilt", mechanics, nullptr), emulator::lamp("lamp", light)};
  // A stream of requests, each of as many bytes as its first says.
  while (!bytes.empty()) {
    const std::size_t length = std::min<std::size_t>(bytes[0], bytes.size() - 1);
    for (const auto& device : devices) {
      const auto reply = emulator::answer(*device, bytes.subspan(1, length));
      if (reply.empty() || reply.size() > 253) std::abort();
    }
    bytes = bytes.subspan(1 + length);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace emulator = gonio::modbus_emulator;
  const Bytes bytes(data, size);
  read_as_answer(bytes);
  emulator::rtu_request_length(bytes);
  emulator::crc_fits(bytes);
  emulator::TcpRequest request;
  if (emulator::tcp_request(bytes, request) == emulator::TcpState::whole && request.length > size) {
    std::abort();
  }
  ask_devices(bytes);
  return 0;
}
