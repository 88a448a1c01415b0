#include "gonio/usbtmc_monitor/usbtmc_monitor.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>

#include "gonio/usbtmc_monitor/scpi.h"
#include "usbtmc_pipe.h"

namespace gonio::usbtmc_monitor {

using devices::DeviceErrc;
using devices::DeviceError;

UsbtmcMonitor::UsbtmcMonitor(std::shared_ptr<usb_bus::UsbDevice> device, MonitorOptions options,
                             HostClock now)
    : name_(device->name()),
      options_(std::move(options)),
      pipe_(std::make_unique<UsbtmcPipe>(std::move(device), options_.answer, std::move(now))) {
  if (options_.query.empty()) {
    throw std::invalid_argument(name_ + ": query: found none, expected a command");
  }
  if (!std::isfinite(options_.zero)) {
    throw std::invalid_argument(name_ + ": zero: expected a finite number");
  }
  if (options_.answer.count() <= 0) {
    throw std::invalid_argument(name_ + ": answer: expected a time above 0");
  }
  identity_ = identify();
}

UsbtmcMonitor::~UsbtmcMonitor() = default;

template <class Question>
auto UsbtmcMonitor::repeated(Question question, const std::function<void()>& before_giving_up) {
  for (int attempt = 1;; ++attempt) {
    try {
      return question();
    } catch (const DeviceError& error) {
      const bool may_help =
          error.code() == DeviceErrc::Timeout || error.code() == DeviceErrc::Protocol;
      if (!may_help) throw;
      pipe_->recover();
      if (attempt < kAttempts && !pipe_->time_is_up()) continue;
      before_giving_up();
      throw;
    }
  }
}

void UsbtmcMonitor::begin() { pipe_->begin((kAttempts + 1) * options_.answer + kRecovery); }

InstrumentIdentity UsbtmcMonitor::identify() {
  begin();
  pipe_->recover();  // another program may have left an answer half read
  const std::string answer = printable(repeated([this] { return pipe_->query("*IDN?\n"); }, [] {}));
  std::array<std::string, 4> fields;
  std::size_t begin = 0;
  for (std::string& field : fields) {
    const std::size_t comma = std::min(answer.find(',', begin), answer.size());
    field = answer.substr(begin, comma - begin);
    begin = std::min(comma + 1, answer.size());
  }
  if (fields[1].empty()) {
    throw DeviceError(DeviceErrc::Protocol, name_,
                      fmt::format("*IDN? gave \"{}\", expected maker, model, serial, firmware; is "
                                  "this an SCPI instrument?",
                                  answer));
  }
  pipe_->send("*CLS\n");  // errors from here on are ours
  return {fields[0], fields[1], fields[2], fields[3]};
}

void UsbtmcMonitor::reconnect() {
  pipe_->device().reconnect(kReconnect);
  try {
    const InstrumentIdentity found = identify();
    if (found.serial != identity_.serial) {
      throw DeviceError(DeviceErrc::Protocol, name_,
                        fmt::format("instrument {} came back as {}; plug the right one in",
                                    identity_.serial, found.serial));
    }
    identity_ = found;
  } catch (...) {
    pipe_->device().disconnect();  // the next reading looks for it again
    throw;
  }
}

double UsbtmcMonitor::read() {
  if (!pipe_->device().connected()) reconnect();
  begin();
  return repeated([this] { return read_once(); }, [this] { require_no_error(); });
}

double UsbtmcMonitor::read_once() {
  const std::string answer = pipe_->query(options_.query + "\n");
  const std::optional<double> value = scpi_number(answer);
  if (!value) {
    throw DeviceError(
        DeviceErrc::Protocol, name_,
        fmt::format("{} gave \"{}\", expected a number", options_.query, printable(answer)));
  }
  if (is_out_of_range(*value)) {
    throw DeviceError(
        DeviceErrc::Fault, name_,
        fmt::format("out of range ({}); set its range for the lamp", printable(answer)));
  }
  return *value - options_.zero;
}

void UsbtmcMonitor::require_no_error() {
  std::optional<ScpiError> found;
  try {
    found = scpi_error(pipe_->query("SYST:ERR?\n"));
  } catch (const DeviceError&) {
    return;  // the first error says more
  }
  if (!found || found->code == 0) return;
  throw DeviceError(DeviceErrc::Fault, name_,
                    fmt::format("the instrument reports {}, \"{}\"; check the query \"{}\"",
                                found->code, found->message, options_.query));
}

}  // namespace gonio::usbtmc_monitor
