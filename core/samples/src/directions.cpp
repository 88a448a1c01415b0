#include <map>
#include <tuple>

#include "columns.h"
#include "gonio/errors/errors.h"
#include "gonio/samples/samples.h"

namespace gonio::samples {

brdf::HalfDiff direction_of(const CsvReader& reader, const CsvRow& row,
                            const std::array<std::size_t, 3>& columns) {
  brdf::HalfDiff direction;
  direction.theta_h = Angle::from_degrees(reader.number_within(row, columns[0], 0.0, 90.0));
  direction.theta_d = Angle::from_degrees(reader.number_within(row, columns[1], 0.0, 90.0));
  direction.phi_d = Angle::from_degrees(reader.number_within(row, columns[2], -180.0, 180.0));
  return direction;
}

void refuse_below_horizon(const CsvReader& reader, const CsvRow& row,
                          const std::array<std::size_t, 3>& columns,
                          const brdf::HalfDiff& direction) {
  if (brdf::above_horizon(direction.theta_h, direction.theta_d, direction.phi_d)) return;
  throw DataFormatError(reader.path(), "line " + std::to_string(row.line),
                        "found direction (" + row.cells[columns[0]] + ", " + row.cells[columns[1]] +
                            ", " + row.cells[columns[2]] +
                            ") with light or detector below the horizon, expected both above it");
}

std::vector<Direction> read_directions(const std::filesystem::path& path,
                                       BelowHorizon below_horizon) {
  CsvReader reader(path);
  constexpr std::array<std::size_t, 3> kFirst{0, 1, 2};
  for (const std::size_t i : kFirst) {
    const std::string found = i < reader.header().size() ? reader.header()[i] : "";
    if (found == kDirectionColumns[i]) continue;
    throw DataFormatError(path, "line " + std::to_string(reader.header_line()),
                          "found '" + found + "' as column " + std::to_string(i + 1) +
                              " of the header, expected " + std::string(kDirectionColumns[i]));
  }
  std::vector<Direction> directions;
  std::map<std::tuple<double, double, double>, int> line_of;
  while (const auto row = reader.next()) {
    const brdf::HalfDiff angles = direction_of(reader, *row, kFirst);
    if (below_horizon == BelowHorizon::Refuse) {
      refuse_below_horizon(reader, *row, kFirst, angles);
    }
    const double phi_d = wrap_to_half_turn(angles.phi_d).degrees();
    const auto [seen, is_new] =
        line_of.try_emplace({angles.theta_h.degrees(), angles.theta_d.degrees(), phi_d}, row->line);
    if (!is_new) {
      throw DataFormatError(path, "line " + std::to_string(row->line),
                            "found the direction of line " + std::to_string(seen->second) +
                                " again, expected each direction once");
    }
    directions.push_back({angles, row->line});
  }
  if (directions.empty()) {
    throw DataFormatError(path, "line " + std::to_string(reader.header_line()),
                          "found a header without rows, expected at least one direction");
  }
  return directions;
}

}  // namespace gonio::samples
