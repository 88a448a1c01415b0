#include "gonio/apt_stage/apt_decoder.h"

#include <algorithm>
#include <array>

namespace gonio::apt_stage {
namespace {

constexpr std::size_t kHeaderBytes = 6;
// The longest message of the document to the host; a longer claim is garbage, not worth waiting
// for.
constexpr std::size_t kLongestData = 255;
constexpr std::uint8_t kRackController = 0x11;  // sources besides kUnit: bays 1 to 10 follow 0x21
constexpr std::uint8_t kFirstBay = 0x21;
constexpr std::uint8_t kLastBay = 0x2A;

struct KnownLength {
  MessageId id;
  std::size_t data_bytes;  // 0: no data
};

constexpr std::array<KnownLength, 12> kFromUnit{{
    {MessageId::HW_GET_INFO, 84},
    {MessageId::HW_RESPONSE, 0},
    {MessageId::HW_RICHRESPONSE, 68},
    {MessageId::MOD_GET_CHANENABLESTATE, 0},
    {MessageId::MOT_GET_POSCOUNTER, 6},
    {MessageId::MOT_GET_VELPARAMS, 14},
    {MessageId::MOT_GET_STATUSBITS, 6},
    {MessageId::MOT_GET_HOMEPARAMS, 14},
    {MessageId::MOT_MOVE_HOMED, 0},
    {MessageId::MOT_MOVE_COMPLETED, 14},
    {MessageId::MOT_MOVE_STOPPED, 14},
    {MessageId::MOT_GET_DCSTATUSUPDATE, 14},
}};

bool is_unit(std::uint8_t source) {
  return source == kUnit || source == kRackController ||
         (source >= kFirstBay && source <= kLastBay);
}

}  // namespace

void AptDecoder::feed(std::span<const std::uint8_t> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

std::optional<Message> AptDecoder::next() {
  for (; bytes_.size() >= kHeaderBytes; bytes_.pop_front(), ++skipped_) {
    Message message;
    message.id = static_cast<std::uint16_t>(bytes_[0] | (bytes_[1] << 8U));
    message.destination = static_cast<std::uint8_t>(bytes_[4] & ~kDataFollow);
    message.source = bytes_[5];
    if (message.destination != kHost || !is_unit(message.source)) continue;
    std::size_t data_bytes = 0;
    if ((bytes_[4] & kDataFollow) != 0) {
      data_bytes = static_cast<std::size_t>(bytes_[2] | (bytes_[3] << 8U));
      if (data_bytes == 0 || data_bytes > kLongestData) continue;
    } else {
      message.param1 = bytes_[2];
      message.param2 = bytes_[3];
    }
    const auto* const known =
        std::find_if(kFromUnit.begin(), kFromUnit.end(),
                     [&](const KnownLength& entry) { return message.is(entry.id); });
    if (known != kFromUnit.end() && known->data_bytes != data_bytes) continue;
    if (bytes_.size() < kHeaderBytes + data_bytes) return std::nullopt;
    const auto data = bytes_.begin() + kHeaderBytes;
    const auto end = data + static_cast<std::ptrdiff_t>(data_bytes);
    message.data.assign(data, end);
    bytes_.erase(bytes_.begin(), end);
    return message;
  }
  return std::nullopt;
}

}  // namespace gonio::apt_stage
