#include "gonio/instrument/utc_time.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace gonio::instrument {

std::string time_to_come(UtcSeconds when, UtcSeconds now) {
  if (when <= now + kClocksDiffer) return {};
  return fmt::format(
      "found {:%Y-%m-%d %H:%M} UTC, which is to come (it is {:%Y-%m-%d %H:%M} now), expected "
      "one that has passed: set the clock right",
      when, now);
}

}  // namespace gonio::instrument
