#include <fmt/format.h>

#include "gonio/acquisition/session.h"

namespace gonio::acquisition {

void SessionOptions::validate() const {
  const auto require = [](bool ok, const char* field, double value, const char* expected) {
    if (!ok) {
      throw PreflightError(fmt::format("session: {} is {}, expected {}", field, value, expected));
    }
  };
  using Microseconds = std::chrono::duration<double, std::micro>;
  require(first_exposure.count() > 0, "first_exposure_us", Microseconds(first_exposure).count(),
          "above 0");
  require(max_exposure >= first_exposure, "max_exposure_us", Microseconds(max_exposure).count(),
          "at least first_exposure_us");
  require(bracket_ratio > 1.0 && bracket_ratio <= 64.0, "bracket_ratio", bracket_ratio,
          "above 1, at most 64");
  require(max_exposures >= 1 && max_exposures <= 64, "max_exposures", max_exposures, "1 to 64");
  require(relative_sigma > 0.0 && relative_sigma < 1.0, "relative_sigma", relative_sigma,
          "between 0 and 1");
  require(spot_half_width_mm > 0.0 && spot_half_width_mm < sample_half_width_mm,
          "spot_half_width_mm", spot_half_width_mm, "above 0, below sample_half_width_mm");
  require(white_frames >= 1 && white_frames <= 1000, "white_frames", white_frames, "1 to 1000");
  require(dark_frames >= 1 && dark_frames <= 1000, "dark_frames", dark_frames, "1 to 1000");
  require(sample_half_width_mm > 0.0, "sample_half_width_mm", sample_half_width_mm, "above 0");
  const double white_mm = white_half_width_mm.value_or(sample_half_width_mm);
  require(white_mm > 0.0, "white_half_width_mm", white_mm, "above 0");
  require(white_patch_half_width_mm > 0.0, "white_patch_half_width_mm", white_patch_half_width_mm,
          "above 0");
  require(sentinel_every >= 0 && sentinel_every <= 100000, "sentinel_every", sentinel_every,
          "0 to 100000");
  require(sentinel_interval.count() > 0, "sentinel_interval_min",
          devices::to_seconds(sentinel_interval) / 60.0, "above 0");
  require(white_interval.count() >= 0, "white_interval_min",
          devices::to_seconds(white_interval) / 60.0, "0 or more");
  require(retries >= 0 && retries <= 100, "retries", retries, "0 to 100");
  require(move_timeout.count() > 0, "move_timeout_s", devices::to_seconds(move_timeout), "above 0");
}

}  // namespace gonio::acquisition
