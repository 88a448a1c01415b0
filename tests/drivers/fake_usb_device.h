#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gonio/usb_bus/usb_device.h"

namespace gonio::usb_bus {

/// Records what is sent and gives what it was told to. Nothing left to give: Timeout.
class FakeUsbDevice : public UsbDevice {
 public:
  using Bytes = std::vector<std::uint8_t>;

  const std::string& name() const override { return name_; }
  UsbLayout layout() const override { return layout_; }
  bool connected() const noexcept override { return connected_; }
  void disconnect() noexcept override { connected_ = false; }
  void reconnect(Deadline) override {
    ++reconnections;
    connected_ = true;
  }

  std::size_t control(const ControlSetup& setup, std::span<std::uint8_t> data,
                      Deadline deadline) override {
    require_connected();
    if (on_deadline) on_deadline(deadline);
    controls.push_back(setup);
    const Bytes reply = on_control ? on_control(setup) : Bytes{};
    const std::size_t count = std::min(reply.size(), data.size());
    std::copy_n(reply.begin(), count, data.begin());
    return (setup.request_type & 0x80U) != 0 ? count : data.size();
  }
  void bulk_out(std::span<const std::uint8_t> bytes, Deadline) override {
    require_connected();
    sent.emplace_back(bytes.begin(), bytes.end());
    if (on_sent) on_sent(sent.back());
  }
  std::size_t bulk_in(std::span<std::uint8_t> room, Deadline deadline) override {
    require_connected();
    if (on_deadline) on_deadline(deadline);
    if (to_give.empty()) throw devices::DeviceError(devices::DeviceErrc::Timeout, name_, "nothing");
    const Bytes given = std::move(to_give.front());
    to_give.pop_front();
    std::copy(given.begin(), given.end(), room.begin());
    return given.size();
  }
  void clear_halt(Direction direction) override {
    require_connected();
    cleared.push_back(direction);
  }

  void unplug() { connected_ = false; }

  UsbLayout layout_;
  std::vector<ControlSetup> controls;
  std::vector<Bytes> sent;
  std::vector<Direction> cleared;
  std::deque<Bytes> to_give;  ///< one for each inward transfer
  std::function<Bytes(const ControlSetup&)> on_control;
  std::function<void(const Bytes&)> on_sent;
  std::function<void(Deadline)> on_deadline;  ///< of a control or an inward transfer
  int reconnections = 0;

 private:
  void require_connected() const {
    if (!connected_) {
      throw devices::DeviceError(devices::DeviceErrc::Disconnected, name_, "unplugged");
    }
  }

  std::string name_ = "fake";
  bool connected_ = true;
};

}  // namespace gonio::usb_bus
