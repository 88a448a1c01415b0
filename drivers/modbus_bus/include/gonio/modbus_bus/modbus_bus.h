#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gonio/devices/device_error.h"
#include "gonio/modbus_bus/request.h"

namespace gonio::modbus_bus {

/// Who is asked, and the name under which errors speak of it.
struct Station {
  std::string device;
  int unit = 1;  ///< 1 to 247
};

enum class Attempts {
  several,  ///< as many as the line allows
  one       ///< so that whoever stops several units is not held up by one that is dead
};

/// How a request is handled beside the others on the line.
struct Manner {
  /// Goes before all that wait, and between the attempts of others: a stop waits for one
  /// transaction at most.
  bool urgent = false;
  /// Asked again when no answer or a broken one came. False where a repetition could start a second
  /// motion.
  bool repeatable = true;
  Attempts attempts = Attempts::several;
  /// Asked when the turn has come, before anything is sent, at every attempt: true gives up with
  /// Stopped. So a motion that waited behind a stop does not start after it.
  std::function<bool()> given_up = {};
};

/// One Modbus line with everything on it. The seam at which tests put a line of their own.
///
/// Threads  All members from any thread; one transaction at a time.
/// Errors   DeviceError with the station's name. Timeout: no answer in time, or busy for too long.
///          Disconnected: the port or connection is gone or does not open. Protocol: an answer that
///          breaks the protocol, or only answers to something else. Fault: the unit refuses
///          (exceptions 01 to 04 and 07). Stopped: given up before it was sent.
class ModbusBus {
 public:
  virtual ~ModbusBus() = default;
  ModbusBus(const ModbusBus&) = delete;
  ModbusBus& operator=(const ModbusBus&) = delete;

  /// The port or address, for messages.
  virtual const std::string& line() const = 0;

  /// Sends and waits for the answer; returns what was read, nothing for a write.
  virtual std::vector<std::uint16_t> transact(const Station& station, const Request& request,
                                              const Manner& manner) = 0;

  std::vector<std::uint16_t> ask(const Station& station, const Request& request) {
    return transact(station, request, {});
  }

 protected:
  ModbusBus() = default;
};

/// What an exception of a unit means for the caller.
devices::DeviceErrc errc_of_exception(int code);

/// Whether the same request is worth sending again after this exception; the unit has not done
/// anything yet.
bool worth_repeating(int exception_code);

}  // namespace gonio::modbus_bus
