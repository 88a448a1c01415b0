#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/units/angle.h"

namespace gonio::samples {

/// `text` without the spaces and tabs at its ends.
std::string_view trimmed(std::string_view text);

/// One line of a CSV file, cells without surrounding blanks and quotes.
struct CsvRow {
  int line = 0;  ///< 1-based line in the file
  std::vector<std::string> cells;
};

/// Strict reader of the comma-separated files people and other tools write for us: one header
/// line, rows of exactly its length, '#' comment lines anywhere, blank lines skipped, CRLF and a
/// UTF-8 byte order mark accepted, cells optionally in double quotes ("" inside stands for one).
///
/// Hostile  The file is untrusted: at most 256 MiB, 64 KiB a line, 1,024 columns; control
///          characters are refused; rows are handed out one at a time, so memory stays near the
///          size of the file. Folders, pipes and devices are refused.
/// Errors   FileError when it cannot be read; DataFormatError with path, "line N, column NAME",
///          what was found and what was expected.
/// Threads  One at a time.
class CsvReader {
 public:
  /// Reads the file and its header.
  explicit CsvReader(const std::filesystem::path& path);
  /// The same of a text; `place` names it in errors.
  CsvReader(const std::filesystem::path& place, std::string text);

  const std::vector<std::string>& header() const { return header_; }
  int header_line() const { return header_line_; }
  /// Where a column stands, if it is there.
  std::optional<std::size_t> column(std::string_view name) const;

  /// The next row, or nothing at the end.
  std::optional<CsvRow> next();

  /// Comment lines read so far, without the '#' and the blank after it; complete after the last
  /// next(). With their line numbers.
  struct Comment {
    int line;
    std::string text;
  };
  const std::vector<Comment>& comments() const { return comments_; }

  /// The cell as a finite number. The whole cell must be the number.
  double number(const CsvRow& row, std::size_t column) const;
  /// The same within [min, max].
  double number_within(const CsvRow& row, std::size_t column, double min, double max) const;
  /// The cell as a whole number within [min, max].
  long long integer_within(const CsvRow& row, std::size_t column, long long min,
                           long long max) const;

  /// "line 7, column theta_h_deg", for errors of the caller's own.
  std::string place(const CsvRow& row, std::size_t column) const;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::optional<std::string_view> next_content_line();

  std::filesystem::path path_;
  std::string text_;
  std::size_t position_ = 0;
  int line_ = 0;
  int header_line_ = 0;
  std::vector<std::string> header_;
  std::vector<Comment> comments_;
};

/// The shortest decimal text that reads back as the same double. Throws std::invalid_argument for
/// a number that is not finite.
std::string csv_number(double value);

/// An angle in degrees, as short as reads back to the same Angle: 28 degrees are written "28"
/// although the radians inside are not a round number.
std::string csv_degrees(Angle angle);

/// Text as one cell: quoted when it has to be. Throws std::invalid_argument for control characters,
/// which a line-based file cannot hold.
std::string csv_cell(std::string_view text);

}  // namespace gonio::samples
