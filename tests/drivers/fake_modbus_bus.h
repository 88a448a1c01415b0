#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gonio/modbus_bus/modbus_bus.h"

namespace gonio::modbus_bus {

/// A bus of one unit that remembers what it was sent. Registers and coils hold what was written,
/// unless `on_write` makes a device of them.
class FakeBus final : public ModbusBus {
 public:
  struct Write {
    Request request;
    bool urgent;
    bool repeatable;
    Attempts attempts;
  };

  std::map<std::uint16_t, std::uint16_t> registers;
  std::map<std::uint16_t, std::uint16_t> coils;
  std::vector<Write> writes;
  std::function<void(const Request&)> on_write;
  std::function<void(const Request&)> on_read;     ///< before the answer
  std::optional<devices::DeviceErrc> fails;        ///< every transaction from now on
  std::function<bool(const Request&)> fails_only;  ///< of these; none: of all

  const std::string& line() const override { return line_; }

  std::vector<std::uint16_t> transact(const Station& station, const Request& request,
                                      const Manner& manner) override {
    if (manner.given_up && manner.given_up()) {
      throw devices::DeviceError(devices::DeviceErrc::Stopped, station.device, "given up");
    }
    if (fails && (!fails_only || fails_only(request))) {
      throw devices::DeviceError(*fails, station.device, "as the test wants it");
    }
    auto& table =
        request.function == Function::read_coils || request.function == Function::write_coil
            ? coils
            : registers;
    if (request.reads()) {
      if (on_read) on_read(request);
      std::vector<std::uint16_t> words;
      for (std::size_t i = 0; i < request.count; ++i) {
        words.push_back(table[static_cast<std::uint16_t>(request.address + i)]);
      }
      return words;
    }
    for (std::size_t i = 0; i < request.words.size(); ++i) {
      table[static_cast<std::uint16_t>(request.address + i)] = request.words[i];
    }
    writes.push_back({request, manner.urgent, manner.repeatable, manner.attempts});
    if (on_write) on_write(request);
    return {};
  }

 private:
  std::string line_ = "fake";
};

}  // namespace gonio::modbus_bus
