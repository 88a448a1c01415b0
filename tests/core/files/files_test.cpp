#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "gonio/files/atomic_folder.h"
#include "gonio/files/input_file.h"
#include "gonio/files/process_lock.h"
#include "gonio/files/sha256.h"
#include "gonio/files/text_file.h"
#include "temporary_folder.h"

namespace gonio::files {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

class Files : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

using AtomicFileTest = Files;
using AtomicFolderTest = Files;
using RequireCreatable = Files;
using Sha256Test = Files;
using ReadTextFile = Files;
using InputFileTest = Files;

TEST_F(AtomicFileTest, AppearsUnderItsNameOnlyWhenCommitted) {
  AtomicFile file(folder_ / "a.csv");
  file.write("one,");
  EXPECT_FALSE(fs::exists(folder_ / "a.csv"));
  file.write("two");
  file.commit();
  EXPECT_EQ(read_text_file(folder_ / "a.csv"), "one,two");
  EXPECT_THAT(folder_.names(), UnorderedElementsAre("a.csv"));
}

TEST_F(AtomicFileTest, LeavesNothingBehindWithoutCommit) {
  {
    AtomicFile file(folder_ / "a.csv");
    file.write("half");
  }
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(AtomicFileTest, HidesItsTemporaryFileInTheSameFolder) {
  const AtomicFile file(folder_ / "a.csv");
  EXPECT_EQ(file.temporary_path().parent_path(), folder_.path());
  EXPECT_THAT(file.temporary_path().filename().string(), StartsWith(".a.csv."));
}

TEST_F(AtomicFileTest, RefusesATargetThatExists) {
  folder_.write("a.csv", "old");
  EXPECT_THAT([&] { AtomicFile file(folder_ / "a.csv"); },
              ThrowsMessage<FileError>(AllOf(StartsWith((folder_ / "a.csv").string()),
                                             HasSubstr("cannot create: it exists"))));
  EXPECT_EQ(read_text_file(folder_ / "a.csv"), "old");
}

TEST_F(AtomicFileTest, RefusesATargetThatAppearsMeanwhile) {
  AtomicFile file(folder_ / "a.csv");
  file.write("mine");
  folder_.write("a.csv", "theirs");
  EXPECT_THROW(file.commit(), FileError);
  EXPECT_EQ(read_text_file(folder_ / "a.csv"), "theirs");
}

TEST_F(AtomicFileTest, ReplacesAFileWhenToldTo) {
  folder_.write("a.csv", "old");
  AtomicFile file(folder_ / "a.csv", Overwrite::Yes);
  file.write("new");
  EXPECT_EQ(read_text_file(folder_ / "a.csv"), "old");
  file.commit();
  EXPECT_EQ(read_text_file(folder_ / "a.csv"), "new");
}

TEST_F(AtomicFileTest, FindsOutBeforeItTouchesTheTargetWhenAskedTo) {
  AtomicFile file(folder_ / "a.csv", Overwrite::Yes);
  file.write("new");
  file.prepare();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.csv"));
  std::filesystem::create_directory(folder_ / "a.csv");  // meanwhile
  EXPECT_THROW(file.prepare(), FileError);
  EXPECT_THROW(file.commit(), FileError);
  EXPECT_FALSE(file.committed());
  std::filesystem::remove(folder_ / "a.csv");
  file.commit();
  EXPECT_TRUE(file.committed());
}

TEST_F(AtomicFileTest, NeverReplacesAFolder) {
  fs::create_directory(folder_ / "a.csv");
  EXPECT_THAT([&] { AtomicFile file(folder_ / "a.csv", Overwrite::Yes); },
              ThrowsMessage<FileError>(HasSubstr("not a regular file")));
}

TEST_F(AtomicFileTest, SaysWhyAFileCannotBeCreated) {
  EXPECT_THAT([&] { AtomicFile file(folder_ / "missing/a.csv"); },
              ThrowsMessage<FileError>(HasSubstr("missing/a.csv: cannot create: No such file")));
  folder_.write("plain", "");
  EXPECT_THAT([&] { AtomicFile file(folder_ / "plain/a.csv"); },
              ThrowsMessage<FileError>(HasSubstr("Not a directory")));
}

TEST_F(AtomicFileTest, KeepsWhatALibraryWroteByName) {
  AtomicFile file(folder_ / "a.h5");
  fs::remove(file.temporary_path());  // some libraries start a file afresh
  std::ofstream(file.temporary_path()) << "by name";
  file.commit();
  EXPECT_EQ(read_text_file(folder_ / "a.h5"), "by name");
}

TEST_F(AtomicFileTest, GivesTheFileTheUsersDefaultPermissions) {
  folder_.write("plain", "");
  AtomicFile file(folder_ / "a.csv");
  file.commit();
  EXPECT_EQ(fs::status(folder_ / "a.csv").permissions(),
            fs::status(folder_ / "plain").permissions());
}

TEST_F(AtomicFileTest, AcceptsTheLongestLegalName) {
  const std::string name(255, 'n');
  write_text_file(folder_ / name, "text");
  EXPECT_EQ(read_text_file(folder_ / name), "text");
}

TEST_F(AtomicFolderTest, AppearsWithEverythingInItWhenCommitted) {
  AtomicFolder folder(folder_ / "session");
  fs::create_directory(folder.path() / "frames");
  write_text_file(folder.path() / "frames" / "1.txt", "pixels");
  EXPECT_FALSE(fs::exists(folder_ / "session"));
  folder.commit();
  EXPECT_EQ(read_text_file(folder_ / "session/frames/1.txt"), "pixels");
  EXPECT_THAT(folder_.names(), UnorderedElementsAre("session"));
}

TEST_F(AtomicFolderTest, LeavesNothingBehindWithoutCommit) {
  {
    const AtomicFolder folder(folder_ / "session");
    write_text_file(folder.path() / "1.txt", "pixels");
  }
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(AtomicFolderTest, RefusesATargetThatExists) {
  fs::create_directory(folder_ / "session");
  EXPECT_THAT([&] { AtomicFolder folder(folder_ / "session"); },
              ThrowsMessage<FileError>(HasSubstr("it exists")));
}

TEST_F(AtomicFolderTest, ReplacesTheWholeFolderWhenToldTo) {
  fs::create_directory(folder_ / "session");
  folder_.write("session/old.txt", "old");
  AtomicFolder folder(folder_ / "session", Overwrite::Yes);
  write_text_file(folder.path() / "new.txt", "new");
  folder.commit();
  EXPECT_FALSE(fs::exists(folder_ / "session/old.txt"));
  EXPECT_EQ(read_text_file(folder_ / "session/new.txt"), "new");
  EXPECT_THAT(folder_.names(), UnorderedElementsAre("session"));
}

TEST_F(AtomicFolderTest, TakesATrailingSlashAsPartOfTheName) {
  AtomicFolder folder(folder_ / "session/");
  folder.commit();
  EXPECT_THAT(folder_.names(), UnorderedElementsAre("session"));
}

TEST_F(RequireCreatable, AcceptsAFreeNameAndLeavesNoTrace) {
  EXPECT_NO_THROW(require_creatable(folder_ / "a.csv"));
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(RequireCreatable, RefusesWhatTheWriterWouldRefuse) {
  folder_.write("a.csv", "old");
  EXPECT_THROW(require_creatable(folder_ / "a.csv"), FileError);
  EXPECT_NO_THROW(require_creatable(folder_ / "a.csv", Overwrite::Yes));
  EXPECT_THROW(require_creatable(folder_ / "missing/a.csv"), FileError);
  EXPECT_THROW(require_creatable(folder_ / "a.csv/b.csv"), FileError);
  EXPECT_THROW(require_creatable(""), FileError);
}

// FIPS 180-2 appendix B.1 and B.2, and the empty message.
TEST_F(Sha256Test, GivesThePublishedDigests) {
  EXPECT_EQ(sha256_of_bytes("abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of_bytes("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_of_bytes(""),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

// FIPS 180-2 appendix B.3.
TEST_F(Sha256Test, ReadsFilesLongerThanItsBuffer) {
  folder_.write("a", std::string(1'000'000, 'a'));
  EXPECT_EQ(sha256_of_file(folder_ / "a"),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  folder_.write("b", std::string(3'000'000, 'b'));
  EXPECT_EQ(sha256_of_file(folder_ / "b"), sha256_of_bytes(std::string(3'000'000, 'b')));
}

TEST_F(Sha256Test, DoesNotCareHowTheBytesArrive) {
  Sha256 sum;
  sum.update("a");
  sum.update("");
  sum.update("bc");
  EXPECT_EQ(sum.finish(), sha256_of_bytes("abc"));
}

TEST_F(Sha256Test, SaysWhichFileItCannotRead) {
  EXPECT_THAT([&] { sha256_of_file(folder_ / "missing"); },
              ThrowsMessage<FileError>(HasSubstr("missing: cannot open for reading")));
  EXPECT_THAT([&] { sha256_of_file(folder_.path()); },
              ThrowsMessage<FileError>(HasSubstr("cannot read: found a folder")));
}

TEST_F(ReadTextFile, KeepsEveryByte) {
  const std::string text("a\r\n\0b", 5);
  folder_.write("a", text);
  EXPECT_EQ(read_text_file(folder_ / "a"), text);
}

TEST_F(ReadTextFile, AcceptsExactlyTheLimit) {
  folder_.write("a", std::string(100'000, 'x'));
  EXPECT_EQ(read_text_file(folder_ / "a", 100'000).size(), 100'000U);
  EXPECT_THAT([&] { read_text_file(folder_ / "a", 99'999); },
              ThrowsMessage<DataFormatError>(HasSubstr("a: byte 99999: found more data")));
}

TEST_F(ReadTextFile, SaysWhyAFileCannotBeRead) {
  EXPECT_THAT([&] { read_text_file(folder_ / "missing"); },
              ThrowsMessage<FileError>(HasSubstr("No such file or directory")));
  EXPECT_THAT([&] { read_text_file(folder_.path()); },
              ThrowsMessage<FileError>(HasSubstr("found a folder")));
}

TEST_F(AtomicFileTest, SaysWhetherThereIsRoom) {
  AtomicFile file(folder_ / "a");
  file.require_room(100'000);
  constexpr std::uintmax_t kExbibyte = std::uintmax_t{1} << 60U;  // no disk is this large
  EXPECT_THAT([&] { file.require_room(kExbibyte); },
              ThrowsMessage<FileError>(HasSubstr("a: cannot write: ")));
  file.write("whole");
  file.commit();
  EXPECT_EQ(folder_.read("a"), "whole");
}

TEST_F(InputFileTest, RefusesWhatIsNotARegularFileWithoutWaitingForIt) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const auto& [path, kind] : {std::pair(pipe, "a pipe"), std::pair(folder_.path(), "a folder"),
                                   std::pair(fs::path("/dev/zero"), "a device")}) {
    const auto refusal = ThrowsMessage<FileError>(
        HasSubstr(std::string("cannot read: found ") + kind + ", expected a regular file"));
    EXPECT_THAT([&] { InputFile file(path); }, refusal);
    EXPECT_THAT([&] { InputFile::open_if_exists(path); }, refusal);
    EXPECT_THAT([&] { require_regular_file(path); }, refusal);
    EXPECT_THAT([&] { read_text_file(path); }, refusal);
    EXPECT_THAT([&] { sha256_of_file(path); }, refusal);
  }
  EXPECT_FALSE(InputFile::open_if_exists(folder_ / "missing").has_value());
}

TEST_F(InputFileTest, ReadsThroughALinkAndSaysWhereTheFileEnds) {
  folder_.write("a", "hello");
  fs::create_symlink(folder_ / "a", folder_ / "link");
  InputFile file(folder_ / "link");
  EXPECT_EQ(file.size(), 5U);
  std::array<std::byte, 3> three{};
  file.read(three);
  EXPECT_EQ(three[2], std::byte{'l'});
  EXPECT_THAT([&] { file.read(three); },
              ThrowsMessage<DataFormatError>(HasSubstr("link: byte 5: the file ends here")));
}

class ProcessLockTest : public ::testing::Test {
 protected:
  /// A process that holds the lock until it is killed; returns once it does.
  static pid_t hold(const fs::path& path) {
    std::array<int, 2> said{};
    EXPECT_EQ(::pipe(said.data()), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      const ProcessLock lock(path);
      [[maybe_unused]] const ssize_t written = ::write(said[1], "h", 1);
      while (true) ::pause();
    }
    char held = 0;
    EXPECT_EQ(::read(said[0], &held, 1), 1);
    ::close(said[0]);
    ::close(said[1]);
    return child;
  }

  TemporaryFolder folder_;
  fs::path path_ = folder_ / "a.lock";
};

TEST_F(ProcessLockTest, KnowsWhetherItsNameIsStillItsOwn) {
  const ProcessLock lock(path_);
  EXPECT_TRUE(names_open_file(path_, lock.descriptor()));
  const std::filesystem::path away = path_.string() + "-away";
  std::filesystem::rename(path_, away);
  EXPECT_FALSE(names_open_file(path_, lock.descriptor()));
  EXPECT_TRUE(names_open_file(away, lock.descriptor()));
  std::filesystem::copy_file(away, path_);
  EXPECT_FALSE(names_open_file(path_, lock.descriptor()));
}

TEST_F(ProcessLockTest, NamesTheLiveProcessThatHoldsItAndIsFreeOnceThatIsKilled) {
  EXPECT_FALSE(lock_holder(path_).has_value()) << "there is no such file";
  const pid_t child = hold(path_);
  EXPECT_EQ(lock_holder(path_), child);
  try {
    const ProcessLock second(path_);
    ADD_FAILURE() << "two hold it";
  } catch (const HeldByAnother& error) {
    EXPECT_EQ(error.holder(), child);
    EXPECT_THAT(error.what(), HasSubstr("process " + std::to_string(child) + " is using it"));
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_FALSE(lock_holder(path_).has_value());
  const ProcessLock mine(path_);
  EXPECT_EQ(lock_holder(path_), ::getpid());
}

TEST_F(ProcessLockTest, IsHeldOnceInAProcessAndMovesWithItsOwner) {
  std::optional<ProcessLock> first(std::in_place, path_);
  EXPECT_THROW(ProcessLock{path_}, HeldByAnother);
  std::optional<ProcessLock> owner(std::move(*first));
  first.reset();
  EXPECT_THROW(ProcessLock{path_}, HeldByAnother);
  owner.reset();
  EXPECT_NO_THROW(ProcessLock{path_});
}

TEST_F(ProcessLockTest, FollowsNoLink) {
  fs::create_symlink(folder_ / "elsewhere", path_);
  EXPECT_THROW(ProcessLock{path_}, FileError);
  EXPECT_FALSE(fs::exists(folder_ / "elsewhere"));
}

}  // namespace
}  // namespace gonio::files
