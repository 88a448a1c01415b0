#pragma once

#include "gonio/acquisition/session.h"

namespace gonio::acquisition {

/// Of any axis.
bool tells_home_delta(const DeviceSet& devices);

/// Whether a session of this plan looks at a sentinel. Opening and closing white look after one
/// that ends before its first check.
bool has_sentinel(const MeasurementPlan& plan, const SessionOptions& options);

}  // namespace gonio::acquisition
