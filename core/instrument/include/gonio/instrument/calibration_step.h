#pragma once

#include <chrono>
#include <span>
#include <string_view>
#include <vector>

namespace gonio::instrument {

/// One step of the calibration routine, as data.
struct CalibrationStep {
  std::string_view name;                ///< as in files and on the command line: "photon_transfer"
  std::string_view finds;               ///< what it measures, one phrase
  std::vector<std::string_view> needs;  ///< steps whose results it uses, all of them earlier
  std::chrono::hours valid;             ///< after that it has to be repeated
};

/// All steps in the order in which they are taken.
std::span<const CalibrationStep> calibration_steps();

/// Null when there is none of that name.
const CalibrationStep* find_calibration_step(std::string_view name);

}  // namespace gonio::instrument
