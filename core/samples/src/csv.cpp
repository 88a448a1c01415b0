#include "gonio/samples/csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <system_error>

#include "gonio/errors/errors.h"
#include "gonio/files/text_file.h"

namespace gonio::samples {
namespace {

constexpr std::size_t kMaxLineBytes = std::size_t{64} << 10;
constexpr std::size_t kMaxColumns = 1024;
constexpr std::size_t kMaxQuotedBytes = 40;  // of a bad cell in an error line

std::string line_place(int line) { return "line " + std::to_string(line); }

/// A bad cell as it may stand in a one-line message.
std::string as_found(std::string_view text) {
  if (text.empty()) return "an empty cell";
  if (text.size() <= kMaxQuotedBytes) return "'" + std::string(text) + "'";
  return "'" + std::string(text.substr(0, kMaxQuotedBytes)) + "...'";
}

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte < 0x20 && c != '\t') || byte == 0x7f;
}

/// Splits one line at commas outside quotes.
std::vector<std::string> split(const std::filesystem::path& path, int line, std::string_view text) {
  std::vector<std::string> cells;
  std::size_t at = 0;
  while (true) {
    if (cells.size() == kMaxColumns) {
      throw DataFormatError(path, line_place(line), "found more than 1024 columns");
    }
    at = std::min(text.find_first_not_of(" \t", at), text.size());
    if (at < text.size() && text[at] == '"') {
      std::string cell;
      std::size_t from = at + 1;
      while (true) {
        const auto quote = text.find('"', from);
        if (quote == std::string_view::npos) {
          throw DataFormatError(path, line_place(line),
                                "found an open double quote, expected it closed on the same line");
        }
        cell.append(text.substr(from, quote - from));
        at = quote + 1;
        if (at >= text.size() || text[at] != '"') break;
        cell.push_back('"');
        from = at + 1;
      }
      cells.push_back(std::move(cell));
      at = std::min(text.find_first_not_of(" \t", at), text.size());
      if (at < text.size() && text[at] != ',') {
        throw DataFormatError(path, line_place(line),
                              "found text after a closing double quote, expected a comma");
      }
    } else {
      const auto comma = std::min(text.find(',', at), text.size());
      cells.emplace_back(trimmed(text.substr(at, comma - at)));
      at = comma;
    }
    if (at >= text.size()) return cells;
    ++at;  // the comma
  }
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

CsvReader::CsvReader(const std::filesystem::path& path)
    : CsvReader(path, files::read_text_file(path)) {}

CsvReader::CsvReader(const std::filesystem::path& place, std::string text)
    : path_(place), text_(std::move(text)) {
  if (text_.compare(0, 3, "\xEF\xBB\xBF") == 0) position_ = 3;
  const auto line = next_content_line();
  if (!line) throw DataFormatError(path_, line_place(line_ + 1), "found no header line");
  header_line_ = line_;
  header_ = split(path_, line_, *line);
  for (std::size_t i = 0; i < header_.size(); ++i) {
    if (header_[i].empty()) {
      throw DataFormatError(path_, line_place(line_),
                            "found no name for column " + std::to_string(i + 1));
    }
    const auto seen = header_.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(header_.begin(), seen, header_[i]) != seen) {
      throw DataFormatError(path_, line_place(line_) + ", column " + header_[i],
                            "found twice, expected once");
    }
  }
}

std::optional<std::size_t> CsvReader::column(std::string_view name) const {
  const auto found = std::find(header_.begin(), header_.end(), name);
  if (found == header_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - header_.begin());
}

std::optional<std::string_view> CsvReader::next_content_line() {
  while (position_ < text_.size()) {
    ++line_;
    const auto end = std::min(text_.find('\n', position_), text_.size());
    std::string_view line = std::string_view(text_).substr(position_, end - position_);
    position_ = end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.size() > kMaxLineBytes) {
      throw DataFormatError(path_, line_place(line_), "found a line longer than 64 KiB");
    }
    const auto control = std::find_if(line.begin(), line.end(), is_control);
    if (control != line.end()) {
      throw DataFormatError(path_, line_place(line_),
                            "found control character " +
                                std::to_string(static_cast<unsigned char>(*control)) + " at byte " +
                                std::to_string(control - line.begin() + 1) + ", expected text");
    }
    line = trimmed(line);
    if (line.empty()) continue;
    if (line.front() != '#') return line;
    comments_.push_back({line_, std::string(trimmed(line.substr(1)))});
  }
  return std::nullopt;
}

std::optional<CsvRow> CsvReader::next() {
  const auto line = next_content_line();
  if (!line) return std::nullopt;
  CsvRow row{line_, split(path_, line_, *line)};
  if (row.cells.size() != header_.size()) {
    throw DataFormatError(path_, line_place(line_),
                          "found " + std::to_string(row.cells.size()) + " cells, expected " +
                              std::to_string(header_.size()) + " as in the header of line " +
                              std::to_string(header_line_));
  }
  return row;
}

std::string CsvReader::place(const CsvRow& row, std::size_t column) const {
  return line_place(row.line) + ", column " + header_[column];
}

double CsvReader::number(const CsvRow& row, std::size_t column) const {
  const std::string& cell = row.cells[column];
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value)) {
    throw DataFormatError(path_, place(row, column),
                          "found " + as_found(cell) + ", expected a finite number");
  }
  return value;
}

double CsvReader::number_within(const CsvRow& row, std::size_t column, double min,
                                double max) const {
  const double value = number(row, column);
  if (value < min || value > max) {
    const std::string range = max == HUGE_VAL ? "at least " + csv_number(min)
                                              : csv_number(min) + " to " + csv_number(max);
    throw DataFormatError(path_, place(row, column),
                          "found " + as_found(row.cells[column]) + ", expected " + range);
  }
  return value;
}

long long CsvReader::integer_within(const CsvRow& row, std::size_t column, long long min,
                                    long long max) const {
  const std::string& cell = row.cells[column];
  long long value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || value < min || value > max) {
    throw DataFormatError(path_, place(row, column),
                          "found " + as_found(cell) + ", expected a whole number from " +
                              std::to_string(min) + " to " + std::to_string(max));
  }
  return value;
}

std::string csv_number(double value) {
  if (!std::isfinite(value)) throw std::invalid_argument("csv_number: the value is not finite");
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

std::string csv_degrees(Angle angle) {
  const double degrees = angle.degrees();
  if (!std::isfinite(degrees)) throw std::invalid_argument("csv_degrees: the angle is not finite");
  // The conversion rounds, so the shortest text of the degrees need not be the shortest that gives
  // the same radians: try round numbers first, then the neighbours of the rounded conversion.
  for (const int digits : {15, 16, 17}) {
    std::array<char, 40> text{};
    const auto written = std::to_chars(text.data(), text.data() + text.size(), degrees,
                                       std::chars_format::general, digits);
    double back = 0.0;
    std::from_chars(text.data(), written.ptr, back);
    if (Angle::from_degrees(back) == angle) return csv_number(back);
  }
  for (const double towards : {-HUGE_VAL, HUGE_VAL}) {
    const double neighbour = std::nextafter(degrees, towards);
    if (Angle::from_degrees(neighbour) == angle) return csv_number(neighbour);
  }
  return csv_number(degrees);  // no double maps to these radians exactly: 1 ulp off
}

std::string csv_cell(std::string_view text) {
  if (std::any_of(text.begin(), text.end(), is_control)) {
    throw std::invalid_argument("csv_cell: control character in the text of a cell");
  }
  const bool plain = text.find_first_of(",\"") == std::string_view::npos &&
                     trimmed(text).size() == text.size() && (text.empty() || text.front() != '#');
  if (plain) return std::string(text);
  std::string cell = "\"";
  for (const char c : text) {
    if (c == '"') cell.push_back('"');
    cell.push_back(c);
  }
  cell.push_back('"');
  return cell;
}

}  // namespace gonio::samples
