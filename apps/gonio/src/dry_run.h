#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "session_preflight.h"

namespace gonio::cli {

/// `gonio measure --dry-run`: everything a session would do, as tables for people. One line per
/// stop in the order of the session, then the axes, what each part takes, the checks and what is
/// left out.
std::string dry_run_text(const SessionSetup& session, const SessionPreflight& preflight);

/// The same as data (docs/formats.md).
nlohmann::ordered_json dry_run_json(const SessionSetup& session, const SessionPreflight& preflight);

}  // namespace gonio::cli
