#pragma once

#include <nlohmann/json.hpp>

#include "gonio/instrument/calibration_archive.h"
#include "gonio/json/json_fields.h"

namespace gonio::instrument {

using json::JsonFields;

nlohmann::ordered_json result_to_json(const StepResult& result);
StepResult result_from_json(JsonFields& fields);

}  // namespace gonio::instrument
