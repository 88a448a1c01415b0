#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drive_codec.h"
#include "gonio/modbus_bus/modbus_bus.h"
#include "gonio/modbus_stage/drive_profile.h"
#include "gonio/modbus_stage/modbus_stage.h"

namespace gonio::modbus_stage {

/// What is said to one drive, in the words of its profile.
///
/// Threads  stop() and those that read may be called from any; the rest from one.
/// Errors   As the bus, in the axis's name; each is told to `on_error` first.
class DriveLink {
 public:
  using OnError = std::function<void(devices::DeviceErrc)>;

  /// Throws std::invalid_argument: the profile, a name in `confirmed` that is no register, an
  /// unconfirmed register that motion needs.
  DriveLink(std::shared_ptr<modbus_bus::ModbusBus> bus, modbus_bus::Station station,
            DriveProfile profile, const std::vector<std::string>& confirmed, OnError on_error);

  const DriveProfile& profile() const { return profile_; }

  /// Throws std::invalid_argument for numbers that the words of `command` cannot hold.
  void require_encodable(const Command& command, const MoveNumbers& numbers) const;

  /// Throws Protocol where a setting is not what the profile counts on.
  void require_expected_settings();

  /// `steps` of a moving axis only when asked for: it costs a transaction.
  DriveState state(bool with_steps_of_moving);
  /// The feedback alone, also of a moving axis.
  std::int64_t steps();
  /// Of the drive's present alarm, for a message.
  std::string alarm_text();
  /// "; the forward limit switch is on", or nothing.
  std::string limit_text();
  /// In the register's unit; 0 where the profile has none.
  double following_error();

  /// A motion is given up as soon as `given_up` says so.
  void command(const Command& command, const MoveNumbers& numbers = {},
               const std::function<bool()>& given_up = {});
  /// As command(), but nothing is sent twice, whatever became of the first.
  void command_once(const Command& command, const MoveNumbers& numbers,
                    const std::function<bool()>& given_up);
  /// Urgently.
  void stop(modbus_bus::Attempts attempts);

 private:
  void leave_out_unconfirmed(const std::vector<std::string>& confirmed);
  std::vector<std::uint16_t> ask(const modbus_bus::Request& request,
                                 const modbus_bus::Manner& manner);
  std::int64_t read(const std::string& register_name);

  std::shared_ptr<modbus_bus::ModbusBus> bus_;
  modbus_bus::Station station_;
  DriveProfile profile_;
  OnError on_error_;
};

}  // namespace gonio::modbus_stage
