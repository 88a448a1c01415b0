#pragma once

#include <array>
#include <string_view>

#include "gonio/brdf/directions.h"
#include "gonio/samples/csv.h"

namespace gonio::samples {

using ColumnNames = std::array<std::string_view, 3>;

inline constexpr ColumnNames kDirectionColumns{"theta_h_deg", "theta_d_deg", "phi_d_deg"};
inline constexpr ColumnNames kValueColumns{"r", "g", "b"};
inline constexpr ColumnNames kSigmaColumns{"sigma_r", "sigma_g", "sigma_b"};
inline constexpr ColumnNames kCommonColumns{"u_common_r", "u_common_g", "u_common_b"};
inline constexpr ColumnNames kAngleColumns{"u_theta_h_deg", "u_theta_d_deg", "u_phi_d_deg"};
inline constexpr std::string_view kPhiHColumn = "phi_h_deg";
inline constexpr std::string_view kTiltColumn = "u_tilt_deg";
/// In degrees: a normal that is less certain than this is no normal.
inline constexpr double kLargestTilt_deg = 45.0;
inline constexpr std::string_view kKernelColumn = "kernel_deg";
inline constexpr std::string_view kPoseColumn = "pose";
inline constexpr std::string_view kSpotColumn = "spot";
inline constexpr std::string_view kFlagsColumn = "flags";

/// In 1/sr, of values and uncertainties: far above any mirror's, and its squares still add up.
inline constexpr double kLargest_per_sr = 1e12;

/// The three angles of a row, range-checked. `columns` tells where they stand.
brdf::HalfDiff direction_of(const CsvReader& reader, const CsvRow& row,
                            const std::array<std::size_t, 3>& columns);

/// Throws DataFormatError at the row when the direction is below the horizon.
void refuse_below_horizon(const CsvReader& reader, const CsvRow& row,
                          const std::array<std::size_t, 3>& columns,
                          const brdf::HalfDiff& direction);

}  // namespace gonio::samples
