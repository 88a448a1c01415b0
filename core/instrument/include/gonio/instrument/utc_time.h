#pragma once

#include <chrono>
#include <string>

namespace gonio::instrument {

/// Seconds of UTC since 1970.
using UtcSeconds = std::chrono::sys_seconds;

/// What the clocks of two computers, or of one before and after it was set, may differ by.
constexpr std::chrono::minutes kClocksDiffer{10};

/// Of everything whose age is looked at: "found 2033-05-18 03:33 UTC, which is to come (it is ...
/// now), expected a time that has passed: set the clock right" when `when` lies after `now` by more
/// than kClocksDiffer; else empty.
std::string time_to_come(UtcSeconds when, UtcSeconds now);

}  // namespace gonio::instrument
