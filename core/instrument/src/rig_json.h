#pragma once

#include <nlohmann/json.hpp>

#include "gonio/json/json_fields.h"
#include "gonio/rig/rig_description.h"

namespace gonio::instrument {

using json::JsonFields;

nlohmann::ordered_json rig_to_json(const rig::RigDescription& rig);
rig::RigDescription rig_from_json(JsonFields& fields);

}  // namespace gonio::instrument
