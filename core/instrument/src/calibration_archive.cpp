#include "gonio/instrument/calibration_archive.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "gonio/files/sha256.h"
#include "gonio/instrument/calibration_file.h"
#include "result_json.h"
#include "rig_json.h"

namespace gonio::instrument {
namespace {

// Rounding of a product J^T J; relative to the largest variance.
constexpr double kAsymmetry = 1e-9;
constexpr double kNegativeEigenvalue = 1e-9;

bool is_sha256(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

void require(bool ok, const std::string& step, const std::string& what) {
  if (!ok) throw std::invalid_argument(fmt::format("step \"{}\": {}", step, what));
}

void require_covariance(const StepResult& result) {
  const auto count = static_cast<Eigen::Index>(result.parameters.size());
  const Eigen::MatrixXd& covariance = result.covariance;
  require(covariance.rows() == count && covariance.cols() == count, result.step,
          fmt::format("covariance: found {} x {}, expected {} x {}", covariance.rows(),
                      covariance.cols(), count, count));
  if (count == 0) return;
  require(covariance.allFinite(), result.step, "covariance: found a number that is not finite");
  require((covariance.diagonal().array() >= 0.0).all(), result.step,
          "covariance: found a negative variance");
  // Units differ by orders of magnitude: symmetry and definiteness are those of the correlations.
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  const Eigen::VectorXd scale =
      sigma.unaryExpr([](double value) { return value > 0.0 ? 1.0 / value : 0.0; });
  for (Eigen::Index i = 0; i < count; ++i) {
    require(sigma[i] > 0.0 || (covariance.row(i).isZero(0.0) && covariance.col(i).isZero(0.0)),
            result.step, "covariance: found a parameter without variance that varies with others");
  }
  const Eigen::MatrixXd correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  require((correlation - correlation.transpose()).cwiseAbs().maxCoeff() <= kAsymmetry, result.step,
          "covariance: found a matrix that is not symmetric");
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation, Eigen::EigenvaluesOnly);
  require(solver.eigenvalues().minCoeff() >= -kNegativeEigenvalue * static_cast<double>(count),
          result.step, "covariance: found a matrix that is not positive semidefinite");
}

std::vector<std::string_view> needed_and_borrowed(const CalibrationStep& step) {
  std::vector<std::string_view> all = step.needs;
  all.insert(all.end(), step.borrows.begin(), step.borrows.end());
  return all;
}

/// How a step that is asked about itself ends the walk: needs are earlier steps only.
bool is_stale(const CalibrationArchive& archive, const StepResult& result) {
  if (archive.redo.contains(result.step)) return true;
  const auto& needs = find_calibration_step(result.step)->needs;
  return std::any_of(needs.begin(), needs.end(), [&](std::string_view need) {
    const StepResult* used = find_result(archive, need);
    const auto named = result.inputs.find(std::string(need));
    return used == nullptr || named == result.inputs.end() ||
           taking_sha256(*used) != named->second || is_stale(archive, *used);
  });
}

void put(CalibrationArchive& archive, StepResult result) {
  std::erase_if(archive.results, [&](const StepResult& old) { return old.step == result.step; });
  archive.redo.erase(result.step);
  archive.results.push_back(std::move(result));
}

/// A checksum by its beginning.
std::string shown(const std::string& told) { return is_sha256(told) ? told.substr(0, 8) : told; }

}  // namespace

std::string_view to_string(StepState state) {
  switch (state) {
    case StepState::missing:
      return "missing";
    case StepState::valid:
      return "valid";
    case StepState::stale:
      return "stale";
    case StepState::expired:
      return "expired";
  }
  return "missing";
}

void StepResult::validate() const {
  const CalibrationStep* known = find_calibration_step(step);
  require(known != nullptr, step, "found no step of that name");
  require(valid_until > finished, step, "valid_until: found an end before the beginning");
  require(valid_until <= finished + known->valid, step,
          "valid_until: found later than such a result is good for");
  const std::vector<std::string_view> all = needed_and_borrowed(*known);
  const std::set<std::string_view> needs(all.begin(), all.end());
  for (const auto& [name, hash] : inputs) {
    require(needs.contains(name), step, fmt::format("inputs: does not use \"{}\"", name));
    require(is_sha256(hash), step, fmt::format("inputs.{}: expected 64 hexadecimal digits", name));
  }
  require(inputs.size() == needs.size(), step,
          fmt::format("inputs: found {}, expected {}", inputs.size(), needs.size()));
  require(!temperature_deg_c || std::isfinite(*temperature_deg_c), step,
          "temperature_deg_c: expected a finite number");
  for (const auto& [name, value] : told) {
    require(std::find(known->told.begin(), known->told.end(), name) != known->told.end(), step,
            fmt::format("told: does not use \"{}\"", name));
  }
  std::set<std::string> names;
  for (const CalibrationParameter& parameter : parameters) {
    require(!parameter.name.empty() && names.insert(parameter.name).second, step,
            fmt::format("parameters: \"{}\" has no name of its own", parameter.name));
    require(std::isfinite(parameter.value), step, parameter.name + ": expected a finite number");
  }
  require_covariance(*this);
  for (const auto& [name, value] : residuals) {
    require(std::isfinite(value), step, "residuals." + name + ": expected a finite number");
  }
  for (const AcceptanceCheck& check : checks) {
    require(std::isfinite(check.found) && std::isfinite(check.limit), step,
            "checks." + check.name + ": expected finite numbers");
    require(check.passed(), step,
            fmt::format("{}: found {:g}, expected at most {:g}; only what passed is kept",
                        check.name, check.found, check.limit));
  }
  for (const RawData& raw : raw_data) {
    require(is_sha256(raw.sha256), step,
            "raw_data." + raw.file + ": expected 64 hexadecimal digits");
  }
}

void CalibrationArchive::validate() const {
  if (!is_sha256(rig_sha256)) {
    throw std::invalid_argument("rig_sha256: expected 64 hexadecimal digits");
  }
  if (!is_sha256(white_sha256)) {
    throw std::invalid_argument("white_sha256: expected 64 hexadecimal digits");
  }
  if (!instrument_sha256.empty() && !is_sha256(instrument_sha256)) {
    throw std::invalid_argument("instrument_sha256: expected 64 hexadecimal digits, or nothing");
  }
  for (const auto& [device, serial] : serials) {
    if (device.empty() || serial.empty()) {
      throw std::invalid_argument(
          fmt::format("serials: found {:?} for {:?}, expected a device and what tells it from "
                      "others of its kind",
                      serial, device));
    }
  }
  std::set<std::string> steps;
  for (const StepResult& result : results) {
    result.validate();
    require(steps.insert(result.step).second, result.step, "found twice");
  }
  for (const std::string& step : redo) {
    require(find_calibration_step(step) != nullptr, step, "redo: found no step of that name");
  }
}

std::string rig_sha256(const Instrument& nominal) {
  Instrument declared = nominal;
  declared.id.clear();
  declared.white = {};
  declared.u_normal = declared.u_lamp_direction = declared.u_joint = {};
  declared.u_lamp_relative = declared.u_linearity_relative = 0.0;
  return files::sha256_of_bytes(to_json(declared));
}

std::string white_sha256(const WhiteReference& white) {
  Instrument only;
  only.white = white;
  return files::sha256_of_bytes(to_json(only));
}

std::string taking_sha256(const StepResult& result) {
  std::string text =
      fmt::format("{}\n{}\n", result.step, result.finished.time_since_epoch().count());
  for (const RawData& raw : result.raw_data) text += raw.sha256 + "\n";
  return files::sha256_of_bytes(std::string_view(text));
}

const StepResult* find_result(const CalibrationArchive& archive, std::string_view step) {
  const auto found = std::find_if(archive.results.begin(), archive.results.end(),
                                  [&](const StepResult& each) { return each.step == step; });
  return found == archive.results.end() ? nullptr : &*found;
}

StepState state_of(const CalibrationArchive& archive, std::string_view step, UtcSeconds now) {
  if (find_calibration_step(step) == nullptr) {
    throw std::invalid_argument(fmt::format("found no calibration step \"{}\"", step));
  }
  const StepResult* result = find_result(archive, step);
  if (result == nullptr) return StepState::missing;
  if (is_stale(archive, *result)) return StepState::stale;
  return now > result->valid_until ? StepState::expired : StepState::valid;
}

bool is_whole(const CalibrationArchive& archive, UtcSeconds now) {
  const auto steps = calibration_steps();
  return std::all_of(steps.begin(), steps.end(), [&](const CalibrationStep& step) {
    const StepState state = state_of(archive, step.name, now);
    return state == StepState::valid || state == StepState::expired;
  });
}

std::vector<std::string> steps_to_take(const CalibrationArchive& archive, UtcSeconds now) {
  std::vector<std::string> steps;
  std::set<std::string_view> anew;
  for (const CalibrationStep& step : calibration_steps()) {
    const bool on_old_ground = std::any_of(step.needs.begin(), step.needs.end(),
                                           [&](auto need) { return anew.contains(need); });
    if (!on_old_ground && state_of(archive, step.name, now) == StepState::valid) continue;
    anew.insert(step.name);
    steps.emplace_back(step.name);
  }
  return steps;
}

std::map<std::string, std::string> inputs_of(const CalibrationArchive& archive,
                                             std::string_view step, UtcSeconds now) {
  const CalibrationStep* known = find_calibration_step(step);
  if (known == nullptr) {
    throw std::invalid_argument(fmt::format("found no calibration step \"{}\"", step));
  }
  std::map<std::string, std::string> inputs;
  for (const std::string_view need : needed_and_borrowed(*known)) {
    const StepState state = state_of(archive, need, now);
    if (state != StepState::valid) {
      throw std::invalid_argument(fmt::format("{} needs {}, which is {}: take that step first",
                                              step, need, to_string(state)));
    }
    inputs.emplace(need, taking_sha256(*find_result(archive, need)));
  }
  return inputs;
}

void require_takeable(const CalibrationArchive& archive, const std::vector<std::string>& steps,
                      UtcSeconds now) {
  // As if each had been taken: its result is another one, made from those before it.
  CalibrationArchive taken = archive;
  for (const std::string& name : steps) {
    StepResult result;
    result.step = name;
    result.inputs = inputs_of(taken, name, now);
    result.finished = now;
    result.valid_until = UtcSeconds::max();
    result.raw_data = {{"", "to be taken"}};
    put(taken, std::move(result));
  }
}

std::string told_otherwise(const StepResult& result, const TargetData& now) {
  const CalibrationStep* step = find_calibration_step(result.step);
  if (step == nullptr) return {};
  std::string differences;
  for (const std::string_view name : step->told) {
    const auto expected = now.find(std::string(name));
    if (expected == now.end()) continue;
    const auto found = result.told.find(expected->first);
    if (found != result.told.end() && found->second == expected->second) continue;
    differences += fmt::format("{}{} was {}, now it is {}", differences.empty() ? "" : ", ", name,
                               found == result.told.end() ? "not told" : shown(found->second),
                               shown(expected->second));
  }
  if (differences.empty()) return {};
  return fmt::format("{} was made with other targets: {}; gonio calibrate takes it again",
                     result.step, differences);
}

std::string at_another_temperature(const StepResult& result, double now_deg_c) {
  constexpr double kDarksHold_k = 3.0;
  if (result.step != "darks" || !result.temperature_deg_c) return {};
  if (std::abs(now_deg_c - *result.temperature_deg_c) <= kDarksHold_k) return {};
  return fmt::format(
      "darks was taken at {:.1f} deg C, now it is {:.1f}, expected within {:g} K; gonio calibrate "
      "takes it again",
      *result.temperature_deg_c, now_deg_c, kDarksHold_k);
}

std::vector<std::string> dates_to_come(const CalibrationArchive& archive, UtcSeconds now) {
  std::vector<std::string> lines;
  for (const StepResult& result : archive.results) {
    const std::string line = time_to_come(result.finished, now);
    if (!line.empty()) lines.push_back(fmt::format("{} finished: {}", result.step, line));
  }
  return lines;
}

void record(CalibrationArchive& archive, StepResult result) {
  result.validate();
  put(archive, std::move(result));
}

namespace {

using Serials = std::map<std::string, std::string>;

void add_reasons_of_devices(const Serials& calibrated, const Serials& there,
                            std::vector<std::string>& reasons) {
  for (const auto& [device, serial] : calibrated) {
    const auto found = there.find(device);
    if (found == there.end()) {
      reasons.push_back(
          fmt::format("{}: found no such device, expected \"{}\" as calibrated; connect it, or "
                      "calibrate without it",
                      device, serial));
    } else if (found->second != serial) {
      reasons.push_back(fmt::format(
          "{}: found \"{}\", expected \"{}\" as calibrated; what depends on it has to be repeated",
          device, found->second, serial));
    }
  }
}

}  // namespace

std::vector<std::string> reasons_against(const CalibrationArchive& archive,
                                         const CalibrationUse& use) {
  std::vector<std::string> reasons;
  if (archive.rig_sha256 != use.rig_sha256) {
    reasons.push_back(
        fmt::format("made on another rig: found {:.8}, expected {:.8}: its rig file's axes, "
                    "camera, lens or lamp "
                    "are others; calibrate this one, or use its rig file",
                    archive.rig_sha256, use.rig_sha256));
  }
  if (archive.white_sha256 != use.white_sha256) {
    reasons.push_back(
        "made with another white: its entry in the rig file, or its certificate, has changed "
        "since; gonio calibrate takes the steps again that saw it");
  }
  if (archive.serials.empty()) {
    reasons.push_back(
        "says of no device that it was made with it, expected camera and lamp at least; calibrate "
        "in another folder");
  }
  if (use.serials) add_reasons_of_devices(archive.serials, *use.serials, reasons);
  for (std::string& line : dates_to_come(archive, use.now)) reasons.push_back(std::move(line));
  for (const StepResult& result : archive.results) {
    std::string line = told_otherwise(result, use.told);
    if (!line.empty()) reasons.push_back(std::move(line));
  }
  for (const CalibrationStep& step : calibration_steps()) {
    const StepState state = state_of(archive, step.name, use.now);
    if (state == StepState::valid) continue;
    std::string since;
    if (state == StepState::expired) {
      since =
          fmt::format(" since {:%Y-%m-%d %H:%M} UTC", find_result(archive, step.name)->valid_until);
    }
    // Not that step alone: what it needs may have to be taken first.
    reasons.push_back(
        fmt::format("{} is {}{}: gonio calibrate takes it", step.name, to_string(state), since));
  }
  return reasons;
}

}  // namespace gonio::instrument
