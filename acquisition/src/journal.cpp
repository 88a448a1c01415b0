#include "journal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <stdexcept>

#include "gonio/errors/errors.h"
#include "gonio/files/sha256.h"

namespace gonio::acquisition {
namespace {

/// "gnio" in the header's application id, so that a foreign SQLite file is told apart.
constexpr int kApplicationId = 0x676E696F;
constexpr int kSchemaVersion = 1;
constexpr int kBusyTimeout_ms = 5000;

const std::map<std::string, std::vector<std::string>, std::less<>>& tables() {
  static const std::map<std::string, std::vector<std::string>, std::less<>> kTables{
      {"metadata", {"key", "value"}},
      {"configuration", {"name", "text"}},
      {"frames",
       {"kind", "point", "channel", "joints_deg", "joints_spread_deg", "exposure_ns",
        "exposure_start_ns", "monitor", "camera_frame_id", "file", "sha256", "width_px",
        "height_px", "pixel_format", "saturation_level_dn", "black_level_dn", "gain_db"}},
      {"points",
       {"point", "theta_h_deg", "theta_d_deg", "phi_d_deg", "branch", "joints_deg", "outcome",
        "note", "finished_at_ns"}},
      {"notes", {"at_ns", "kind", "text"}},
      {"finished", {"at_ns"}}};
  return kTables;
}

/// Over table name, row number and values, each with its length, so that no two rows look alike.
std::string checksum(std::string_view table, std::int64_t number,
                     const std::vector<std::string>& values) {
  files::Sha256 hash;
  hash.update(fmt::format("{}:{};", table, number));
  for (const std::string& value : values) {
    hash.update(fmt::format("{}:", value.size()));
    hash.update(value);
  }
  return hash.finish().substr(0, 32);
}

}  // namespace

const std::vector<std::string>& columns_of(std::string_view table) {
  const auto found = tables().find(table);
  if (found == tables().end()) {
    throw std::invalid_argument(fmt::format("the journal has no table {:?}", table));
  }
  return found->second;
}

Journal::Journal(std::filesystem::path path, int flags) : path_(std::move(path)) {
  sqlite3* raw = nullptr;
  const int result = sqlite3_open_v2(path_.c_str(), &raw, flags, nullptr);
  database_.reset(raw);
  if (result != SQLITE_OK) fail("open");
  sqlite3_busy_timeout(raw, kBusyTimeout_ms);
  sqlite3_extended_result_codes(raw, 1);
}

void Journal::fail(const std::string& action) const {
  const int code = database_ ? sqlite3_extended_errcode(database_.get()) : SQLITE_NOMEM;
  const std::string reason = database_ ? sqlite3_errmsg(database_.get()) : "out of memory";
  if (code == SQLITE_NOTADB || (code & 0xFF) == SQLITE_CORRUPT) {
    throw DataFormatError(path_, "journal", reason);
  }
  throw FileError(path_, action, reason);
}

void Journal::run(const std::string& sql) {
  if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    fail("write");
  }
}

Journal::Statement Journal::prepare(const std::string& sql) const {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
    fail("read");
  }
  return Statement(statement);
}

Journal Journal::create(const std::filesystem::path& path) {
  Journal journal(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  journal.run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;");
  journal.run(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {};", kApplicationId,
                          kSchemaVersion));
  std::string schema = "BEGIN;";
  for (const auto& [table, columns] : tables()) {
    schema += fmt::format(
        "CREATE TABLE {} (number INTEGER PRIMARY KEY, {} TEXT NOT NULL, "
        "checksum TEXT NOT NULL);",
        table, fmt::join(columns, " TEXT NOT NULL, "));
    for (const char* change : {"UPDATE", "DELETE"}) {
      schema += fmt::format(
          "CREATE TRIGGER {0}_no_{1} BEFORE {1} ON {0} BEGIN "
          "SELECT RAISE(ABORT, 'rows of a session are never changed'); END;",
          table, change);
    }
  }
  journal.run(schema + "COMMIT;");
  return journal;
}

Journal Journal::open(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw FileError(path, "open", "there is no session journal");
  }
  // Read and write, since only a writer may recover the log of a killed run; a read-only place
  // falls back to what the main file holds.
  const bool writable = [&] {
    try {
      Journal probe(path, SQLITE_OPEN_READWRITE);
      return sqlite3_db_readonly(probe.database_.get(), "main") == 0;
    } catch (const FileError&) {
      return false;
    }
  }();
  Journal journal(path, writable ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY);
  const auto integer = [&](const char* pragma) {
    const Statement statement = journal.prepare(fmt::format("PRAGMA {};", pragma));
    if (sqlite3_step(statement.get()) != SQLITE_ROW) journal.fail("read");
    return sqlite3_column_int(statement.get(), 0);
  };
  if (integer("application_id") != kApplicationId) {
    throw DataFormatError(path, "header", "not a session journal (application id)");
  }
  if (const int version = integer("user_version"); version != kSchemaVersion) {
    throw DataFormatError(path, "header",
                          fmt::format("journal version {}, expected {}", version, kSchemaVersion));
  }
  return journal;
}

void Journal::close_log() { run("PRAGMA journal_mode = DELETE;"); }

void Journal::append(std::string_view table, const std::vector<std::string>& values) {
  const std::vector<std::string>& columns = columns_of(table);
  if (values.size() != columns.size()) {
    throw std::invalid_argument(fmt::format("a row of {:?} has {} values", table, columns.size()));
  }
  std::int64_t number = 0;
  {
    const Statement last = prepare(fmt::format("SELECT coalesce(max(number), 0) FROM {};", table));
    if (sqlite3_step(last.get()) != SQLITE_ROW) fail("read");
    number = sqlite3_column_int64(last.get(), 0) + 1;
  }
  std::string marks;
  for (std::size_t i = 0; i < values.size(); ++i) marks += "?, ";
  const Statement insert = prepare(fmt::format("INSERT INTO {} VALUES (?, {}?);", table, marks));
  sqlite3_bind_int64(insert.get(), 1, number);
  int place = 2;
  const auto bind = [&](const std::string& text) {
    if (sqlite3_bind_text64(insert.get(), place++, text.data(), text.size(), SQLITE_TRANSIENT,
                            SQLITE_UTF8) != SQLITE_OK) {
      fail("write");
    }
  };
  for (const std::string& value : values) bind(value);
  bind(checksum(table, number, values));
  if (sqlite3_step(insert.get()) != SQLITE_DONE) fail("write");
}

std::vector<Journal::Row> Journal::rows(std::string_view table) const {
  const std::size_t count = columns_of(table).size();
  const Statement select =
      prepare(fmt::format("SELECT number, {}, checksum FROM {} ORDER BY number;",
                          fmt::join(columns_of(table), ", "), table));
  std::vector<Row> result;
  const auto text = [&](int column) {
    const auto* bytes = sqlite3_column_text(select.get(), column);
    return std::string(reinterpret_cast<const char*>(bytes),
                       static_cast<std::size_t>(sqlite3_column_bytes(select.get(), column)));
  };
  for (;;) {
    const int step = sqlite3_step(select.get());
    if (step == SQLITE_DONE) return result;
    if (step != SQLITE_ROW) fail("read");
    Row row{sqlite3_column_int64(select.get(), 0), {}, false};
    for (std::size_t i = 0; i < count; ++i) row.values.push_back(text(static_cast<int>(i) + 1));
    row.intact = text(static_cast<int>(count) + 1) == checksum(table, row.number, row.values);
    result.push_back(std::move(row));
  }
}

}  // namespace gonio::acquisition
