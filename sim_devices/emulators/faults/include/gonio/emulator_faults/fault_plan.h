#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Faults that an emulated device shows on request, as data.
namespace gonio::emulator_faults {

/// What goes wrong. Which devices can show it stands beside each.
enum class Fault {
  dead_link,           ///< no answer at all: Modbus, USB transfers, camera control
  exception,           ///< a Modbus exception instead of an answer
  crc_error,           ///< Modbus RTU: the answer's checksum is wrong
  late_reply,          ///< Modbus: the answer comes after the master's deadline
  torn_reply,          ///< Modbus, USB: only the first half of an answer
  foreign_reply,       ///< Modbus: another unit's or another request's answer
  stall,               ///< USB: the endpoint stalls
  unplug,              ///< USB: the device leaves the bus; comes back when the fault wears off
  alarm,               ///< a drive: raises its alarm, brakes
  limit_switch,        ///< a drive: runs into its limit switch, brakes
  lost_move,           ///< USB: the stage does not hear the command to move
  lost_steps,          ///< a drive: when it begins to home, it was turned without its count knowing
  never_in_position,   ///< a drive: never says that it has arrived
  stop_ignored,        ///< a drive: a stop command changes nothing
  power_cycle,         ///< a drive: was without power for a moment: stands, not homed, no alarm
  lost_packets,        ///< a camera: packets of a frame are missing
  wrong_exposure,      ///< a camera: applies another exposure than it was set to
  duplicate_frame_id,  ///< a camera: a frame carries the id of the one before
  no_frame             ///< a camera: a trigger gives no frame
};

std::string_view to_string(Fault fault);

/// When one fault strikes. A rule is asked at every opportunity (a request, a move, a frame).
struct FaultRule {
  Fault fault{};
  std::string device;                  ///< name of the emulated device; empty: all
  double after_s = 0.0;                ///< world's time before which nothing happens
  std::optional<double> for_s;         ///< from then on; none: until `count` is used up
  std::uint64_t skip = 0;              ///< opportunities let pass first, within that time
  std::optional<std::uint64_t> count;  ///< times it strikes; none: every time
  double probability = 1.0;            ///< of each opportunity
  double degrees = 0.0;                ///< of lost_steps alone: how far the joint was turned

  /// Throws std::invalid_argument naming the field, what was found and what is expected.
  void validate() const;
};

/// A rule as the command line writes it: NAME[@DEVICE][:after_s=N,for_s=N,skip=N,count=N,
/// probability=P,degrees=N], for example "late_reply@tilt:after_s=5,count=3". Throws
/// std::invalid_argument naming the text, what was found and what is expected.
FaultRule fault_rule_from_text(std::string_view text);

/// All rules of an emulated rig.
///
/// Threads  All members from any thread.
class FaultPlan {
 public:
  /// `seed` of the probabilities: the same opportunities in the same order give the same strikes.
  explicit FaultPlan(std::vector<FaultRule> rules = {}, std::uint64_t seed = 1);

  /// From now on this rule holds too. Throws as FaultRule::validate().
  void add(FaultRule rule);

  /// Takes one opportunity: does `fault` strike `device` at `now` (the world's time)?
  bool strikes(Fault fault, std::string_view device, std::chrono::nanoseconds now);

  /// As strikes(), of lost_steps: how far the axis was turned, 0 where nothing strikes.
  double lost_steps_deg(std::string_view device, std::chrono::nanoseconds now);

  /// From now on nothing goes wrong any more.
  void mend();

  /// How often `fault` has struck, on all devices, by rules that hold.
  std::uint64_t struck(Fault fault) const;

  /// When any fault struck first, the world's time; nothing: none has.
  std::optional<std::chrono::nanoseconds> first_struck() const;

 private:
  using WhenStruck = std::function<void(const FaultRule&)>;
  void take_opportunity(Fault fault, std::string_view device, std::chrono::nanoseconds now,
                        const WhenStruck& when_struck);

  struct State {
    FaultRule rule;
    std::uint64_t opportunities = 0;
    std::uint64_t struck = 0;
  };

  mutable std::mutex mutex_;
  std::vector<State> rules_;
  std::uint64_t seed_;
  std::optional<std::chrono::nanoseconds> first_struck_;
};

}  // namespace gonio::emulator_faults
