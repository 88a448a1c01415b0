#pragma once

#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "gonio/sim/joint.h"
#include "gonio/sim/sim_goniometer.h"

namespace gonio::emulate {

using HostTime = std::chrono::steady_clock::time_point;

struct Interval {
  HostTime start;
  HostTime end;
};

/// Where the host's time went: what the physics takes, and what is left over.
struct TimeAccount {
  double wall_s = 0.0;       ///< of the command, from its start to its end
  double axes_s = 0.0;       ///< an axis travelled or settled
  double exposures_s = 0.0;  ///< the sensor exposed or was read out
  double wire_s = 0.0;       ///< bytes were on a line that paces them
  double together_s = 0.0;   ///< the union of the three
  double overhead() const { return wall_s > 0.0 ? 1.0 - together_s / wall_s : 0.0; }
};

/// Length of the union of intervals, in any order.
double union_seconds(std::vector<Interval> intervals);

/// Of what happened while `command` ran.
TimeAccount account_of(const Interval& command, const std::vector<Interval>& axes,
                       const std::vector<Interval>& exposures, const std::vector<Interval>& wire);

/// Watches a world's axes and notes when one is not at rest, to a millisecond.
///
/// Threads  One of its own; the members from one thread.
class AxisWatch {
 public:
  /// `world` must outlive it.
  explicit AxisWatch(sim::SimGoniometer& world);
  ~AxisWatch();
  AxisWatch(const AxisWatch&) = delete;
  AxisWatch& operator=(const AxisWatch&) = delete;

  std::vector<Interval> intervals() const;

 private:
  void watch(const std::stop_token& stop);
  bool moves() const;

  sim::SimGoniometer& world_;
  mutable std::mutex mutex_;
  std::vector<Interval> intervals_;
  std::jthread thread_;
};

}  // namespace gonio::emulate
