#pragma once

#include <string>
#include <vector>

#include "gonio/acquisition/measurement_plan.h"
#include "gonio/console/console.h"
#include "gonio/samples/samples.h"

namespace gonio::cli {

/// Directions from a CSV file, or a published set by its name. Throws DataFormatError, FileError.
std::vector<samples::Direction> directions_input(const std::string& word,
                                                 samples::BelowHorizon below_horizon);

/// Throws UsageError for the first direction of a list that cannot be measured, with the reason;
/// with `skip`, warns of each and goes on as long as one is left.
void refuse_unreachable(const Console& console, const std::string& list,
                        const acquisition::MeasurementPlan& plan, bool skip);

}  // namespace gonio::cli
