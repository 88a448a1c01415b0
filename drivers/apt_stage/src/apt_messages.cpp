#include "gonio/apt_stage/apt_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>

namespace gonio::apt_stage {
namespace {

constexpr std::size_t kInfoBytes = 84;
constexpr std::size_t kVelocityBytes = 14;
constexpr std::size_t kHomeBytes = 14;
constexpr std::size_t kStatusBytes = 14;

/// Appends numbers, lowest byte first.
class Writer {
 public:
  template <class Number>
  Writer& put(Number number) {
    const auto bits = static_cast<std::uint32_t>(number);
    for (std::size_t byte = 0; byte < sizeof(Number); ++byte) {
      bytes_.push_back(static_cast<std::uint8_t>(bits >> (8 * byte)));
    }
    return *this;
  }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

template <class Number>
Number number_at(const Bytes& data, std::size_t offset) {
  std::uint32_t bits = 0;
  for (std::size_t byte = 0; byte < sizeof(Number); ++byte) {
    bits |= std::uint32_t{data.at(offset + byte)} << (8 * byte);
  }
  return static_cast<Number>(bits);
}

Bytes long_message(MessageId id, Bytes data) {
  Message message;
  message.id = static_cast<std::uint16_t>(id);
  message.data = std::move(data);
  return encode(message);
}

bool has_data(const Message& message, MessageId id, std::size_t size) {
  return message.is(id) && message.data.size() == size;
}

/// Up to the first NUL, printable characters only: it ends up in messages and files.
std::string text_at(const Bytes& data, std::size_t offset, std::size_t size) {
  std::string text;
  for (const std::uint8_t byte : std::span(data).subspan(offset, size)) {
    if (byte == 0) break;
    text.push_back(byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '?');
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

}  // namespace

Bytes encode(const Message& message) {
  Writer out;
  out.put(message.id);
  if (message.data.empty()) {
    out.put(message.param1).put(message.param2).put(message.destination);
  } else {
    out.put(static_cast<std::uint16_t>(message.data.size()));
    out.put(static_cast<std::uint8_t>(message.destination | kDataFollow));
  }
  out.put(message.source);
  Bytes bytes = out.take();
  bytes.insert(bytes.end(), message.data.begin(), message.data.end());
  return bytes;
}

Bytes short_message(MessageId id, std::uint8_t param1, std::uint8_t param2) {
  Message message;
  message.id = static_cast<std::uint16_t>(id);
  message.param1 = param1;
  message.param2 = param2;
  return encode(message);
}

Bytes enable_channel(bool enabled) {
  return short_message(MessageId::MOD_SET_CHANENABLESTATE, kChannel, enabled ? 1 : 2);
}

Bytes set_velocity(const VelocityParams& params) {
  return long_message(MessageId::MOT_SET_VELPARAMS, Writer()
                                                        .put(kChannel)
                                                        .put(params.minimum)
                                                        .put(params.acceleration)
                                                        .put(params.maximum)
                                                        .take());
}

Bytes set_home(const HomeParams& params) {
  return long_message(MessageId::MOT_SET_HOMEPARAMS, Writer()
                                                         .put(kChannel)
                                                         .put(params.direction)
                                                         .put(params.limit_switch)
                                                         .put(params.velocity)
                                                         .put(params.offset)
                                                         .take());
}

Bytes move_home() { return short_message(MessageId::MOT_MOVE_HOME, kChannel); }

Bytes move_absolute(std::int32_t position) {
  return long_message(MessageId::MOT_MOVE_ABSOLUTE, Writer().put(kChannel).put(position).take());
}

Bytes move_stop(StopMode mode) {
  return short_message(MessageId::MOT_MOVE_STOP, kChannel, static_cast<std::uint8_t>(mode));
}

Bytes request_status() { return short_message(MessageId::MOT_REQ_DCSTATUSUPDATE, kChannel); }

Bytes acknowledge_status() { return short_message(MessageId::MOT_ACK_DCSTATUSUPDATE); }

std::string describe_status(std::uint32_t bits) {
  static constexpr std::array<std::pair<std::uint32_t, const char*>, 20> kNames{{
      {status::kForwardLimit, "forward limit switch"},
      {status::kReverseLimit, "reverse limit switch"},
      {status::kForwardSoftLimit, "forward soft limit"},
      {status::kReverseSoftLimit, "reverse soft limit"},
      {status::kMovingForward, "moving forward"},
      {status::kMovingReverse, "moving in reverse"},
      {status::kJoggingForward, "jogging forward"},
      {status::kJoggingReverse, "jogging in reverse"},
      {status::kConnected, "motor connected"},
      {status::kHoming, "homing"},
      {status::kHomed, "homed"},
      {status::kTracking, "tracking"},
      {status::kSettled, "settled"},
      {status::kPositionError, "position error"},
      {status::kInterlock, "interlock"},
      {status::kOverheat, "overheated"},
      {status::kOverload, "overload"},
      {status::kPowerOk, "power ok"},
      {status::kActive, "active"},
      {status::kEnabled, "enabled"},
  }};
  std::string text;
  for (const auto& [bit, name] : kNames) {
    if ((bits & bit) != 0) text += (text.empty() ? "" : ", ") + std::string(name);
  }
  return text.empty() ? "none" : text;
}

bool is_of_our_channel(const Message& message) {
  if (message.is(MessageId::MOT_MOVE_HOMED) || message.is(MessageId::MOD_GET_CHANENABLESTATE)) {
    return message.param1 == kChannel;
  }
  // All data about the motor begin with its channel.
  const bool of_motor = (message.id & 0xFF00U) == 0x0400U && message.data.size() >= 2;
  return !of_motor || number_at<std::uint16_t>(message.data, 0) == kChannel;
}

std::optional<HardwareInfo> hardware_info(const Message& message) {
  if (!has_data(message, MessageId::HW_GET_INFO, kInfoBytes)) return std::nullopt;
  const Bytes& data = message.data;
  HardwareInfo info;
  info.serial = number_at<std::uint32_t>(data, 0);
  info.model = text_at(data, 4, 8);
  info.type = number_at<std::uint16_t>(data, 12);
  info.firmware = fmt::format("{}.{}.{}", data[16], data[15], data[14]);
  info.hardware_version = number_at<std::uint16_t>(data, 78);
  info.modification = number_at<std::uint16_t>(data, 80);
  info.channels = number_at<std::uint16_t>(data, 82);
  return info;
}

std::optional<VelocityParams> velocity_params(const Message& message) {
  if (!has_data(message, MessageId::MOT_GET_VELPARAMS, kVelocityBytes)) return std::nullopt;
  return VelocityParams{number_at<std::int32_t>(message.data, 2),
                        number_at<std::int32_t>(message.data, 6),
                        number_at<std::int32_t>(message.data, 10)};
}

std::optional<HomeParams> home_params(const Message& message) {
  if (!has_data(message, MessageId::MOT_GET_HOMEPARAMS, kHomeBytes)) return std::nullopt;
  return HomeParams{
      number_at<std::uint16_t>(message.data, 2), number_at<std::uint16_t>(message.data, 4),
      number_at<std::int32_t>(message.data, 6), number_at<std::int32_t>(message.data, 10)};
}

std::optional<StatusUpdate> status_update(const Message& message) {
  for (const MessageId id : {MessageId::MOT_GET_DCSTATUSUPDATE, MessageId::MOT_MOVE_COMPLETED,
                             MessageId::MOT_MOVE_STOPPED}) {
    if (!has_data(message, id, kStatusBytes)) continue;
    return StatusUpdate{number_at<std::int32_t>(message.data, 2),
                        number_at<std::uint16_t>(message.data, 6),
                        number_at<std::uint32_t>(message.data, 10)};
  }
  return std::nullopt;
}

}  // namespace gonio::apt_stage
