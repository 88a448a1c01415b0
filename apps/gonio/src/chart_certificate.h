#pragma once

#include <filesystem>

#include "gonio/calibration/routine/settings.h"

namespace gonio::cli {

/// A colour chart's values: CSV with columns row, column (from 0, top left as the camera sees it),
/// red, green, blue (linear sRGB, a perfect white is 1), a row per patch of a full rectangle.
///
/// `patch_mm`, `gap_mm`  Sizes of the patches, and between them.
/// Throws DataFormatError (file, line, found, expected), FileError.
calibration::routine::ChartSpec read_chart(const std::filesystem::path& path, double patch_mm,
                                           double gap_mm);

}  // namespace gonio::cli
