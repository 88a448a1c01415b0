#pragma once

#include "gonio/acquisition/archive_observer.h"
#include "gonio/console/console.h"

namespace gonio::cli {

/// Says at the terminal, as it happens, what a person may want to see to: how axes and light were
/// found after an interruption, that a device dropped off or came back, points that are suspect.
/// Passes all on to the live page, if any.
///
/// Threads  As ArchiveObserver.
class SessionTeller final : public acquisition::ArchiveObserver {
 public:
  /// `console` and `next`, which may be null, must outlive it. `resumed`: the session goes on.
  SessionTeller(const Console& console, acquisition::ArchiveObserver* next, bool resumed)
      : console_(console), next_(next), tells_homes_(resumed) {}

  void on_frame(const acquisition::FrameRecord& record,
                const devices::Frame& frame) noexcept override;
  void on_point(const acquisition::PointRecord& record) noexcept override;
  void on_note(const acquisition::SessionNote& note) noexcept override;

 private:
  void tell(const acquisition::SessionNote& note);

  const Console& console_;
  acquisition::ArchiveObserver* next_;
  bool tells_homes_;  ///< the first comparison is over the interruption
};

}  // namespace gonio::cli
