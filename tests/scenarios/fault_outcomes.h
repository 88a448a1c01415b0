#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fault_matrix.h"
#include "gonio/acquisition/reduction.h"
#include "gonio/acquisition/session.h"

/// What the cells of the fault matrix assert, over simulated devices as over the wire.
namespace gonio {

inline constexpr int kStruckPoint = 1;  ///< of "point", so that there is one before it

/// Whether a session reports this phase for the first time, or in it the point that is struck.
bool is_beginning(const acquisition::SessionProgress& now, const std::string& phase);

/// How the part of a session with the fault ended. Times on the session's clock.
struct FirstPart {
  acquisition::SessionResult result;
  bool ended = false;  ///< with an error
  std::string error;
  std::chrono::nanoseconds at{0};
  std::optional<std::chrono::nanoseconds> struck;
};

/// A session, or a part of it, in the archive `session`; an error of a device or file ends it, and
/// is told by what is returned. `now` is its clock.
FirstPart first_part(const std::function<acquisition::SessionResult()>& run,
                     const std::function<std::chrono::nanoseconds()>& now);

/// What is said of one cell's session.
struct SessionUnderFault {
  FaultCell cell;
  std::filesystem::path session;
  std::size_t points = 0;   ///< of the plan
  double time_scale = 1.0;  ///< seconds of the session's clock in one of `within_s`
  std::function<acquisition::Reduction()> reduced;

  std::vector<acquisition::SessionNote> notes(const std::string& kind) const;
  /// That it ended as declared and in time.
  void expect_outcome(const FirstPart& part) const;
  /// Nothing is stored as good that differs from the undisturbed session `wanted`. A point's mean
  /// may differ by `same_within`, relative: noise of other frames.
  void expect_good_samples(const acquisition::Reduction& wanted, double same_within) const;

 private:
  void expect_in_time(const FirstPart& part, std::chrono::nanoseconds outcome) const;
  void expect_first_note_in_time(const FirstPart& part, const std::string& kind) const;
};

}  // namespace gonio
