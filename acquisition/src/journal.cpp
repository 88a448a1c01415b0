#include "journal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <span>
#include <stdexcept>

#include "gonio/errors/errors.h"
#include "gonio/files/input_file.h"
#include "gonio/files/sha256.h"

namespace gonio::acquisition {
namespace {

/// A writer only appends: it needs few pages at hand, and a cache that is never full grows all day.
constexpr const char* kWriterPragmas =
    "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA cache_size = -256;";

/// "gnio" in the header's application id, so that a foreign SQLite file is told apart.
constexpr int kApplicationId = 0x676E696F;
constexpr int kOldestVersion = 1;
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
      {"finished", {"at_ns", "row_counts"}}};
  return kTables;
}

/// Of the first version of the schema, whose end did not say how much there is.
const std::vector<std::string>& first_finished() {
  static const std::vector<std::string> kColumns{"at_ns"};
  return kColumns;
}

/// As it stands in the schema of a journal.
std::string definition_of(std::string_view table, int version) {
  return fmt::format(
      "CREATE TABLE {} (number INTEGER PRIMARY KEY, {} TEXT NOT NULL, checksum TEXT NOT NULL)",
      table, fmt::join(columns_of(table, version), " TEXT NOT NULL, "));
}

constexpr std::array<const char*, 2> kChanges{"UPDATE", "DELETE"};

std::string trigger_against(std::string_view change, std::string_view table) {
  return fmt::format(
      "CREATE TRIGGER {0}_no_{1} BEFORE {1} ON {0} BEGIN "
      "SELECT RAISE(ABORT, 'rows of a session are never changed'); END",
      table, change);
}

bool is_own_trigger(std::string_view sql) {
  for (const auto& [table, columns] : tables()) {
    for (const char* change : kChanges) {
      if (trigger_against(change, table) == sql) return true;
    }
  }
  return false;
}

/// Rows are numbered one by one; their successor must be a number, too.
constexpr std::int64_t kMostRows = std::int64_t{1} << 40U;

/// Virtual machine steps between two looks at how many are left.
constexpr int kStepsPerLook = 1000;

int take_steps(void* left) {
  auto& steps_left = *static_cast<std::uint64_t*>(left);
  if (steps_left < kStepsPerLook) return 1;
  steps_left -= kStepsPerLook;
  return 0;
}

/// 0 when it is not there.
std::uintmax_t size_of(const std::filesystem::path& path) {
  std::error_code missing;
  const std::uintmax_t size = std::filesystem::file_size(path, missing);
  return missing ? 0 : size;
}

/// A rollback journal may name a "super-journal" of a transaction over several databases, which
/// SQLite deletes after the rollback, whatever file that is. Ours never span two.
void require_no_super_journal(const std::filesystem::path& journal) {
  constexpr std::array<unsigned char, 8> kLast{0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7};
  std::filesystem::path rollback = std::filesystem::canonical(journal);
  rollback += "-journal";
  auto file = files::InputFile::open_if_exists(rollback);
  if (!file || file->size() < kLast.size()) return;
  std::array<unsigned char, kLast.size()> last{};
  file->read_at(file->size() - kLast.size(), std::as_writable_bytes(std::span(last)));
  if (last == kLast) {
    throw DataFormatError(rollback, "end",
                          "found the name of another file, which SQLite would delete, expected a "
                          "rollback journal of this file alone");
  }
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

const std::vector<std::string>& columns_of(std::string_view table, int version) {
  if (version == kOldestVersion && table == "finished") return first_finished();
  const auto found = tables().find(table);
  if (found == tables().end()) {
    throw std::invalid_argument(fmt::format("the journal has no table {:?}", table));
  }
  return found->second;
}

Journal::Journal(std::filesystem::path path, int flags)
    : path_(std::move(path)), version_(kSchemaVersion) {
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
  if (code == SQLITE_INTERRUPT) {
    throw DataFormatError(path_, "journal", "found more rows than a file of its size can hold");
  }
  if (code == SQLITE_NOTADB || code == SQLITE_TOOBIG || (code & 0xFF) == SQLITE_CORRUPT) {
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
  journal.run(kWriterPragmas);
  journal.run(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {};", kApplicationId,
                          kSchemaVersion));
  std::string schema = "BEGIN;";
  for (const auto& entry : tables()) {
    const std::string& table = entry.first;
    schema += definition_of(table, kSchemaVersion) + ";";
    for (const char* change : kChanges) schema += trigger_against(change, table) + ";";
  }
  journal.run(schema + "COMMIT;");
  return journal;
}

Journal Journal::reopen(const std::filesystem::path& path) {
  const int version = open(path).version_;
  Journal journal(path, SQLITE_OPEN_READWRITE);
  journal.version_ = version;
  journal.run(kWriterPragmas);
  return journal;
}

Journal Journal::open(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw FileError(path, "open", "there is no session journal");
  }
  require_no_super_journal(path);
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
  const std::filesystem::path canonical = std::filesystem::canonical(path);
  journal.bound_by(size_of(canonical) + size_of(canonical.string() + "-wal"));
  const auto integer = [&](const char* pragma) {
    const Statement statement = journal.prepare(fmt::format("PRAGMA {};", pragma));
    if (sqlite3_step(statement.get()) != SQLITE_ROW) journal.fail("read");
    return sqlite3_column_int(statement.get(), 0);
  };
  if (integer("application_id") != kApplicationId) {
    throw DataFormatError(path, "header", "not a session journal (application id)");
  }
  journal.version_ = integer("user_version");
  if (journal.version_ < kOldestVersion || journal.version_ > kSchemaVersion) {
    throw DataFormatError(path, "header",
                          fmt::format("journal version {}, expected {} to {}", journal.version_,
                                      kOldestVersion, kSchemaVersion));
  }
  journal.require_own_tables();
  return journal;
}

void Journal::bound_by(std::uintmax_t bytes) {
  // A row of the smallest values takes about as many steps as bytes.
  constexpr std::uint64_t kStepsPerByte = 4;
  constexpr std::uint64_t kStepsForTheSchema = 100'000;
  bytes_ = bytes;
  steps_left_ = std::make_unique<std::uint64_t>(kStepsForTheSchema + kStepsPerByte * bytes);
  sqlite3_progress_handler(database_.get(), kStepsPerLook, take_steps, steps_left_.get());
  constexpr std::uintmax_t kShortestLimit = 100'000;  // SQLite's own texts are bound by it, too
  sqlite3_limit(database_.get(), SQLITE_LIMIT_LENGTH,
                static_cast<int>(std::clamp<std::uintmax_t>(bytes, kShortestLimit,
                                                            std::numeric_limits<int>::max())));
}

void Journal::require_own_tables() const {
  // A view or a virtual table of the same name would be a program.
  const Statement select =
      prepare("SELECT sql FROM sqlite_schema WHERE name = ? AND type = 'table';");
  for (const auto& entry : tables()) {
    const std::string& table = entry.first;
    sqlite3_bind_text(select.get(), 1, table.c_str(), -1, SQLITE_TRANSIENT);
    const int step = sqlite3_step(select.get());
    if (step != SQLITE_ROW && step != SQLITE_DONE) fail("read");
    const auto* text = step == SQLITE_ROW ? sqlite3_column_text(select.get(), 0) : nullptr;
    if (text == nullptr || definition_of(table, version_) != reinterpret_cast<const char*>(text)) {
      throw DataFormatError(path_, fmt::format("table {}", table),
                            text == nullptr ? "is missing" : "is not defined as in a journal");
    }
    sqlite3_reset(select.get());
  }
  // A trigger of somebody else's could drop rows that the writer takes for acknowledged.
  const Statement programs =
      prepare("SELECT name, sql FROM sqlite_schema WHERE type IN ('trigger', 'view');");
  for (;;) {
    const int step = sqlite3_step(programs.get());
    if (step == SQLITE_DONE) return;
    if (step != SQLITE_ROW) fail("read");
    const auto* name = sqlite3_column_text(programs.get(), 0);
    const auto* text = sqlite3_column_text(programs.get(), 1);
    const std::string found = text == nullptr ? "" : reinterpret_cast<const char*>(text);
    if (is_own_trigger(found)) continue;
    throw DataFormatError(path_, "schema",
                          fmt::format("found a program {:?}, which is none of a journal's",
                                      name == nullptr ? "" : reinterpret_cast<const char*>(name)));
  }
}

void Journal::close_log() {
  const char* const kFold = "PRAGMA journal_mode = DELETE;";
  if (sqlite3_exec(database_.get(), kFold, nullptr, nullptr, nullptr) == SQLITE_OK) return;
  // Whoever looks on, in this process or in another, must not make a finished session fail.
  if ((sqlite3_extended_errcode(database_.get()) & 0xFF) != SQLITE_BUSY) fail("write");
}

void Journal::append(std::string_view table, const std::vector<std::string>& values) {
  const std::vector<std::string>& columns = columns_of(table, version_);
  if (values.size() != columns.size()) {
    throw std::invalid_argument(fmt::format("a row of {:?} has {} values", table, columns.size()));
  }
  const std::int64_t number = last_number(table) + 1;
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

std::int64_t Journal::last_number(std::string_view table) const {
  const Statement last = prepare(fmt::format("SELECT coalesce(max(number), 0) FROM {};", table));
  if (sqlite3_step(last.get()) != SQLITE_ROW) fail("read");
  return sqlite3_column_int64(last.get(), 0);
}

std::vector<Journal::Row> Journal::rows(std::string_view table) const {
  const std::size_t count = columns_of(table, version_).size();
  const Statement select =
      prepare(fmt::format("SELECT number, {}, checksum FROM {} ORDER BY number;",
                          fmt::join(columns_of(table, version_), ", "), table));
  std::vector<Row> result;
  // Pages may be shared by many rows: all together hold no more than the file.
  std::uintmax_t room = bytes_;
  const auto text = [&](int column) {
    const auto* bytes = sqlite3_column_text(select.get(), column);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(select.get(), column));
    if (bytes == nullptr && sqlite3_errcode(database_.get()) == SQLITE_NOMEM) fail("read");
    if (size > room) {
      throw DataFormatError(path_, fmt::format("table {}", table),
                            "found more text than the file can hold");
    }
    room -= size;
    return std::string(reinterpret_cast<const char*>(bytes), size);
  };
  std::int64_t last = 0;
  for (;;) {
    const int step = sqlite3_step(select.get());
    if (step == SQLITE_DONE) return result;
    if (step != SQLITE_ROW) fail("read");
    Row row{sqlite3_column_int64(select.get(), 0), {}, false};
    if (row.number <= last || row.number > kMostRows) {
      throw DataFormatError(
          path_, fmt::format("table {}", table),
          fmt::format("found row {} after row {}, expected a later one", row.number, last));
    }
    last = row.number;
    for (std::size_t i = 0; i < count; ++i) row.values.push_back(text(static_cast<int>(i) + 1));
    row.intact = text(static_cast<int>(count) + 1) == checksum(table, row.number, row.values);
    result.push_back(std::move(row));
  }
}

}  // namespace gonio::acquisition
