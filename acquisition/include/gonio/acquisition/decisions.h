#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/acquisition/session_archive.h"
#include "gonio/brdf/directions.h"
#include "gonio/rig/kinematics.h"

namespace gonio::acquisition {

/// Kind of the notes that hold decisions: with them a journal tells what a session added to its
/// plan, or left out of it, and why.
inline constexpr const char* kDecisionNote = "decision";

/// No session has more points, those added included.
inline constexpr int kMostPoints = 1'000'000;

/// A point that a session takes besides its plan, behind all others.
struct AddedPoint {
  int point = 0;                ///< its index: the plan's points and those added before, counted
  std::optional<int> replaces;  ///< a point that could not be measured; it is not tried again
  std::optional<int> checks;    ///< a point that does not fit the others
  brdf::HalfDiff direction;
  rig::PoseSolution pose;
};

/// What was decided between two points of a session.
struct Decision {
  enum class Kind {
    add,     ///< `added` come behind all other points
    enough,  ///< `dropped`, all that is left, are not measured
    remark   ///< nothing changes; said once
  };
  Kind kind = Kind::add;
  std::string reason;  ///< one line for people
  std::vector<AddedPoint> added;
  std::vector<int> dropped;
  std::optional<double> expected_psnr_db;  ///< by which it was decided; empty: by no picture
};

/// One line of JSON, poses to the last bit (docs/formats.md, "decisions").
std::string decision_text(const Decision& decision);

/// `place`  Named in errors. Throws DataFormatError for anything but what decision_text() writes:
///          no JSON, unknown or missing keys, angles out of range or not finite, points out of
///          range or out of order, a point that replaces itself or a later one, nothing to do.
Decision decision_from_text(std::string_view text, const std::filesystem::path& place);

struct LoggedDecision {
  std::chrono::nanoseconds at{0};  ///< session clock
  Decision decision;
};

/// All decisions of a session, in their order. Throws DataFormatError naming the note's time, also
/// when points that were added do not count on from each other (a decision in between is lost).
std::vector<LoggedDecision> decisions(const SessionReader& archive);

}  // namespace gonio::acquisition
