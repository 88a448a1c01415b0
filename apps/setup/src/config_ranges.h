#pragma once

#include "config_visitor.h"

/// What several tables of a configuration allow.
namespace gonio::cli {

inline constexpr double kMicrosecond = 1e-6;
inline constexpr double kMillisecond = 1e-3;
inline constexpr Range kAnyDegrees{-3600.0, 3600.0};
inline constexpr Range kMillimetres{-1e5, 1e5};
inline constexpr Range kPositive{1e-9, 1e9};
inline constexpr Range kNotNegative{0.0, 1e9};
inline constexpr Range kExposure{1.0, 1e8};
inline constexpr Range kShare{0.0, 1.0};

}  // namespace gonio::cli
