#include "gonio/setup/white_certificate.h"

#include <fmt/format.h>

#include <array>
#include <map>
#include <set>
#include <string>

#include "gonio/errors/errors.h"
#include "gonio/samples/csv.h"

namespace gonio::cli {
namespace {

constexpr std::array<const char*, 4> kCertificateColumns{"theta_i_deg", "theta_o_deg",
                                                         "delta_phi_deg", "factor"};
constexpr std::array<double, 3> kMostDeg{90.0, 90.0, 180.0};
constexpr std::size_t kMostRows = 100000;
// A white reference is no mirror: beyond these a number is a mistake.
constexpr double kLeastFactor = 0.01;
constexpr double kMostFactor = 10.0;

std::string header_place(const samples::CsvReader& reader) {
  return fmt::format("line {}", reader.header_line());
}

std::array<std::size_t, 4> certificate_columns(const samples::CsvReader& reader) {
  std::array<std::size_t, 4> columns{};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto found = reader.column(kCertificateColumns[i]);
    if (!found) {
      throw DataFormatError(reader.path(), header_place(reader),
                            fmt::format("found no column {}, expected {}", kCertificateColumns[i],
                                        fmt::join(kCertificateColumns, ", ")));
    }
    columns[i] = *found;
  }
  return columns;
}

}  // namespace

instrument::AngularTable read_white_certificate(const std::filesystem::path& path) {
  samples::CsvReader reader(path);
  const auto columns = certificate_columns(reader);
  struct Found {
    double factor;
    int line;
  };
  std::map<std::array<double, 3>, Found> rows;  // in the table's order
  std::array<std::set<double>, 3> nodes;
  while (const auto row = reader.next()) {
    const std::string place = fmt::format("line {}", row->line);
    if (rows.size() == kMostRows) {
      throw DataFormatError(path, place, fmt::format("expected at most {} rows", kMostRows));
    }
    std::array<double, 3> angles{};
    for (std::size_t i = 0; i < angles.size(); ++i) {
      angles[i] = reader.number_within(*row, columns[i], 0.0, kMostDeg[i]) + 0.0;  // no -0
      nodes[i].insert(angles[i]);
    }
    const double factor = reader.number_within(*row, columns[3], kLeastFactor, kMostFactor);
    const auto [seen, is_new] = rows.try_emplace(angles, Found{factor, row->line});
    if (!is_new) {
      throw DataFormatError(
          path, place,
          fmt::format("found the angles of line {} again, expected each once", seen->second.line));
    }
  }
  const std::size_t expected = nodes[0].size() * nodes[1].size() * nodes[2].size();
  if (rows.empty() || rows.size() != expected) {
    throw DataFormatError(
        path, "rows",
        fmt::format("found {} rows with {} theta_i, {} theta_o and {} delta_phi, expected a row "
                    "for every combination of at least one each",
                    rows.size(), nodes[0].size(), nodes[1].size(), nodes[2].size()));
  }
  instrument::AngularTable table;
  table.theta_i_deg.assign(nodes[0].begin(), nodes[0].end());
  table.theta_o_deg.assign(nodes[1].begin(), nodes[1].end());
  table.delta_phi_deg.assign(nodes[2].begin(), nodes[2].end());
  for (const auto& [angles, found] : rows) table.factor.push_back(found.factor);
  return table;
}

}  // namespace gonio::cli
