#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// The Thorlabs APT protocol as pure functions.
///
/// Source   Thorlabs, "Motion Controllers Host-Controller Communications Protocol", issue 25; names
///          are those of the document without MGMSG_. All numbers are little-endian.
namespace gonio::apt_stage {

enum class MessageId : std::uint16_t {
  HW_REQ_INFO = 0x0005,
  HW_GET_INFO = 0x0006,
  HW_STOP_UPDATEMSGS = 0x0012,
  HW_NO_FLASH_PROGRAMMING = 0x0018,
  HW_RESPONSE = 0x0080,
  HW_RICHRESPONSE = 0x0081,
  MOD_SET_CHANENABLESTATE = 0x0210,
  MOD_REQ_CHANENABLESTATE = 0x0211,
  MOD_GET_CHANENABLESTATE = 0x0212,
  MOT_REQ_POSCOUNTER = 0x0411,
  MOT_GET_POSCOUNTER = 0x0412,
  MOT_SET_VELPARAMS = 0x0413,
  MOT_REQ_VELPARAMS = 0x0414,
  MOT_GET_VELPARAMS = 0x0415,
  MOT_REQ_STATUSBITS = 0x0429,
  MOT_GET_STATUSBITS = 0x042A,
  MOT_SET_HOMEPARAMS = 0x0440,
  MOT_REQ_HOMEPARAMS = 0x0441,
  MOT_GET_HOMEPARAMS = 0x0442,
  MOT_MOVE_HOME = 0x0443,
  MOT_MOVE_HOMED = 0x0444,
  MOT_MOVE_ABSOLUTE = 0x0453,
  MOT_MOVE_COMPLETED = 0x0464,
  MOT_MOVE_STOP = 0x0465,
  MOT_MOVE_STOPPED = 0x0466,
  MOT_REQ_DCSTATUSUPDATE = 0x0490,
  MOT_GET_DCSTATUSUPDATE = 0x0491,
  MOT_ACK_DCSTATUSUPDATE = 0x0492,
};

// Addresses: the host and a single-channel unit on USB; bit 7 of the destination says that data
// follow the header.
inline constexpr std::uint8_t kHost = 0x01;
inline constexpr std::uint8_t kUnit = 0x50;
inline constexpr std::uint8_t kDataFollow = 0x80;
inline constexpr std::uint16_t kChannel = 1;

using Bytes = std::vector<std::uint8_t>;

/// One message, taken apart. Without data the header carries two parameters in their place.
struct Message {
  std::uint16_t id = 0;
  std::uint8_t param1 = 0;
  std::uint8_t param2 = 0;
  std::uint8_t destination = kUnit;  ///< without kDataFollow
  std::uint8_t source = kHost;
  Bytes data;  ///< at most 65535 bytes

  bool is(MessageId wanted) const { return id == static_cast<std::uint16_t>(wanted); }
  friend bool operator==(const Message&, const Message&) = default;
};

/// The bytes on the wire: 6 of header, then the data.
Bytes encode(const Message& message);

// Messages to the unit. Positions in its microsteps, velocities and accelerations in its own units.

struct VelocityParams {
  std::int32_t minimum = 0;
  std::int32_t acceleration = 0;
  std::int32_t maximum = 0;
  friend bool operator==(const VelocityParams&, const VelocityParams&) = default;
};

struct HomeParams {
  std::uint16_t direction = 2;     ///< 1 forward, 2 reverse
  std::uint16_t limit_switch = 1;  ///< 1 reverse, 4 forward hardware switch
  std::int32_t velocity = 0;
  std::int32_t offset = 0;  ///< from the switch to zero
  friend bool operator==(const HomeParams&, const HomeParams&) = default;
};

enum class StopMode : std::uint8_t { immediate = 1, profiled = 2 };

/// A message without data; the parameters are mostly a channel.
Bytes short_message(MessageId id, std::uint8_t param1 = 0, std::uint8_t param2 = 0);
Bytes enable_channel(bool enabled);
Bytes set_velocity(const VelocityParams& params);
Bytes set_home(const HomeParams& params);
Bytes move_home();
Bytes move_absolute(std::int32_t position);
Bytes move_stop(StopMode mode);
Bytes request_status();
Bytes acknowledge_status();

/// Whether a message from the unit is about kChannel, or, as HW_GET_INFO, about none.
bool is_of_our_channel(const Message& message);

// Messages from the unit; nothing when the message is another or has another length.

struct HardwareInfo {
  std::uint32_t serial = 0;
  std::string model;  ///< "K10CR1"
  std::uint16_t type = 0;
  std::string firmware;  ///< "1.0.3"
  std::uint16_t hardware_version = 0;
  std::uint16_t modification = 0;
  std::uint16_t channels = 0;
};

// Status bits of MOT_GET_DCSTATUSUPDATE and its relatives.
namespace status {
inline constexpr std::uint32_t kForwardLimit = 1U << 0U;
inline constexpr std::uint32_t kReverseLimit = 1U << 1U;
inline constexpr std::uint32_t kForwardSoftLimit = 1U << 2U;
inline constexpr std::uint32_t kReverseSoftLimit = 1U << 3U;
inline constexpr std::uint32_t kMovingForward = 1U << 4U;
inline constexpr std::uint32_t kMovingReverse = 1U << 5U;
inline constexpr std::uint32_t kJoggingForward = 1U << 6U;
inline constexpr std::uint32_t kJoggingReverse = 1U << 7U;
inline constexpr std::uint32_t kConnected = 1U << 8U;
inline constexpr std::uint32_t kHoming = 1U << 9U;
inline constexpr std::uint32_t kHomed = 1U << 10U;
inline constexpr std::uint32_t kTracking = 1U << 12U;
inline constexpr std::uint32_t kSettled = 1U << 13U;
inline constexpr std::uint32_t kPositionError = 1U << 14U;
inline constexpr std::uint32_t kInterlock = 1U << 16U;
inline constexpr std::uint32_t kOverheat = 1U << 17U;
inline constexpr std::uint32_t kOverload = 1U << 24U;
inline constexpr std::uint32_t kPowerOk = 1U << 28U;
inline constexpr std::uint32_t kActive = 1U << 29U;
inline constexpr std::uint32_t kEnabled = 1U << 31U;

inline constexpr std::uint32_t kLimits = kForwardLimit | kReverseLimit;
inline constexpr std::uint32_t kInMotion =
    kMovingForward | kMovingReverse | kJoggingForward | kJoggingReverse | kHoming;
}  // namespace status

/// The bits that are set, for people: "moving forward, homed".
std::string describe_status(std::uint32_t bits);

struct StatusUpdate {
  std::int32_t position = 0;
  std::uint16_t velocity = 0;
  std::uint32_t bits = 0;

  bool has(std::uint32_t any_of) const { return (bits & any_of) != 0; }
};

std::optional<HardwareInfo> hardware_info(const Message& message);
std::optional<VelocityParams> velocity_params(const Message& message);
std::optional<HomeParams> home_params(const Message& message);
/// Of MOT_GET_DCSTATUSUPDATE, MOT_MOVE_COMPLETED or MOT_MOVE_STOPPED.
std::optional<StatusUpdate> status_update(const Message& message);

}  // namespace gonio::apt_stage
