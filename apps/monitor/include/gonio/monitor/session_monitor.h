#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/archive_observer.h"
#include "gonio/acquisition/session.h"
#include "gonio/instrument/instrument.h"
#include "gonio/monitor/thinned_series.h"

namespace gonio::monitor {

/// What a page tells about a session besides what happens in it.
struct SessionFacts {
  std::string archive;
  std::string rig;
  std::string sample_id;
  bool simulated = true;
  bool white_in_frame = false;  ///< then points have no values: the white is not where they are
  std::vector<brdf::HalfDiff> directions;  ///< of the plan's points, in order
};

/// A running session as somebody who looks on sees it. The session's thread tells it, the page's
/// server asks it.
///
/// Cost     To the session: a lock, a few numbers, and a copy of a frame when the one held has been
///          asked for since. Notes and readings kept are bounded, points are the plan's.
/// Threads  All members may be called from any.
/// Errors   What goes wrong while being told is dropped: the page may then miss a line, the
///          session goes on.
class SessionMonitor final : public acquisition::ArchiveObserver {
 public:
  SessionMonitor(SessionFacts facts, const instrument::Instrument& instrument);

  void on_progress(const acquisition::SessionProgress& now) noexcept;
  void on_frame(const acquisition::FrameRecord& record,
                const devices::Frame& frame) noexcept override;
  void on_point(const acquisition::PointRecord& record) noexcept override;
  void on_note(const acquisition::SessionNote& note) noexcept override;
  /// Somebody wants it to end; a stop outranks a pause.
  enum class Wish { none, pause, stop };
  void asked_to(Wish wish) noexcept;
  /// "finished", "incomplete", "paused", "stopped" or "failed": nothing more will happen.
  void ended(const std::string& how) noexcept;
  /// Session seconds per second on the wall; none: a simulated world at no pace of its own.
  void runs_at(std::optional<double> time_scale);
  /// Points that an earlier part of the session has measured.
  void were_done(const std::map<int, acquisition::PointOutcome>& done);

  /// How a point turned out; a quick look at the frames, no BRDF.
  struct Point {
    int point = 0;
    acquisition::PointOutcome outcome = acquisition::PointOutcome::Measured;
    /// Signal per second at the sample's origin over that of the opening white at its own pose, by
    /// channel. Without what the white reference and the geometry do to it.
    std::map<std::string, double> signal_over_white;
    std::string note;
  };
  /// The frame that is held, and what it was taken for.
  struct HeldFrame {
    acquisition::FrameRecord record;
    std::shared_ptr<const devices::Frame> frame;
    bool newest = true;  ///< none was taken since
  };
  /// One moment of it all, without the frame's pixels and the points.
  struct Snapshot {
    acquisition::SessionProgress progress;
    std::chrono::steady_clock::time_point progress_at;  ///< when that was told
    Wish wish = Wish::none;
    std::optional<double> time_scale;
    std::string ended;   ///< how; empty while it runs
    rig::Joints joints;  ///< where the axes last were; empty before the first frame
    std::size_t points_told = 0;
    int measured = 0;
    int not_measured = 0;
    std::int64_t frames = 0;
    std::vector<acquisition::SessionNote> notes;  ///< the last of them, in order
    std::int64_t notes_told = 0;
    std::map<std::string, std::vector<ThinnedSeries::Value>> lamp;  ///< monitor readings by channel
  };

  /// What was told last, with the time that has passed since at the session's pace. As it was told
  /// when it is over, or in a world at no pace.
  static acquisition::SessionProgress counted_on(const Snapshot& snapshot,
                                                 std::chrono::steady_clock::time_point now);

  const SessionFacts& facts() const { return facts_; }
  const instrument::Instrument& instrument() const { return instrument_; }
  Snapshot snapshot() const;
  /// At most `most` points in the order they were told, from the `from`-th on.
  std::vector<Point> points(std::size_t from, std::size_t most) const;
  /// The newest while somebody asks every few seconds; the first time it may be an older one, which
  /// says so. None: no frame yet.
  std::optional<HeldFrame> frame();

 private:
  /// DN above black per second around where the camera sees the sample's origin; none where that
  /// is saturated or out of view.
  std::optional<double> signal_of(const acquisition::FrameRecord& record,
                                  const devices::Frame& frame) const;

  const SessionFacts facts_;
  const instrument::Instrument instrument_;

  mutable std::mutex mutex_;
  Snapshot now_;  ///< without what is made of the members below
  std::vector<Point> points_;
  std::map<std::string, double> white_signal_;
  std::map<std::string, double> point_signal_;  ///< of the point under way
  std::map<std::string, ThinnedSeries> lamp_;
  std::optional<HeldFrame> frame_;
  std::chrono::steady_clock::time_point frames_wanted_until_;
};

}  // namespace gonio::monitor
