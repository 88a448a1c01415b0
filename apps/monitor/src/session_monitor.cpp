#include "gonio/monitor/session_monitor.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "gonio/devices/clock.h"

namespace gonio::monitor {
namespace {

constexpr std::size_t kNotesKept = 100;
constexpr int kSpotHalfWidth_px = 8;
/// Pages ask once a second.
constexpr std::chrono::seconds kSomebodyLooks{3};

/// What is told must not come back as an error: who looks on does not end a session.
template <class Work>
void best_effort(Work&& work) noexcept {
  try {
    work();
  } catch (const std::exception&) {
    // Out of memory. The next thing told may be shown again.
  }
}

}  // namespace

SessionMonitor::SessionMonitor(SessionFacts facts, const instrument::Instrument& instrument)
    : facts_(std::move(facts)), instrument_(instrument) {
  now_.progress.total = static_cast<int>(facts_.directions.size());
}

void SessionMonitor::on_progress(const acquisition::SessionProgress& now) noexcept {
  best_effort([&] {
    const std::lock_guard lock(mutex_);
    now_.progress = now;
    now_.progress_at = std::chrono::steady_clock::now();
  });
}

void SessionMonitor::on_frame(const acquisition::FrameRecord& record,
                              const devices::Frame& frame) noexcept {
  best_effort([&] {
    const bool lit = !record.channel.empty();
    const std::optional<double> signal = lit ? signal_of(record, frame) : std::nullopt;
    bool wanted = false;
    {
      const std::lock_guard lock(mutex_);
      ++now_.frames;
      if (frame_) frame_->newest = false;
      now_.joints = record.joints;
      if (lit && record.monitor > 0.0) {
        lamp_[record.channel].add({devices::to_seconds(record.exposure_start), record.monitor});
      }
      if (signal && record.kind == acquisition::FrameKind::white && !facts_.white_in_frame) {
        white_signal_.try_emplace(record.channel, *signal);  // the opening white's
      }
      if (signal && record.kind == acquisition::FrameKind::sample) {
        point_signal_[record.channel] = *signal;
      }
      wanted = !frame_ || std::chrono::steady_clock::now() < frames_wanted_until_;
    }
    if (!wanted) return;
    // Without the lock: a large frame takes a while to copy.
    auto copy = std::make_shared<const devices::Frame>(frame);
    const std::lock_guard lock(mutex_);
    frame_ = HeldFrame{record, std::move(copy)};
  });
}

std::optional<double> SessionMonitor::signal_of(const acquisition::FrameRecord& record,
                                                const devices::Frame& frame) const {
  if (record.joints.size() != instrument_.rig.axes.size()) return std::nullopt;
  const rig::RigPose pose = rig::forward(instrument_.rig, record.joints);
  const Eigen::Vector3d origin_in_camera =
      pose.world_from_camera.inverse() * pose.world_from_sample.translation();
  if (origin_in_camera.z() <= 0.0) return std::nullopt;
  const Eigen::Vector2d place = instrument_.camera.project(origin_in_camera);
  const auto column = static_cast<int>(std::lround(std::clamp(place.x(), -1e6, 1e6)));
  const auto row = static_cast<int>(std::lround(std::clamp(place.y(), -1e6, 1e6)));
  double sum = 0.0;
  int count = 0;
  for (int y = std::max(0, row - kSpotHalfWidth_px);
       y < std::min(frame.height_px, row + kSpotHalfWidth_px); ++y) {
    for (int x = std::max(0, column - kSpotHalfWidth_px);
         x < std::min(frame.width_px, column + kSpotHalfWidth_px); ++x) {
      const std::uint16_t dn = frame.at(y, x);
      if (dn >= frame.saturation_level_dn) return std::nullopt;
      sum += dn;
      ++count;
    }
  }
  const double exposure_s = devices::to_seconds(record.exposure);
  if (count == 0 || exposure_s <= 0.0) return std::nullopt;
  const double level = record.monitor > 0.0 ? record.monitor : 1.0;
  return (sum / count - frame.black_level_dn) / exposure_s / level;
}

void SessionMonitor::on_point(const acquisition::PointRecord& record) noexcept {
  best_effort([&] {
    const std::lock_guard lock(mutex_);
    Point point{record.point, record.outcome, {}, record.note};
    for (const auto& [channel, signal] : point_signal_) {
      const auto white = white_signal_.find(channel);
      if (white != white_signal_.end() && white->second > 0.0) {
        point.signal_over_white[channel] = signal / white->second;
      }
    }
    point_signal_.clear();
    ++(record.outcome == acquisition::PointOutcome::Measured ? now_.measured : now_.not_measured);
    points_.push_back(std::move(point));
  });
}

void SessionMonitor::on_note(const acquisition::SessionNote& note) noexcept {
  best_effort([&] {
    const std::lock_guard lock(mutex_);
    if (now_.notes.size() == kNotesKept) now_.notes.erase(now_.notes.begin());
    now_.notes.push_back(note);
    ++now_.notes_told;
  });
}

void SessionMonitor::asked_to(Wish wish) noexcept {
  best_effort([&] {
    const std::lock_guard lock(mutex_);
    now_.wish = std::max(now_.wish, wish);
  });
}

void SessionMonitor::ended(const std::string& how) noexcept {
  best_effort([&] {
    const std::lock_guard lock(mutex_);
    now_.ended = how;
  });
}

void SessionMonitor::runs_at(std::optional<double> time_scale) {
  const std::lock_guard lock(mutex_);
  now_.time_scale = time_scale;
}

void SessionMonitor::were_done(const std::map<int, acquisition::PointOutcome>& done) {
  const std::lock_guard lock(mutex_);
  for (const auto& [point, outcome] : done) {
    points_.push_back({point, outcome, {}, "in an earlier part of the session"});
    ++(outcome == acquisition::PointOutcome::Measured ? now_.measured : now_.not_measured);
  }
  now_.progress.done = static_cast<int>(done.size());
}

SessionMonitor::Snapshot SessionMonitor::snapshot() const {
  const std::lock_guard lock(mutex_);
  Snapshot taken = now_;
  taken.points_told = points_.size();
  for (const auto& [channel, series] : lamp_) taken.lamp[channel] = series.values();
  return taken;
}

acquisition::SessionProgress SessionMonitor::counted_on(const Snapshot& snapshot,
                                                        std::chrono::steady_clock::time_point now) {
  acquisition::SessionProgress progress = snapshot.progress;
  if (!snapshot.ended.empty() || !snapshot.time_scale || progress.phase.empty()) return progress;
  const double passed_s =
      *snapshot.time_scale * std::chrono::duration<double>(now - snapshot.progress_at).count();
  progress.elapsed_s += passed_s;
  progress.remaining_s = std::max(0.0, progress.remaining_s - passed_s);
  return progress;
}

std::vector<SessionMonitor::Point> SessionMonitor::points(std::size_t from,
                                                          std::size_t most) const {
  const std::lock_guard lock(mutex_);
  const std::size_t begin = std::min(from, points_.size());
  const std::size_t end = begin + std::min(most, points_.size() - begin);
  return {points_.begin() + static_cast<std::ptrdiff_t>(begin),
          points_.begin() + static_cast<std::ptrdiff_t>(end)};
}

std::optional<SessionMonitor::HeldFrame> SessionMonitor::frame() {
  const std::lock_guard lock(mutex_);
  frames_wanted_until_ = std::chrono::steady_clock::now() + kSomebodyLooks;
  return frame_;
}

}  // namespace gonio::monitor
