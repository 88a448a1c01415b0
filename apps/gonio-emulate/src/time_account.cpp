#include "time_account.h"

#include <algorithm>

namespace gonio::emulate {
namespace {

constexpr std::chrono::milliseconds kLook{1};

double seconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

double union_seconds(std::vector<Interval> intervals) {
  std::sort(intervals.begin(), intervals.end(),
            [](const Interval& a, const Interval& b) { return a.start < b.start; });
  double total = 0.0;
  HostTime covered = HostTime::min();
  for (const Interval& each : intervals) {
    const HostTime start = std::max(each.start, covered);
    if (each.end <= start) continue;
    total += seconds(each.end - start);
    covered = each.end;
  }
  return total;
}

TimeAccount account_of(const Interval& command, const std::vector<Interval>& axes,
                       const std::vector<Interval>& exposures, const std::vector<Interval>& wire) {
  const auto within = [&](std::vector<Interval> intervals) {
    for (Interval& each : intervals) {
      each.start = std::max(each.start, command.start);
      each.end = std::min(each.end, command.end);
    }
    return intervals;
  };
  std::vector<Interval> all = axes;
  all.insert(all.end(), exposures.begin(), exposures.end());
  all.insert(all.end(), wire.begin(), wire.end());
  TimeAccount account;
  account.wall_s = seconds(command.end - command.start);
  account.axes_s = union_seconds(within(axes));
  account.exposures_s = union_seconds(within(exposures));
  account.wire_s = union_seconds(within(wire));
  account.together_s = union_seconds(within(std::move(all)));
  return account;
}

AxisWatch::AxisWatch(sim::SimGoniometer& world)
    : world_(world), thread_([this](const std::stop_token& stop) { watch(stop); }) {}

AxisWatch::~AxisWatch() = default;

std::vector<Interval> AxisWatch::intervals() const {
  const std::lock_guard lock(mutex_);
  return intervals_;
}

bool AxisWatch::moves() const {
  for (std::size_t axis = 0; axis < world_.axis_count(); ++axis) {
    if (world_.joint(axis).settled_at() > world_.clock().now()) return true;
  }
  return false;
}

void AxisWatch::watch(const std::stop_token& stop) {
  bool moved = false;
  while (!stop.stop_requested()) {
    const bool move = moves();
    const HostTime now = std::chrono::steady_clock::now();
    if (move || moved) {
      const std::lock_guard lock(mutex_);
      if (!moved) intervals_.push_back({now, now});
      intervals_.back().end = now;
    }
    moved = move;
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace gonio::emulate
