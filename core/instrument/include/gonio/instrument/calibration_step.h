#pragma once

#include <chrono>
#include <span>
#include <string_view>
#include <vector>

namespace gonio::instrument {

/// One step of the calibration routine, as data.
struct CalibrationStep {
  std::string_view name;   ///< as in files and on the command line: "photon_transfer"
  std::string_view finds;  ///< what it measures, one phrase
  /// Earlier steps whose values are in what it sees: once they are taken anew, so must it be.
  std::vector<std::string_view> needs;
  /// Earlier steps that have to stand when it is taken and lend it a sigma, a list of pixels or a
  /// state of axes and lamp: with theirs anew, what it saw is evaluated again and holds as long as
  /// before.
  std::vector<std::string_view> borrows;
  std::chrono::hours valid;  ///< after that it has to be repeated
  /// What the operator says of its targets and it takes for true, by name (TargetData): once one is
  /// another, it must be taken anew.
  std::vector<std::string_view> told = {};
};

/// All steps in the order in which they are taken.
std::span<const CalibrationStep> calibration_steps();

/// Null when there is none of that name.
const CalibrationStep* find_calibration_step(std::string_view name);

}  // namespace gonio::instrument
