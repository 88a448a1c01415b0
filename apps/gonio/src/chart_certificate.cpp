#include "chart_certificate.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>

#include "gonio/errors/errors.h"
#include "gonio/samples/csv.h"

namespace gonio::cli {
namespace {

constexpr std::array<const char*, 5> kColumns{"row", "column", "red", "green", "blue"};
constexpr double kLastPlace = 99.0;
constexpr double kMostBright = 1.2;

}  // namespace

calibration::routine::ChartSpec read_chart(const std::filesystem::path& path, double patch_mm,
                                           double gap_mm) {
  samples::CsvReader reader(path);
  std::array<std::size_t, 5> columns{};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto found = reader.column(kColumns[i]);
    if (!found) {
      throw DataFormatError(
          path, fmt::format("line {}", reader.header_line()),
          fmt::format("found no column {}, expected row, column, red, green, blue", kColumns[i]));
    }
    columns[i] = *found;
  }
  std::map<std::pair<int, int>, Eigen::Vector3d> patches;  // row by row
  int rows = 0;
  int width = 0;
  while (const auto line = reader.next()) {
    const auto place = [&](std::size_t which) {
      const double value = reader.number_within(*line, columns[which], 0.0, kLastPlace);
      const int whole = static_cast<int>(value);
      if (whole != value) {
        throw DataFormatError(
            path, fmt::format("line {}", line->line),
            fmt::format("{}: found {:g}, expected a whole number", kColumns[which], value));
      }
      return whole;
    };
    const std::pair at(place(0), place(1));
    Eigen::Vector3d value;
    for (std::size_t i = 0; i < 3; ++i) {
      value[static_cast<Eigen::Index>(i)] =
          reader.number_within(*line, columns[2 + i], 0.0, kMostBright);
    }
    if (!patches.emplace(at, value).second) {
      throw DataFormatError(path, fmt::format("line {}", line->line),
                            fmt::format("found the patch of row {}, column {} again, expected each "
                                        "once",
                                        at.first, at.second));
    }
    rows = std::max(rows, at.first + 1);
    width = std::max(width, at.second + 1);
  }
  if (patches.empty() ||
      patches.size() != static_cast<std::size_t>(rows) * static_cast<std::size_t>(width)) {
    throw DataFormatError(
        path, "rows",
        fmt::format("found {} patches, expected all of {} x {}", patches.size(), rows, width));
  }
  calibration::routine::ChartSpec chart;
  chart.columns = width;
  chart.patch_mm = patch_mm;
  chart.gap_mm = gap_mm;
  for (const auto& [at, value] : patches) chart.linear_srgb.push_back(value);
  return chart;
}

}  // namespace gonio::cli
