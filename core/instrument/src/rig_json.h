#pragma once

#include <nlohmann/json.hpp>

#include "gonio/rig/rig_description.h"
#include "json_fields.h"

namespace gonio::instrument {

nlohmann::ordered_json rig_to_json(const rig::RigDescription& rig);
rig::RigDescription rig_from_json(JsonFields& fields);

}  // namespace gonio::instrument
