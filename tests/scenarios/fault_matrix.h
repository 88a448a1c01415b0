#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cctype>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

/// docs/fault_matrix.csv, whose cells are tests. GONIO_FAULT_MATRIX is its path.
namespace gonio {

inline constexpr std::array<const char*, 8> kPhases{"connect", "home",  "dark",          "white",
                                                    "point",   "check", "closing white", "park"};

/// One fault in one phase of a session.
struct FaultCell {
  std::string row;  ///< of the table of faults
  std::string fault;
  std::string device;
  std::string lasts;
  std::string over;  ///< by which test it is asserted
  std::string phase;
  std::string outcome;  ///< "-": it cannot be
  /// From the fault to its outcome, 0: not asserted. On the session's clock; over the wire, whose
  /// deadlines are the host's, on the host's.
  double within_s = 0.0;
  std::string dash_because;

  bool is_possible() const { return outcome != "-"; }
  /// Letters, digits and underscores.
  std::string name() const {
    std::string text = fault + "_" + device + "_" + lasts + "_in_" + phase;
    for (char& each : text) {
      if (std::isalnum(static_cast<unsigned char>(each)) == 0) each = '_';
    }
    return text;
  }
};

inline void PrintTo(const FaultCell& cell, std::ostream* stream) {
  *stream << cell.name() << ": " << cell.outcome;
}

/// All cells, row by row. Throws std::runtime_error naming the line.
inline std::vector<FaultCell> fault_matrix() {
  std::ifstream file(GONIO_FAULT_MATRIX);
  std::vector<FaultCell> cells;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    std::vector<std::string> fields;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, ',');) fields.push_back(word);
    constexpr std::size_t kBefore = 5;
    if (fields.size() != kBefore + kPhases.size() + 2) {
      throw std::runtime_error("fault_matrix.csv:" + std::to_string(number) + ": found " +
                               std::to_string(fields.size()) + " fields");
    }
    if (number == 1) continue;
    for (std::size_t i = 0; i < kPhases.size(); ++i) {
      cells.push_back({fields[0], fields[1], fields[2], fields[3], fields[4], kPhases.at(i),
                       fields[kBefore + i], std::stod(fields[kBefore + kPhases.size()]),
                       fields.back()});
    }
  }
  return cells;
}

/// Those that a test program asserts.
inline std::vector<FaultCell> possible_cells(const std::string& over) {
  std::vector<FaultCell> found;
  for (FaultCell& cell : fault_matrix()) {
    if (cell.over == over && cell.is_possible()) found.push_back(std::move(cell));
  }
  return found;
}

inline std::string name_of_cell(const testing::TestParamInfo<FaultCell>& info) {
  return info.param.name();
}

}  // namespace gonio
