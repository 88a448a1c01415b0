#include "frame_sequence.h"

namespace gonio::aravis_camera {
namespace {

constexpr std::uint64_t kLargest16Bit = 0xFFFF;
// Arrival differs by what a frame takes on the way, far below this.
constexpr std::chrono::nanoseconds kSteady = std::chrono::milliseconds(500);
// Quartz against quartz, generously.
constexpr double kDrift = 1e-3;

/// Steps from `last` to `id`, negative backwards.
std::int64_t steps(std::uint64_t last, std::uint64_t id) {
  const auto plain = static_cast<std::int64_t>(id - last);
  const bool may_be_16_bit = last <= kLargest16Bit && id <= kLargest16Bit;
  // A camera with wide ids goes on to 65536; more than half the range either way is a wrap.
  if (!may_be_16_bit || (plain > -0x8000 && plain < 0x8000)) return plain;
  const bool counts_zero = id == 0 || last == 0;
  const std::int64_t range = counts_zero ? 0x10000 : 0xFFFF;
  return plain < 0 ? plain + range : plain - range;
}

}  // namespace

FrameSequence::Verdict FrameSequence::next(std::uint64_t id, std::uint64_t timestamp_ns,
                                           std::chrono::nanoseconds host) {
  Verdict verdict;
  const std::optional<Seen> last = last_;
  last_ = Seen{id, timestamp_ns, host};
  if (!last) return verdict;

  const std::int64_t forward = steps(last->id, id);
  if (forward <= 0) {
    verdict.problem = forward == 0 ? "carries the frame id of the one before, " + std::to_string(id)
                                   : "frame id went back from " + std::to_string(last->id) +
                                         " to " + std::to_string(id);
    // A late or repeated frame is no new place to count from.
    last_->id = last->id;
  } else {
    verdict.missing = static_cast<std::uint64_t>(forward) - 1;
  }

  if (timestamp_ns == 0 || last->timestamp_ns == 0) return verdict;
  const auto camera =
      std::chrono::nanoseconds(static_cast<std::int64_t>(timestamp_ns - last->timestamp_ns));
  const auto passed = host - last->host;
  const auto allowed = kSteady + std::chrono::nanoseconds(static_cast<std::int64_t>(
                                     kDrift * static_cast<double>(passed.count())));
  verdict.jump = camera > passed + allowed || camera < passed - allowed;
  if (camera.count() <= 0 && verdict.problem.empty()) {
    verdict.problem = "its time stamp is not later than that of the frame before";
  }
  return verdict;
}

}  // namespace gonio::aravis_camera
