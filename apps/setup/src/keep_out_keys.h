#pragma once

#include <filesystem>
#include <string>

#include "config_reader.h"
#include "gonio/rig/rig_description.h"

namespace gonio::cli {

/// The tables [[keep_out]] of a rig file: `name` and [[keep_out.range]] with `axis`, `min_deg` and
/// `max_deg`, all required. `rig` has its axes already.
void visit_keep_outs(ConfigVisitor& v, rig::RigDescription& rig);

/// Throws ConfigError (file:line key: found, expected): a key that is missing, min_deg above
/// max_deg, a range outside of its axis' travel, a box that holds the axes' home.
void check_keep_outs(const rig::RigDescription& rig, const ConfigReader& reader,
                     const std::filesystem::path& place);

/// A keep-out of the first and the last axis of an LA-2 as the lines of a rig file, in comments.
std::string keep_out_example(const rig::RigDescription& rig);

}  // namespace gonio::cli
