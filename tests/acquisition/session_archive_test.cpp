#include "gonio/acquisition/session_archive.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <functional>

#include "gonio/acquisition/frame_file.h"
#include "gonio/acquisition/resume.h"
#include "gonio/errors/errors.h"
#include "journal.h"
#include "run_sql.h"
#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

devices::Frame small_frame(std::uint64_t id) {
  devices::Frame frame;
  frame.width_px = 4;
  frame.height_px = 3;
  frame.pixel_format = devices::PixelFormat::bayer_grbg;
  frame.saturation_level_dn = 4095;
  frame.black_level_dn = 64.0;
  frame.gain_db = 1.5;
  frame.exposure = std::chrono::microseconds(1234);
  frame.exposure_start = std::chrono::seconds(77);
  frame.frame_id = id;
  for (std::uint16_t i = 0; i < 12; ++i) {
    frame.pixels_dn.push_back(static_cast<std::uint16_t>(i * 5000 + id));
  }
  return frame;
}

FrameRecord small_record() {
  FrameRecord record;
  record.kind = FrameKind::sample;
  record.point = 3;
  record.channel = "G";
  record.joints = {Angle::from_degrees(12.5), Angle::from_degrees(-0.1)};
  record.joints_spread = {Angle(), Angle()};
  record.monitor = 0.98765;
  return record;
}

class SessionArchive : public testing::Test {
 protected:
  void write_two_frames() {
    SessionWriter writer(folder_, {{"sample_id", "s\"1\n"}}, {{"plan.csv", "a,b\n1,2\n"}});
    writer.append(small_record(), small_frame(1));
    writer.append(small_record(), small_frame(2));
    writer.note(std::chrono::seconds(5), "warning", "lamp is cold");
    writer.finish(std::chrono::seconds(9));
  }

  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path() / "session";
};

TEST_F(SessionArchive, ReadsBackEverythingItAcknowledged) {
  write_two_frames();
  const SessionReader reader(folder_);
  EXPECT_TRUE(reader.finished());
  EXPECT_THAT(reader.damage(), IsEmpty());
  EXPECT_EQ(reader.metadata().at("sample_id"), "s\"1\n");
  EXPECT_EQ(reader.configuration().at("plan.csv"), "a,b\n1,2\n");
  ASSERT_EQ(reader.frames().size(), 2U);
  const FrameRecord& record = reader.frames()[1];
  EXPECT_EQ(record.id, 2);
  EXPECT_EQ(record.point, 3);
  EXPECT_EQ(record.channel, "G");
  EXPECT_NEAR(record.joints.at(0).degrees(), 12.5, 1e-13);
  EXPECT_EQ(record.monitor, 0.98765);
  const devices::Frame frame = reader.read_frame(record);
  EXPECT_EQ(frame.pixels_dn, small_frame(2).pixels_dn);
  EXPECT_EQ(frame.pixel_format, devices::PixelFormat::bayer_grbg);
  EXPECT_EQ(frame.exposure, std::chrono::microseconds(1234));
  EXPECT_EQ(frame.gain_db, 1.5);
  ASSERT_EQ(reader.notes().size(), 1U);
  EXPECT_EQ(reader.notes()[0].text, "lamp is cold");
}

TEST_F(SessionArchive, RefusesToWriteOverAnything) {
  write_two_frames();
  EXPECT_THROW(SessionWriter(folder_, {}, {}), FileError);
  EXPECT_EQ(SessionReader(folder_).frames().size(), 2U);
}

TEST_F(SessionArchive, NeverLetsARowBeChangedOrDeleted) {
  write_two_frames();
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ / "session.sqlite").c_str(), &database), SQLITE_OK);
  for (const char* sql : {"UPDATE frames SET point = '4';", "DELETE FROM frames;"}) {
    EXPECT_NE(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sql;
  }
  sqlite3_close(database);
}

TEST_F(SessionArchive, LeavesOutARowThatWasTamperedWithAndSaysSo) {
  write_two_frames();
  run_sql(folder_,
          "DROP TRIGGER frames_no_UPDATE; UPDATE frames SET monitor = '2' WHERE number = 1;");
  const SessionReader reader(folder_);
  ASSERT_EQ(reader.frames().size(), 1U);
  EXPECT_EQ(reader.frames()[0].id, 2);
  EXPECT_THAT(reader.damage(), ElementsAre(HasSubstr("frames row 1")));
}

TEST_F(SessionArchive, ReportsAFrameFileThatIsGone) {
  write_two_frames();
  std::filesystem::remove(folder_ / "frames/000002.tiff");
  const SessionReader reader(folder_);
  EXPECT_EQ(reader.frames().size(), 1U);
  EXPECT_THAT(reader.damage(), ElementsAre(HasSubstr("000002.tiff")));
}

TEST_F(SessionArchive, LeavesOutPixelsThatChanged) {
  write_two_frames();
  {
    std::fstream file(folder_ / "frames/000001.tiff",
                      std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(-1, std::ios::end);
    file.put('x');
  }
  const SessionReader reader(folder_);
  ASSERT_EQ(reader.frames().size(), 1U);
  EXPECT_EQ(reader.frames()[0].id, 2);
  EXPECT_NO_THROW(reader.read_frame(reader.frames()[0]));
  EXPECT_THAT(reader.damage(), ElementsAre(HasSubstr("000001.tiff does not have its checksum")));
}

TEST_F(SessionArchive, LeavesOutAFrameThatCannotHoldItsPixels) {
  {
    SessionWriter writer(folder_, {}, {});
    devices::Frame frame = small_frame(1);
    frame.width_px = frame.height_px = 60000;  // 7 GB, which a reader would make room for
    writer.append(small_record(), frame);
  }
  const SessionReader reader(folder_);
  EXPECT_THAT(reader.frames(), IsEmpty());
  EXPECT_THAT(reader.damage(), ElementsAre(HasSubstr("000001.tiff is smaller than its pixels")));
}

TEST_F(SessionArchive, RefusesTimesAndPointsThatNoSessionHas) {
  // Whoever can write the checksums could make the clock of a resumed session overflow.
  constexpr auto kLatest = std::chrono::nanoseconds::max();
  const auto refusal = [&](const auto& write) {
    const TemporaryFolder folder;
    {
      SessionWriter writer(folder.path() / "session", {}, {});
      write(writer);
    }
    try {
      const SessionReader reader(folder.path() / "session");
    } catch (const DataFormatError& error) {
      return std::string(error.what());
    }
    return std::string("read");
  };
  PointRecord late;
  late.finished_at = kLatest;
  EXPECT_THAT(refusal([&](SessionWriter& writer) { writer.append(late); }),
              HasSubstr("points row 1"));
  EXPECT_THAT(refusal([&](SessionWriter& writer) { writer.note(kLatest, "resumed", "x"); }),
              HasSubstr("notes row 1"));
  devices::Frame frame = small_frame(1);
  frame.exposure_start = -std::chrono::seconds(1);
  EXPECT_THAT(refusal([&](SessionWriter& writer) { writer.append(small_record(), frame); }),
              HasSubstr("frames row 1"));
  PointRecord foreign;
  foreign.point = -3;
  EXPECT_THAT(refusal([&](SessionWriter& writer) { writer.append(foreign); }),
              HasSubstr("found point -3"));
}

TEST_F(SessionArchive, AcknowledgesTogetherWhatBelongsTogetherOrNothing) {
  {
    SessionWriter writer(folder_, {}, {});
    EXPECT_THROW(writer.together([&] {
      writer.append(PointRecord());
      throw std::runtime_error("in between");
    }),
                 std::runtime_error);
    EXPECT_THAT(SessionReader(folder_).points(), IsEmpty());
    writer.together([&] {
      writer.append(PointRecord());
      EXPECT_THAT(SessionReader(folder_).points(), IsEmpty()) << "not yet";
      writer.note(std::chrono::seconds(1), "suspect", "points 0: flicker");
    });
  }
  const SessionReader reader(folder_);
  EXPECT_EQ(reader.points().size(), 1U);
  EXPECT_EQ(reader.notes().size(), 1U);
  EXPECT_THAT(reader.damage(), IsEmpty());
}

TEST_F(SessionArchive, NoticesARowThatWasTakenOut) {
  write_two_frames();
  run_sql(folder_, "DROP TRIGGER frames_no_DELETE; DELETE FROM frames WHERE number = 1;");
  EXPECT_THAT(SessionReader(folder_).damage(), ElementsAre(HasSubstr("frames rows 1 to 1")));
}

TEST_F(SessionArchive, NoticesRowsThatWereTakenOffItsEndWhenItWasFinished) {
  const std::map<std::string, std::string> found_in{
      {"metadata", "metadata: found 0 rows, there were 1 when the session finished"},
      {"configuration", "configuration: found 0 rows, there were 1"},
      {"frames", "frames: found 1 rows, there were 2"},
      {"points", "points: found 0 rows, there were 1"},
      {"notes", "notes: found 0 rows, there were 1"}};
  for (const auto& [table, damage] : found_in) {
    SCOPED_TRACE(table);
    {
      SessionWriter writer(folder_, {{"sample_id", "s"}}, {{"plan.csv", "a,b\n"}});
      writer.append(small_record(), small_frame(1));
      writer.append(small_record(), small_frame(2));
      writer.append(PointRecord());
      writer.note(std::chrono::seconds(5), "warning", "lamp is cold");
      writer.finish(std::chrono::seconds(9));
    }
    EXPECT_THAT(SessionReader(folder_).damage(), IsEmpty());
    // As somebody would who tidies up.
    run_sql(folder_, fmt::format("DROP TRIGGER {0}_no_DELETE; DELETE FROM {0} WHERE number = "
                                 "(SELECT max(number) FROM {0});",
                                 table));
    std::filesystem::remove(folder_ / "frames/000002.tiff");
    EXPECT_THAT(SessionReader(folder_).damage(), Contains(HasSubstr(damage)));
    std::filesystem::remove_all(folder_);
  }
}

TEST_F(SessionArchive, RefusesAKeyThatStandsTwice) {
  write_two_frames();
  for (const char* table : {"metadata", "configuration"}) {
    SCOPED_TRACE(table);
    const TemporaryFolder other;
    std::filesystem::copy(folder_, other.path(), std::filesystem::copy_options::recursive);
    std::vector<std::string> row =
        Journal::open(folder_ / "session.sqlite").rows(table).at(0).values;
    row.back() = "another";
    Journal::reopen(other.path() / "session.sqlite").append(table, row);
    EXPECT_THAT([&] { SessionReader reader(other.path()); },
                ThrowsMessage<DataFormatError>(AllOf(HasSubstr(std::string(table) + " row 2"),
                                                     HasSubstr("stands there twice"))));
  }
}

/// Goes on with a session of one frame.
class Refused : public SessionArchive {
 protected:
  Refused() {
    SessionWriter writer(folder_, {{"sample_id", "s"}}, {});
    writer.append(small_record(), small_frame(1));
  }
  void expect_refused(std::chrono::nanoseconds begins_at, const std::string& why) {
    EXPECT_THAT(
        [&] {
          SessionWriter::resume(folder_, files::ProcessLock(session_lock(folder_)), begins_at, {},
                                "by a test");
        },
        ThrowsMessage<FileError>(HasSubstr(why)));
    EXPECT_THAT(SessionReader(folder_).notes(), IsEmpty()) << "a part was begun";
  }
};

TEST_F(Refused, WhereTheNextFrameCannotBeWritten) {
  // Permissions are no matter to who may do all; here nobody can create a file.
  std::filesystem::rename(folder_ / "frames", temporary_.path() / "frames");
  std::filesystem::create_directory_symlink("/proc/self/fdinfo", folder_ / "frames");
  expect_refused(std::chrono::seconds(90), (folder_ / "frames").string());
}

TEST_F(Refused, WhereTheClockOfTheComputerIsDecadesAhead) {
  constexpr std::chrono::hours kYear{24 * 365};
  expect_refused(30 * kYear, "begun 30 years ago");
  SessionWriter::resume(folder_, files::ProcessLock(session_lock(folder_)), 28 * kYear, {},
                        "by a test");
  EXPECT_EQ(SessionReader(folder_).notes().size(), 1U);
}

/// The schema of a journal as it was before its end counted its rows.
constexpr const char* kFirstVersion =
    "DROP TABLE finished; CREATE TABLE finished (number INTEGER PRIMARY KEY, at_ns TEXT NOT NULL, "
    "checksum TEXT NOT NULL); PRAGMA user_version = 1;";

TEST_F(SessionArchive, ReadsAndGoesOnWithOneOfTheFirstVersion) {
  {
    SessionWriter writer(folder_, {{"sample_id", "s"}}, {});
    writer.append(small_record(), small_frame(1));
  }
  run_sql(folder_, kFirstVersion);
  EXPECT_FALSE(SessionReader(folder_).finished());
  SessionWriter::resume(folder_, files::ProcessLock(session_lock(folder_)),
                        std::chrono::seconds(90), {}, "by a test")
      .finish(std::chrono::seconds(5));
  const SessionReader reader(folder_);
  EXPECT_TRUE(reader.finished());
  EXPECT_THAT(reader.damage(), IsEmpty());
}

/// Two frames and a point with rows, as many files again as `more` without.
class LostRows : public SessionArchive {
 protected:
  void write_session(std::int64_t more) {
    {
      SessionWriter writer(folder_, {}, {});
      writer.append(small_record(), small_frame(1));
      writer.append(small_record(), small_frame(2));
      PointRecord point;
      point.point = small_record().point;
      point.outcome = PointOutcome::Measured;
      point.finished_at = std::chrono::seconds(80);
      writer.append(point);
    }
    for (std::int64_t id = 3; id < 3 + more; ++id) {
      write_frame_file(folder_ / fmt::format("frames/{:06}.tiff", id), small_frame(7));
    }
  }
  std::vector<std::string> cut_back() {
    SessionWriter::resume(folder_, files::ProcessLock(session_lock(folder_)),
                          std::chrono::seconds(90), std::chrono::seconds(0), "by a test")
        .append(small_record(), small_frame(9));
    std::vector<std::string> texts;
    const SessionReader reader(folder_);
    for (const SessionNote& note : reader.notes()) {
      if (note.kind == "cut back") texts.push_back(note.text);
    }
    return texts;
  }
};

TEST_F(LostRows, AreNotWhatAKillLeaves) {
  write_session(1);
  const SessionReader reader(folder_);
  EXPECT_THAT(reader.damage(), IsEmpty());
  EXPECT_EQ(resume_state(reader).done.size(), 1U);
  EXPECT_THAT(cut_back(), ElementsAre("frames/000003.tiff was never acknowledged, removed"));
}

TEST_F(LostRows, AreSaidAndTheirFramesKept) {
  write_session(2);
  const SessionReader reader(folder_);
  EXPECT_THAT(reader.damage(), ElementsAre(HasSubstr("frames 3 to 4 have files and no rows")));
  EXPECT_THAT(resume_state(reader).again,
              ElementsAre(HasSubstr("point 3 was measured after the last check")))
      << "what a check said of it may be lost";
  EXPECT_THAT(cut_back(), ElementsAre("frames/000003.tiff has lost its row, kept as "
                                      "frames/000003.tiff.without-row-1",
                                      "frames/000004.tiff has lost its row, kept as "
                                      "frames/000004.tiff.without-row-1"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "frames/000004.tiff.without-row-1"));
  const SessionReader after(folder_);
  EXPECT_THAT(after.damage(), IsEmpty());
  EXPECT_EQ(after.frames().back().id, 3);
}

TEST_F(SessionArchive, LeavesOutAFrameFileThatIsMuchLargerThanItsPixelsUnread) {
  write_two_frames();
  std::filesystem::resize_file(folder_ / "frames/000001.tiff", std::uintmax_t{1} << 40U);
  EXPECT_THAT(SessionReader(folder_).damage(), ElementsAre(HasSubstr("is larger than its pixels")));
}

TEST_F(SessionArchive, CanBeReadWhereNothingMayBeWritten) {
  write_two_frames();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "session.sqlite-wal"));
  std::filesystem::permissions(folder_ / "session.sqlite", std::filesystem::perms::owner_read);
  std::filesystem::permissions(
      folder_, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_EQ(SessionReader(folder_).frames().size(), 2U);
  std::filesystem::permissions(folder_, std::filesystem::perms::owner_all);
}

TEST_F(SessionArchive, IsFinishedAlsoWhileSomebodyReadsIt) {
  sqlite3* looking = nullptr;
  {
    SessionWriter writer(folder_, {}, {});
    writer.append(small_record(), small_frame(1));
    ASSERT_EQ(sqlite3_open((folder_ / "session.sqlite").c_str(), &looking), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(looking, "BEGIN; SELECT * FROM frames;", nullptr, nullptr, nullptr),
              SQLITE_OK);
    EXPECT_NO_THROW(writer.finish(std::chrono::seconds(9)));
  }
  const SessionReader while_it_looks(folder_);
  EXPECT_TRUE(while_it_looks.finished());
  EXPECT_THAT(while_it_looks.damage(), IsEmpty());
  sqlite3_close(looking);
  const SessionReader after(folder_);
  EXPECT_TRUE(after.finished());
  EXPECT_EQ(after.frames().size(), 1u);
}

/// Does something once, as SQLite begins with a statement of this text on a connection of this
/// process that was opened since: what another process may do at just that moment.
class WhenSqliteRuns {
 public:
  WhenSqliteRuns(std::string text, std::function<void()> act)
      : text_(std::move(text)), act_(std::move(act)) {
    waiting_ = this;
    sqlite3_auto_extension(entry());
  }
  ~WhenSqliteRuns() {
    sqlite3_cancel_auto_extension(entry());
    waiting_ = nullptr;
    EXPECT_TRUE(done_) << text_ << " was never run";
  }
  WhenSqliteRuns(const WhenSqliteRuns&) = delete;
  WhenSqliteRuns& operator=(const WhenSqliteRuns&) = delete;

 private:
  static void (*entry())() { return reinterpret_cast<void (*)()>(&watch); }
  static int watch(sqlite3* database, char**, const sqlite3_api_routines*) {
    return sqlite3_trace_v2(database, SQLITE_TRACE_STMT, on_statement, nullptr);
  }
  static int on_statement(unsigned, void*, void*, void* sql) {
    if (waiting_ != nullptr) waiting_->begins(static_cast<const char*>(sql));
    return 0;
  }
  void begins(const std::string& sql) {
    if (done_ || sql.find(text_) == std::string::npos) return;
    done_ = true;
    EXPECT_NO_THROW(act_());
  }

  static inline WhenSqliteRuns* waiting_ = nullptr;
  std::string text_;
  std::function<void()> act_;
  bool done_ = false;
};

TEST_F(SessionArchive, IsReadAsItWasAtOneInstantThoughItGoesOnAndFinishesMeanwhile) {
  PointRecord point;
  point.outcome = PointOutcome::Measured;
  for (const std::string table : {"frames", "points", "notes", "finished"}) {
    SCOPED_TRACE(table);
    SessionWriter writer(folder_, {}, {});
    writer.append(small_record(), small_frame(1));
    {
      const WhenSqliteRuns meanwhile("checksum FROM " + table, [&] {
        FrameRecord next = small_record();
        next.point = point.point = 4;
        writer.append(next, small_frame(2));
        writer.append(point);
        writer.note(std::chrono::seconds(5), "warning", "lamp is cold");
        writer.finish(std::chrono::seconds(9));
      });
      const SessionReader reader(folder_);
      EXPECT_EQ(reader.frames().size(), 1U);
      EXPECT_THAT(reader.points(), IsEmpty());
      EXPECT_THAT(reader.notes(), IsEmpty());
      EXPECT_FALSE(reader.finished());
      EXPECT_THAT(reader.damage(), IsEmpty());
    }
    const SessionReader after(folder_);
    EXPECT_EQ(after.frames().size(), 2U);
    EXPECT_TRUE(after.finished());
    EXPECT_THAT(after.damage(), IsEmpty());
    std::filesystem::remove_all(folder_);
  }
}

TEST_F(SessionArchive, DoesNotHoldItsJournalWhileItLooksAtFrames) {
  write_two_frames();
  const WhenSqliteRuns let_go("COMMIT",
                              [&] { std::filesystem::remove(folder_ / "frames/000001.tiff"); });
  EXPECT_THAT(SessionReader(folder_).damage(), ElementsAre(HasSubstr("000001.tiff is missing")));
}

TEST_F(SessionArchive, RefusesWhatIsNoJournal) {
  EXPECT_THROW(SessionReader{folder_}, FileError);
  std::filesystem::create_directory(folder_);
  std::ofstream(folder_ / "session.sqlite") << "this is not a database, but long enough to be read "
                                               "as the header of one if somebody tried to";
  EXPECT_THROW(SessionReader{folder_}, DataFormatError);
}

TEST_F(SessionArchive, RefusesAForeignDatabase) {
  std::filesystem::create_directory(folder_);
  run_sql(folder_, "CREATE TABLE other (a);");
  EXPECT_THROW(SessionReader{folder_}, DataFormatError);
}

TEST_F(SessionArchive, KeepsEveryAcknowledgedFrameOfAKilledProcess) {
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    SessionWriter writer(folder_, {{"sample_id", "killed"}}, {});
    for (std::uint64_t id = 1;; ++id) {
      writer.append(small_record(), small_frame(id));
      const char acknowledged = 1;
      if (write(pipe_ends[1], &acknowledged, 1) != 1) _exit(1);
    }
  }
  close(pipe_ends[1]);
  constexpr int kAcknowledged = 5;
  char byte = 0;
  for (int i = 0; i < kAcknowledged; ++i) ASSERT_EQ(read(pipe_ends[0], &byte, 1), 1);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  int acknowledged = kAcknowledged;
  while (read(pipe_ends[0], &byte, 1) == 1) ++acknowledged;
  close(pipe_ends[0]);

  const SessionReader reader(folder_);
  EXPECT_FALSE(reader.finished());
  EXPECT_GE(reader.frames().size(), static_cast<std::size_t>(acknowledged));
  EXPECT_LE(reader.frames().size(), static_cast<std::size_t>(acknowledged) + 1);
  for (const FrameRecord& record : reader.frames()) EXPECT_NO_THROW(reader.read_frame(record));
}

}  // namespace
}  // namespace gonio::acquisition
