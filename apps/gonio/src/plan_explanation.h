#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "direction_choice.h"
#include "gonio/acquisition/measurement_plan.h"

/// What `plan --explain` prints; keys of the JSON: docs/formats.md.
namespace gonio::cli {

/// Figures of the directions as points. What they tell as planned is sample_size_text()'s.
std::string figures_text(const DirectionFigures& figures);
nlohmann::ordered_json figures_json(const DirectionFigures& figures);

/// Poses in visiting order with their times, one line each, and the sums.
std::string session_text(const acquisition::MeasurementPlan& plan, const std::string& duration);
nlohmann::ordered_json session_json(const acquisition::MeasurementPlan& plan);

}  // namespace gonio::cli
