#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bracket.h"
#include "gonio/acquisition/guarded_devices.h"
#include "gonio/acquisition/trust_notes.h"

namespace gonio::acquisition {

/// So many of its uncertainties make a change of the sentinel a step: one false alarm in 16,000
/// comparisons, were the uncertainty all noise.
inline constexpr double kStepSigmas = 4.0;

/// Looks, in the course of a session, whether the rig still is what it was: axes against their home
/// marks, the light and the sample at the sentinel, the lamp at its monitor. What it finds goes
/// into notes; `distrust` is told first, so that a kill in between leaves no check that looks
/// passed.
///
/// Threads  One.
/// Errors   devices::DeviceError.
class TrustChecks {
 public:
  using Distrust = std::function<void(const std::string& why)>;

  /// All that is passed by reference must outlive it.
  TrustChecks(GuardedDevices& devices, const instrument::Instrument& instrument,
              const MeasurementPlan& plan, const SessionOptions& options, SessionWriter& archive,
              const SessionPart& part, const rig::Joints& sentinel_pose);

  /// After the homing at the start, also one that failed: against where the part before left the
  /// axes. Returns whether every axis that tells was compared, and one does.
  bool compare_with_last_part(const Distrust& distrust);
  /// After white and sentinel at the start: the light against the part before. Returns what there
  /// is to warn of; empty: nothing.
  std::string compare_light_with_last_part();
  /// After the homing that followed a device's absence, also one that failed: against where the
  /// axes were read last. Nothing before compare_with_last_part().
  void compare_after_loss(const rig::Joints& believed, const Distrust& distrust);
  /// To the sentinel; the first reading of a session becomes what others are compared with. Returns
  /// whether it was compared, or there is no sentinel: not by a lamp that flickers there however
  /// often it is read.
  bool visit_sentinel(const Distrust& distrust);
  /// Whether there are sentinels and none could be read yet: nothing to compare the next with.
  bool awaits_sentinel() const { return sentinel_on_ && !last_; }
  /// What a check has compared, or what there is nothing to compare of: points before one that
  /// could not tell are as unchecked after it.
  struct Compared {
    bool axes = false;  ///< all that tell
    bool light = false;
  };
  /// Home marks and sentinel.
  Compared check(const Distrust& distrust_axes, const Distrust& distrust_light);
  /// Whether check() looks at anything: an axis that tells its home delta, or a sentinel.
  bool can_check() const { return tells_home_delta_ || sentinel_on_; }
  /// Whether it is time for one after so many points.
  bool due(std::size_t points_since) const;

  /// What the monitor reads at the white, by which the lamp counts as lit: the highest of a
  /// bracket.
  void set_lit_monitor(const std::string& channel, double highest_reading);
  /// Throws Fault when the lamp is off by its monitor: in all readings of a bracket. One that is
  /// low among others is flicker().
  void require_lit(const std::string& channel, double highest_reading) const;
  /// What to say of a lamp whose monitor read so differently in one bracket that a reading is no
  /// longer that of its frame; empty: it was steady.
  std::string flicker(const std::string& channel, double lowest_reading,
                      double highest_reading) const;

 private:
  bool check_home(const Distrust& distrust);
  bool judge_homing(const rig::Joints& believed, bool after_outage, const Distrust& distrust);
  std::string axes_that_cannot_tell();
  /// One reading, or why there is none; neither: the sample is too dark for a sentinel.
  struct SentinelFound {
    std::optional<SentinelReading> reading;
    std::string unsteady;
    bool saturated = false;  ///< which is no flicker
  };
  SentinelFound read_sentinel(const Distrust& distrust);
  struct ChannelFound {
    SentinelLevel level;
    std::string unsteady;  ///< as flicker(), or that it saturates; the level then is none
    bool saturated = false;
  };
  ChannelFound read_channel(const std::string& channel, std::chrono::nanoseconds exposure,
                            const std::vector<std::size_t>& pixels);
  void compare_sentinel(const SentinelReading& reading, const Distrust& distrust);

  GuardedDevices& devices_;
  const instrument::Instrument& instrument_;
  const SessionOptions& options_;
  SessionWriter& archive_;
  const SessionPart& part_;
  rig::Joints pose_;
  bool tells_home_delta_ = false;
  bool sentinel_on_ = false;
  bool said_who_cannot_tell_ = false;
  bool compared_with_last_part_ = false;
  std::chrono::nanoseconds last_check_{0};
  std::map<std::string, std::chrono::nanoseconds> exposures_;  ///< of the sentinel, by channel
  std::optional<SentinelVisit> last_;                          ///< of this part
  std::map<std::string, double> slope_per_s_;  ///< relative, between the last two visits
  std::map<std::string, double> lit_monitor_;
};

}  // namespace gonio::acquisition
