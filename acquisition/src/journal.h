#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace gonio::acquisition {

/// Of a journal that is created.
inline constexpr int kSchemaVersion = 2;

/// The only code that calls SQLite. Every value of a row is text, so that one checksum covers the
/// row as a reader sees it.
///
/// Hostile  Tables must be defined as create() does, so that no SQL of the file is ever run. What
///          reading takes is bounded by the size of the file, whatever its pages claim.
/// Errors   FileError naming the journal and SQLite's reason; DataFormatError for a file that is no
///          journal of ours.
/// Threads  One.
class Journal {
 public:
  /// Creates the tables, write-ahead log, synchronous FULL; rows can only ever be added.
  static Journal create(const std::filesystem::path& path);
  /// Opens for reading; a log left by a killed writer is taken into account. Refuses what create()
  /// did not make, also beside the journal.
  static Journal open(const std::filesystem::path& path);

  /// Opens a journal of create() to add to it, with the checks of open().
  static Journal reopen(const std::filesystem::path& path);

  /// Rows that belong together: all of them, or after a kill none, are there. Who only reads sees
  /// one state of all tables from the first that it reads until commit(), whatever is added
  /// meanwhile.
  void begin() { run("BEGIN;"); }
  void commit() { run("COMMIT;"); }
  void roll_back() { run("ROLLBACK;"); }

  /// Folds the log into the main file, so that the finished journal can be read where nothing may
  /// be written. Not while somebody reads it: then the log stays, and no row is missing for that.
  void close_log();

  /// Adds a row with its checksum, durable on return, between begin() and commit() then.
  void append(std::string_view table, const std::vector<std::string>& values);

  struct Row {
    std::int64_t number;  ///< from 1, ascending
    std::vector<std::string> values;
    bool intact;  ///< the stored checksum fits
  };
  /// Number of the last row, 0 without one.
  std::int64_t last_number(std::string_view table) const;
  /// Whether its end says how many rows there are: since version 2 of the schema. A session that
  /// goes on keeps the version that it was begun with.
  bool counts_its_rows() const { return version_ > 1; }
  /// All rows of a table in the order they were added.
  std::vector<Row> rows(std::string_view table) const;

 private:
  struct Close {
    void operator()(sqlite3* database) const noexcept { sqlite3_close_v2(database); }
  };
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const noexcept { sqlite3_finalize(statement); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

  Journal(std::filesystem::path path, int flags);
  /// From here on SQLite may hold and do only as much as a file of `bytes` can ask for.
  void bound_by(std::uintmax_t bytes);
  void require_own_tables() const;
  void run(const std::string& sql);
  Statement prepare(const std::string& sql) const;
  [[noreturn]] void fail(const std::string& action) const;

  std::filesystem::path path_;
  int version_;
  /// Of the file and its log, when it was opened for reading.
  std::uintmax_t bytes_ = std::numeric_limits<std::uintmax_t>::max();
  std::unique_ptr<std::uint64_t> steps_left_;  ///< SQLite has its address
  std::unique_ptr<sqlite3, Close> database_;
};

/// Columns of a table in a version of the schema, checksum not counted; throws
/// std::invalid_argument for an unknown table.
const std::vector<std::string>& columns_of(std::string_view table, int version = kSchemaVersion);

}  // namespace gonio::acquisition
