#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <array>
#include <cstdint>
#include <string>

#include "gonio/acquisition/session_archive.h"
#include "gonio/errors/errors.h"
#include "run_sql.h"
#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// SQLite's file format, sqlite.org/fileformat2.html: big-endian throughout.
constexpr std::size_t kPage = 4096;
constexpr std::size_t kPageCountAt = 28;
constexpr unsigned char kInteriorTable = 5;
constexpr unsigned char kLeafTable = 13;

std::uint32_t number_at(const std::string& bytes, std::size_t at, std::size_t size) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < size; ++i) {
    number = number << 8U | static_cast<unsigned char>(bytes.at(at + i));
  }
  return number;
}

void put_number(std::string& bytes, std::size_t at, std::uint32_t number) {
  for (std::size_t i = 4; i-- > 0; number >>= 8U) bytes.at(at + i) = static_cast<char>(number);
}

/// A finished session, and what is said of it after a change.
class HostileJournal : public testing::Test {
 protected:
  HostileJournal() {
    SessionWriter writer(folder_, {{"sample_id", "A17"}}, {});
    writer.finish(std::chrono::seconds(9));
  }

  std::string refusal() const {
    try {
      SessionReader reader(folder_);
    } catch (const DataFormatError& error) {
      return error.what();
    }
    return "accepted";
  }

  /// Where a table's first page begins in the file.
  std::size_t root_of(const std::string& table) const {
    sqlite3* database = nullptr;
    EXPECT_EQ(sqlite3_open(journal_.c_str(), &database), SQLITE_OK);
    const std::string sql = "SELECT rootpage FROM sqlite_schema WHERE name = '" + table + "';";
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr), SQLITE_OK);
    EXPECT_EQ(sqlite3_step(statement), SQLITE_ROW);
    const int page = sqlite3_column_int(statement, 0);
    sqlite3_finalize(statement);
    sqlite3_close(database);
    return (static_cast<std::size_t>(page) - 1) * kPage;
  }

  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path() / "session";
  std::filesystem::path journal_ = folder_ / "session.sqlite";
};

TEST_F(HostileJournal, WithATriggerThatDropsRowsIsRefused) {
  run_sql(folder_, "CREATE TRIGGER zz BEFORE INSERT ON points BEGIN SELECT RAISE(IGNORE); END;");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("schema"), HasSubstr("\"zz\"")));
}

TEST_F(HostileJournal, WithAViewForATableIsRefusedBeforeTheViewIsRun) {
  run_sql(folder_,
          "DROP TABLE notes; CREATE VIEW notes AS SELECT 1 AS number, '0' AS at_ns, 'a' AS kind, "
          "'b' AS text, 'c' AS checksum;");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("table notes"), HasSubstr("is missing")));
}

TEST_F(HostileJournal, WithATableOfItsOwnDefinitionIsRefused) {
  run_sql(folder_,
          "DROP TABLE notes; CREATE TABLE notes (number INTEGER PRIMARY KEY, at_ns, kind, text, "
          "checksum AS (hex(zeroblob(1000))));");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("table notes"), HasSubstr("not defined as")));
}

TEST_F(HostileJournal, WithARowThatHasNoSuccessorIsRefused) {
  for (const char* number : {"0", "-5", "9223372036854775807"}) {
    run_sql(folder_, std::string("DROP TRIGGER IF EXISTS notes_no_DELETE; DELETE FROM notes; "
                                 "INSERT INTO notes VALUES (") +
                         number + ", '0', 'a', 'b', 'c');");
    EXPECT_THAT(refusal(), AllOf(HasSubstr("table notes: found row "), HasSubstr(number)));
  }
}

TEST_F(HostileJournal, WhosePagesLeadToTheSameRowsAgainIsRefused) {
  run_sql(folder_,
          "WITH RECURSIVE c(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM c WHERE i < 200) "
          "INSERT INTO notes SELECT i, '0', 'a', printf('%100d', i), 'c' FROM c;");
  std::string bytes = read_bytes(journal_);
  const std::size_t root = root_of("notes");
  ASSERT_EQ(bytes.at(root), kInteriorTable);
  const std::uint32_t cells = number_at(bytes, root + 3, 2);
  ASSERT_GE(cells, 2U);
  const auto cell = [&](std::size_t i) { return root + number_at(bytes, root + 12 + 2 * i, 2); };
  for (std::size_t i = 1; i < cells; ++i) put_number(bytes, cell(i), number_at(bytes, cell(0), 4));
  write_bytes(journal_, bytes);
  EXPECT_THAT(refusal(), HasSubstr("table notes: found row 1 after row "));
}

TEST_F(HostileJournal, WhoseRowsShareTheirTextIsRefused) {
  // Of a row of 98697 bytes 489 stand in its cell, the others on 24 pages of their own.
  constexpr std::size_t kInCell = 489;
  constexpr std::size_t kOwnPages = 24;
  run_sql(folder_,
          "WITH RECURSIVE c(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM c WHERE i < 5) "
          "INSERT INTO notes SELECT i, '0', 'a', hex(zeroblob(49343)), 'c' FROM c;");
  std::string bytes = read_bytes(journal_);
  const std::size_t root = root_of("notes");
  ASSERT_EQ(bytes.at(root), kLeafTable);
  ASSERT_EQ(number_at(bytes, root + 3, 2), 5U);
  // A cell: three bytes of length, one of row number, the bytes, the page where they go on.
  const auto link = [&](std::size_t i) {
    return root + number_at(bytes, root + 8 + 2 * i, 2) + 4 + kInCell;
  };
  const std::uint32_t shared = number_at(bytes, link(0), 4);
  for (std::size_t i = 1; i < 5; ++i) put_number(bytes, link(i), shared);
  const std::size_t pages = shared - 1 + kOwnPages;
  bytes.resize(pages * kPage);
  put_number(bytes, kPageCountAt, static_cast<std::uint32_t>(pages));
  write_bytes(journal_, bytes);
  EXPECT_THAT(refusal(), HasSubstr("table notes: found more text than the file can hold"));
}

TEST_F(HostileJournal, DoesNotMakeSqliteDeleteAnotherFile) {
  // A hot rollback journal without a page to restore that names a super-journal: its number (a
  // page that never exists), the name, its length, the sum of its bytes, the magic.
  const std::filesystem::path victim = temporary_.write("precious", "text");
  const std::string magic("\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", 8);
  const std::string name = victim.string();
  const auto pages = static_cast<std::uint32_t>(std::filesystem::file_size(journal_) / kPage);
  std::string rollback = magic + std::string(504, '\0');
  constexpr std::uint32_t kSector = 512;
  const std::array<std::uint32_t, 5> header{0, 0, pages, kSector, kPage};
  for (std::size_t i = 0; i < header.size(); ++i) put_number(rollback, 8 + 4 * i, header[i]);
  std::uint32_t sum = 0;
  for (const char letter : name) sum += static_cast<std::uint32_t>(letter);
  std::string end = std::string(4, '\0') + name + std::string(8, '\0');
  put_number(end, 0, (1U << 30U) / kPage + 1);
  put_number(end, 4 + name.size(), static_cast<std::uint32_t>(name.size()));
  put_number(end, 8 + name.size(), sum);
  write_bytes(journal_.string() + "-journal", rollback + end + magic);
  EXPECT_THAT(refusal(), HasSubstr("which SQLite would delete"));
  EXPECT_TRUE(std::filesystem::exists(victim));
}

}  // namespace
}  // namespace gonio::acquisition
