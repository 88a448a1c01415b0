#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/acquisition/session_archive.h"

namespace gonio::acquisition {

/// Kinds of the notes by which a session says how far it may be trusted (docs/formats.md). What was
/// measured is never changed by them: readers put them together with the rows.
inline constexpr const char* kHomeDeltaNote = "home delta";
inline constexpr const char* kSentinelNote = "sentinel";
/// What was read there changed by more than it may; what is suspect for it is a note of its own.
inline constexpr const char* kSentinelStepNote = "sentinel step";
/// None was read where one was due; why.
inline constexpr const char* kNoSentinelNote = "no sentinel";
inline constexpr const char* kSuspectNote = "suspect";
/// How the light of a part compares with that of the part before (part_bridge.h), as it begins.
inline constexpr const char* kBridgeNote = "bridge";
/// The same where whites and sentinels contradict each other: what follows is not known against
/// what was before.
inline constexpr const char* kUnbridgedNote = "unbridged";
/// "phase: error": a device dropped off and is waited for.
inline constexpr const char* kDroppedOffNote = "dropped off";
/// "phase: error": it came back, all axes were homed anew, and what the phase
/// had begun is taken again.
inline constexpr const char* kCameBackNote = "came back";
/// The visit to the white that was under way does not count; why.
inline constexpr const char* kWhiteAgainNote = "white again";
/// What was read at the sentinel just before does not count, it is read again; why.
inline constexpr const char* kSentinelAgainNote = "sentinel again";

/// The text of a kHomeDeltaNote: what is said of each axis. `compared`: of every axis that tells it
/// is known whether its count was right.
std::string home_delta_text(const std::vector<std::string>& axes, bool over_interruption,
                            bool compared);
/// Whether points before such a note have been checked by it. False for a text that is none: the
/// journal is not trusted.
bool compares_all_axes(std::string_view home_delta_text);

/// Points that lie before a comparison of home marks which could not tell of every axis, and behind
/// the one before it: homing has put right what may have been lost there, so nobody will know.
std::vector<int> unjudged_points(const SessionReader& archive);

/// One channel of one visit to the sentinel, the fixed pose on the sample.
struct SentinelLevel {
  double level_dn_per_s = 0.0;  ///< mean over the sample, per unit of lamp monitor, background off
  double relative_sigma = 0.0;  ///< of its own noise, k = 1
  std::chrono::nanoseconds exposure{0};
};

/// By lamp channel.
using SentinelReading = std::map<std::string, SentinelLevel>;

/// What may differ between two readings though nothing happened, beside their own noise: the pose
/// that is gone to again. Relative, k = 1, of one reading.
inline constexpr double kSentinelRepeatability = 0.001;

/// Lit ones, per channel and visit.
inline constexpr int kSentinelFrames = 2;

/// Later over earlier.
struct SentinelChange {
  double relative = 0.0;  ///< minus 1
  double u = 0.0;         ///< k = 1
};

/// `u_monitor`: of one reading of the lamp monitor, relative. Levels must be above 0.
SentinelChange sentinel_change(const SentinelLevel& earlier, const SentinelLevel& later,
                               double u_monitor);

std::string sentinel_text(const SentinelReading& reading);
/// Nothing for a text that is none: the journal is not trusted.
std::optional<SentinelReading> sentinel_from_text(std::string_view text);

struct SentinelVisit {
  std::chrono::nanoseconds at{0};
  SentinelReading reading;
};
/// In time.
/// A note's text as people read it: levels and per cent instead of a sentinel's record.
std::string text_for_people(const SessionNote& note);

std::vector<SentinelVisit> sentinel_visits(const SessionReader& archive);

std::string suspect_text(const std::vector<int>& points, const std::string& why);
/// Points whose last row lies before a note that suspects them, and why.
std::map<int, std::string> suspect_points(const SessionReader& archive);

}  // namespace gonio::acquisition
