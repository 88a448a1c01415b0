#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "command.h"
#include "direction_choice.h"
#include "near_field_plan.h"

namespace gonio::cli {

/// The words of `gonio plan`.
struct PlanOptions {
  std::string basis;
  std::string directions;
  std::string rig;
  std::string calibration;  ///< empty: what the rig file names
  std::string out;
  std::string method = "exchange";
  std::string objective = "auto";
  std::string weights = "auto";
  std::string patch = "auto";
  int samples = 0;
  double noise = -1.0;  ///< below 0: from the rig
  double percent_per_second = 0.0;
  std::uint64_t seed = 1;
  bool near_field = false;
  int shots = 2;
  NearFieldWords camera;
  bool explain = false;
  bool json = false;
  bool skip_unreachable = false;
  bool force = false;

  std::optional<double> relative_noise() const {
    return noise >= 0.0 ? std::optional(noise) : std::nullopt;
  }
};

void add_plan_options(const Command& command, PlanOptions& options);

/// Throws UsageError naming the first option that is missing, or that was given and would change
/// nothing in what these options ask for.
void check_plan_options(const PlanOptions& options);

}  // namespace gonio::cli
