#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "gonio/files/atomic_folder.h"
#include "gonio/files/sha256.h"
#include "gonio/files/text_file.h"

namespace gonio::files {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

/// An empty folder of the test's own, gone afterwards.
class Files : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::path(::testing::TempDir()) / "gonio_files_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path in_folder(const std::string& name) const { return folder_ / name; }

  void put(const std::string& name, const std::string& text) const {
    std::ofstream(in_folder(name), std::ios::binary) << text;
  }

  std::vector<std::string> names() const {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      found.push_back(entry.path().filename().string());
    }
    return found;
  }

  fs::path folder_;
};

using AtomicFileTest = Files;
using AtomicFolderTest = Files;
using RequireCreatable = Files;
using Sha256Test = Files;
using ReadTextFile = Files;

TEST_F(AtomicFileTest, AppearsUnderItsNameOnlyWhenCommitted) {
  AtomicFile file(in_folder("a.csv"));
  file.write("one,");
  EXPECT_FALSE(fs::exists(in_folder("a.csv")));
  file.write("two");
  file.commit();
  EXPECT_EQ(read_text_file(in_folder("a.csv")), "one,two");
  EXPECT_THAT(names(), UnorderedElementsAre("a.csv"));
}

TEST_F(AtomicFileTest, LeavesNothingBehindWithoutCommit) {
  {
    AtomicFile file(in_folder("a.csv"));
    file.write("half");
  }
  EXPECT_THAT(names(), IsEmpty());
}

TEST_F(AtomicFileTest, HidesItsTemporaryFileInTheSameFolder) {
  const AtomicFile file(in_folder("a.csv"));
  EXPECT_EQ(file.temporary_path().parent_path(), folder_);
  EXPECT_THAT(file.temporary_path().filename().string(), StartsWith(".a.csv."));
}

TEST_F(AtomicFileTest, RefusesATargetThatExists) {
  put("a.csv", "old");
  EXPECT_THAT([&] { AtomicFile file(in_folder("a.csv")); },
              ThrowsMessage<FileError>(AllOf(StartsWith(in_folder("a.csv").string()),
                                             HasSubstr("cannot create: it exists"))));
  EXPECT_EQ(read_text_file(in_folder("a.csv")), "old");
}

TEST_F(AtomicFileTest, RefusesATargetThatAppearsMeanwhile) {
  AtomicFile file(in_folder("a.csv"));
  file.write("mine");
  put("a.csv", "theirs");
  EXPECT_THROW(file.commit(), FileError);
  EXPECT_EQ(read_text_file(in_folder("a.csv")), "theirs");
}

TEST_F(AtomicFileTest, ReplacesAFileWhenToldTo) {
  put("a.csv", "old");
  AtomicFile file(in_folder("a.csv"), Overwrite::Yes);
  file.write("new");
  EXPECT_EQ(read_text_file(in_folder("a.csv")), "old");
  file.commit();
  EXPECT_EQ(read_text_file(in_folder("a.csv")), "new");
}

TEST_F(AtomicFileTest, NeverReplacesAFolder) {
  fs::create_directory(in_folder("a.csv"));
  EXPECT_THAT([&] { AtomicFile file(in_folder("a.csv"), Overwrite::Yes); },
              ThrowsMessage<FileError>(HasSubstr("not a regular file")));
}

TEST_F(AtomicFileTest, SaysWhyAFileCannotBeCreated) {
  EXPECT_THAT([&] { AtomicFile file(in_folder("missing/a.csv")); },
              ThrowsMessage<FileError>(HasSubstr("missing/a.csv: cannot create: No such file")));
  put("plain", "");
  EXPECT_THAT([&] { AtomicFile file(in_folder("plain/a.csv")); },
              ThrowsMessage<FileError>(HasSubstr("Not a directory")));
}

TEST_F(AtomicFileTest, KeepsWhatALibraryWroteByName) {
  AtomicFile file(in_folder("a.h5"));
  fs::remove(file.temporary_path());  // some libraries start a file afresh
  std::ofstream(file.temporary_path()) << "by name";
  file.commit();
  EXPECT_EQ(read_text_file(in_folder("a.h5")), "by name");
}

TEST_F(AtomicFileTest, GivesTheFileTheUsersDefaultPermissions) {
  put("plain", "");
  AtomicFile file(in_folder("a.csv"));
  file.commit();
  EXPECT_EQ(fs::status(in_folder("a.csv")).permissions(),
            fs::status(in_folder("plain")).permissions());
}

TEST_F(AtomicFileTest, AcceptsTheLongestLegalName) {
  const std::string name(255, 'n');
  write_text_file(in_folder(name), "text");
  EXPECT_EQ(read_text_file(in_folder(name)), "text");
}

TEST_F(AtomicFolderTest, AppearsWithEverythingInItWhenCommitted) {
  AtomicFolder folder(in_folder("session"));
  fs::create_directory(folder.path() / "frames");
  write_text_file(folder.path() / "frames" / "1.txt", "pixels");
  EXPECT_FALSE(fs::exists(in_folder("session")));
  folder.commit();
  EXPECT_EQ(read_text_file(in_folder("session/frames/1.txt")), "pixels");
  EXPECT_THAT(names(), UnorderedElementsAre("session"));
}

TEST_F(AtomicFolderTest, LeavesNothingBehindWithoutCommit) {
  {
    const AtomicFolder folder(in_folder("session"));
    write_text_file(folder.path() / "1.txt", "pixels");
  }
  EXPECT_THAT(names(), IsEmpty());
}

TEST_F(AtomicFolderTest, RefusesATargetThatExists) {
  fs::create_directory(in_folder("session"));
  EXPECT_THAT([&] { AtomicFolder folder(in_folder("session")); },
              ThrowsMessage<FileError>(HasSubstr("it exists")));
}

TEST_F(AtomicFolderTest, ReplacesTheWholeFolderWhenToldTo) {
  fs::create_directory(in_folder("session"));
  put("session/old.txt", "old");
  AtomicFolder folder(in_folder("session"), Overwrite::Yes);
  write_text_file(folder.path() / "new.txt", "new");
  folder.commit();
  EXPECT_FALSE(fs::exists(in_folder("session/old.txt")));
  EXPECT_EQ(read_text_file(in_folder("session/new.txt")), "new");
  EXPECT_THAT(names(), UnorderedElementsAre("session"));
}

TEST_F(AtomicFolderTest, TakesATrailingSlashAsPartOfTheName) {
  AtomicFolder folder(in_folder("session/"));
  folder.commit();
  EXPECT_THAT(names(), UnorderedElementsAre("session"));
}

TEST_F(RequireCreatable, AcceptsAFreeNameAndLeavesNoTrace) {
  EXPECT_NO_THROW(require_creatable(in_folder("a.csv")));
  EXPECT_THAT(names(), IsEmpty());
}

TEST_F(RequireCreatable, RefusesWhatTheWriterWouldRefuse) {
  put("a.csv", "old");
  EXPECT_THROW(require_creatable(in_folder("a.csv")), FileError);
  EXPECT_NO_THROW(require_creatable(in_folder("a.csv"), Overwrite::Yes));
  EXPECT_THROW(require_creatable(in_folder("missing/a.csv")), FileError);
  EXPECT_THROW(require_creatable(in_folder("a.csv/b.csv")), FileError);
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
  put("a", std::string(1'000'000, 'a'));
  EXPECT_EQ(sha256_of_file(in_folder("a")),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  put("b", std::string(3'000'000, 'b'));
  EXPECT_EQ(sha256_of_file(in_folder("b")), sha256_of_bytes(std::string(3'000'000, 'b')));
}

TEST_F(Sha256Test, DoesNotCareHowTheBytesArrive) {
  Sha256 sum;
  sum.update("a");
  sum.update("");
  sum.update("bc");
  EXPECT_EQ(sum.finish(), sha256_of_bytes("abc"));
}

TEST_F(Sha256Test, SaysWhichFileItCannotRead) {
  EXPECT_THAT([&] { sha256_of_file(in_folder("missing")); },
              ThrowsMessage<FileError>(HasSubstr("missing: cannot open for reading")));
  EXPECT_THAT([&] { sha256_of_file(folder_); },
              ThrowsMessage<FileError>(HasSubstr("cannot read: Is a directory")));
}

TEST_F(ReadTextFile, KeepsEveryByte) {
  const std::string text("a\r\n\0b", 5);
  put("a", text);
  EXPECT_EQ(read_text_file(in_folder("a")), text);
}

TEST_F(ReadTextFile, AcceptsExactlyTheLimit) {
  put("a", std::string(100'000, 'x'));
  EXPECT_EQ(read_text_file(in_folder("a"), 100'000).size(), 100'000U);
  EXPECT_THAT([&] { read_text_file(in_folder("a"), 99'999); },
              ThrowsMessage<DataFormatError>(HasSubstr("a: byte 99999: found more data")));
}

TEST_F(ReadTextFile, RefusesAnEndlessDevice) {
  EXPECT_THROW(read_text_file("/dev/zero", 1000), DataFormatError);
}

TEST_F(ReadTextFile, SaysWhyAFileCannotBeRead) {
  EXPECT_THAT([&] { read_text_file(in_folder("missing")); },
              ThrowsMessage<FileError>(HasSubstr("No such file or directory")));
  EXPECT_THAT([&] { read_text_file(folder_); },
              ThrowsMessage<FileError>(HasSubstr("Is a directory")));
}

}  // namespace
}  // namespace gonio::files
