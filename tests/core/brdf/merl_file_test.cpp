#include "gonio/brdf/merl_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "gonio/errors/errors.h"
#include "temporary_folder.h"

namespace gonio::brdf {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class MerlFile : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

template <typename T>
std::string raw_bytes_of(const T& value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

/// The bytes of a file as other tools write it: odd values, several kinds of invalid cells.
const std::string& foreign_file() {
  static const std::string bytes = [] {
    std::string text = raw_bytes_of(std::array<std::int32_t, 3>{90, 90, 180});
    std::mt19937_64 generator(31);
    std::uniform_real_distribution<double> uniform(-0.2, 3.0);
    std::vector<double> stored(3 * lattice::kCells);
    for (double& value : stored) value = uniform(generator);
    stored[0] = 1.0;
    stored[1] = -0.0;
    stored[2] = std::numeric_limits<double>::denorm_min();
    stored[3] = -1e300;
    stored[4] = 1e300;
    text.append(reinterpret_cast<const char*>(stored.data()), stored.size() * sizeof(double));
    return text;
  }();
  return bytes;
}

/// The file with `value` as number `stored_index`.
std::string foreign_file_with(std::size_t stored_index, double value) {
  std::string bytes = foreign_file();
  std::memcpy(&bytes[12 + 8 * stored_index], &value, sizeof value);
  return bytes;
}

BrdfTable small_table() {
  BrdfTable table(IndexConvention::dtu, RadiometricScale::si);
  table.set_value(100, {0.1, 0.2, 0.3});
  return table;
}

/// The message of the error that reading must end in.
template <typename Error = DataFormatError>
std::string refusal(const fs::path& path) {
  try {
    read_merl(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error of this type";
}

TEST_F(MerlFile, ReadAndWrittenUnchangedIsByteIdentical) {
  write_bytes(folder_ / "in.binary", foreign_file());
  write_merl(folder_ / "out.binary", read_merl(folder_ / "in.binary"));
  EXPECT_TRUE(read_bytes(folder_ / "out.binary") == foreign_file());
  write_merl(folder_ / "again.binary", read_merl(folder_ / "out.binary"));
  EXPECT_TRUE(read_bytes(folder_ / "again.binary") == foreign_file());
}

TEST_F(MerlFile, HoldsThreePlanesAfterTwelveBytes) {
  BrdfTable table = small_table();
  table.set_value(7, {2.0 / 1500.0, 3.0 * 1.15 / 1500.0, 4.0 * 1.66 / 1500.0});
  write_merl(folder_ / "a.binary", table);
  const std::string bytes = read_bytes(folder_ / "a.binary");
  ASSERT_EQ(bytes.size(), 34'992'012u);
  std::array<std::int32_t, 3> header{};
  std::memcpy(header.data(), bytes.data(), sizeof header);
  EXPECT_THAT(header, ::testing::ElementsAre(90, 90, 180));
  for (std::size_t channel = 0; channel < 3; ++channel) {
    double stored = 0.0;
    std::memcpy(&stored, &bytes[12 + 8 * (channel * 1'458'000 + 7)], sizeof stored);
    EXPECT_NEAR(stored, 2.0 + static_cast<double>(channel), 1e-12);
    std::memcpy(&stored, &bytes[12 + 8 * (channel * 1'458'000 + 8)], sizeof stored);
    EXPECT_EQ(stored, -1.0) << "an invalid cell";
  }
}

TEST_F(MerlFile, WithoutASidecarHasMerlScaleAndBinCentres) {
  write_bytes(folder_ / "in.binary", foreign_file());
  const BrdfTable table = read_merl(folder_ / "in.binary");
  EXPECT_EQ(table.scale(), RadiometricScale::merl);
  EXPECT_EQ(table.convention(), IndexConvention::bin_centre);
  EXPECT_FALSE(read_merl_sidecar(folder_ / "in.binary").has_value());
}

TEST_F(MerlFile, BringsBackConventionScaleAndProvenance) {
  const std::string provenance =
      R"({"tool":"gonio","seeds":[1,2],"note":"\u00e4 \"quoted\"","a":1})";
  write_merl(folder_ / "a.binary", small_table(), files::Overwrite::No, provenance);
  EXPECT_THAT(folder_.names(), ::testing::ElementsAre("a.binary", "a.json"));
  const BrdfTable table = read_merl(folder_ / "a.binary");
  EXPECT_EQ(table.convention(), IndexConvention::dtu);
  EXPECT_EQ(table.scale(), RadiometricScale::si);
  EXPECT_EQ(table.stored_planes(), small_table().stored_planes());
  const auto sidecar = read_merl_sidecar(folder_ / "a.binary");
  ASSERT_TRUE(sidecar.has_value());
  EXPECT_EQ(sidecar->provenance_json,
            "{\"tool\":\"gonio\",\"seeds\":[1,2],\"note\":\"\xC3\xA4 \\\"quoted\\\"\",\"a\":1}");
}

TEST_F(MerlFile, NamesItsSidecarAfterItself) {
  EXPECT_EQ(merl_sidecar_path("x/teflon.binary"), "x/teflon.json");
  EXPECT_EQ(merl_sidecar_path("x/blue.metallic.binary"), "x/blue.metallic.json");
  EXPECT_EQ(merl_sidecar_path("x/teflon.v2"), "x/teflon.v2.json");
}

TEST_F(MerlFile, IsRefusedWithTheSidecarOfAnotherFile) {
  // What a crash between the two renames of an overwrite leaves, and a file copied over another.
  write_merl(folder_ / "a.binary", small_table());
  const std::string old_binary = read_bytes(folder_ / "a.binary");
  BrdfTable other(IndexConvention::bin_centre, RadiometricScale::merl);
  other.set_value(100, {0.1, 0.2, 0.4});
  write_merl(folder_ / "a.binary", other, files::Overwrite::Yes);
  EXPECT_EQ(read_merl(folder_ / "a.binary").scale(), RadiometricScale::merl);
  write_bytes(folder_ / "a.binary", old_binary);
  EXPECT_THAT(refusal(folder_ / "a.binary"),
              AllOf(HasSubstr("a.json: key \"binary_sha256\""), HasSubstr("another file")));
}

TEST_F(MerlFile, ReplacesOnlyWhenTold) {
  write_merl(folder_ / "a.binary", small_table());
  const std::string before = read_bytes(folder_ / "a.binary");
  BrdfTable other = small_table();
  other.set_invalid(100);
  other.set_value(101, {1.0, 1.0, 1.0});
  EXPECT_THROW(write_merl(folder_ / "a.binary", other), FileError);
  EXPECT_TRUE(read_bytes(folder_ / "a.binary") == before);
  write_merl(folder_ / "a.binary", other, files::Overwrite::Yes);
  EXPECT_EQ(read_merl(folder_ / "a.binary").stored_planes(), other.stored_planes());
  EXPECT_EQ(folder_.names().size(), 2u);
}

TEST_F(MerlFile, ReplacesASidecarThatACrashLeftAloneButNoOtherJson) {
  write_merl(folder_ / "a.binary", small_table());
  fs::remove(folder_ / "a.binary");
  write_merl(folder_ / "a.binary", small_table());
  EXPECT_NO_THROW(read_merl(folder_ / "a.binary"));
  write_bytes(folder_ / "b.json", "{\"mine\": true}");
  EXPECT_THROW(write_merl(folder_ / "b.binary", small_table()), FileError);
  EXPECT_EQ(read_bytes(folder_ / "b.json"), "{\"mine\": true}");
  EXPECT_THAT(folder_.names(), ::testing::ElementsAre("a.binary", "a.json", "b.json"));
}

TEST_F(MerlFile, LeavesNothingBehindWhenItCannotBeWritten) {
  EXPECT_THROW(write_merl(folder_ / "missing/a.binary", small_table()), FileError);
  fs::create_directory(folder_ / "a.binary");
  EXPECT_THROW(write_merl(folder_ / "a.binary", small_table(), files::Overwrite::Yes), FileError);
  fs::create_directory(folder_ / "b.json");
  EXPECT_THROW(write_merl(folder_ / "b.binary", small_table(), files::Overwrite::Yes), FileError);
  EXPECT_THAT(folder_.names(), ::testing::ElementsAre("a.binary", "b.json"));
}

/// The calling thread's rights without those of root, which ignore what a folder allows.
class AsNobody {
 public:
  AsNobody() : was_root_(::geteuid() == 0), active_(!was_root_ || ::seteuid(kNobody) == 0) {}
  ~AsNobody() {
    if (was_root_ && active_ && ::seteuid(0) != 0) std::abort();
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;
  bool active() const { return active_; }

  static constexpr uid_t kNobody = 65534;

 private:
  bool was_root_;
  bool active_;
};

TEST_F(MerlFile, LeavesTheOldPairWhereTheFolderCannotBeSynced) {
  // A folder that may be written but not opened: every rename works, the sync behind it does not.
  write_merl(folder_ / "a.binary", small_table());
  const std::string binary = read_bytes(folder_ / "a.binary");
  const std::string sidecar = read_bytes(folder_ / "a.json");
  BrdfTable other(IndexConvention::bin_centre, RadiometricScale::merl);
  other.set_value(100, {0.1, 0.2, 0.4});
  fs::permissions(folder_.path(), fs::perms::others_write | fs::perms::others_exec |
                                      fs::perms::owner_write | fs::perms::owner_exec);
  {
    const AsNobody nobody;
    if (nobody.active()) {
      EXPECT_THROW(write_merl(folder_ / "a.binary", other, files::Overwrite::Yes), FileError);
      EXPECT_THROW(write_merl(folder_ / "b.binary", other), FileError);
    }
  }
  fs::permissions(folder_.path(), fs::perms::owner_all);
  EXPECT_TRUE(read_bytes(folder_ / "a.binary") == binary);
  EXPECT_EQ(read_bytes(folder_ / "a.json"), sidecar);
  EXPECT_THAT(folder_.names(), ::testing::ElementsAre("a.binary", "a.json"));
}

TEST_F(MerlFile, IsNotWrittenFromATableItsReaderWouldRefuse) {
  EXPECT_THROW(write_merl(folder_ / "a.binary", BrdfTable()), std::invalid_argument);
  std::vector<double> stored(3 * lattice::kCells, 1.0);
  stored[1'458'000 + 182] = std::numeric_limits<double>::infinity();
  const BrdfTable infinite(std::move(stored), IndexConvention::bin_centre, RadiometricScale::si);
  try {
    write_merl(folder_ / "a.binary", infinite);
    FAIL() << "an infinite value was written";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("infinite value in the G plane at index (0, 1, 2)"));
  }
  for (const char* provenance : {"", "[1]", "3", "{\"a\":", "{\"a\":\"\xFF\"}", "null"}) {
    EXPECT_THROW(write_merl(folder_ / "a.binary", small_table(), files::Overwrite::No, provenance),
                 std::invalid_argument)
        << provenance;
  }
  EXPECT_TRUE(folder_.names().empty());
}

TEST_F(MerlFile, RefusesTruncatedAndOversizedFilesWithTheOffset) {
  const fs::path path = folder_ / "a.binary";
  write_bytes(path, "");
  EXPECT_THAT(refusal(path), AllOf(HasSubstr(path.string()), HasSubstr("byte 0")));
  write_bytes(path, foreign_file().substr(0, 5));
  EXPECT_THAT(refusal(path), HasSubstr("byte 5: the file ends here, expected 7 more bytes"));
  write_bytes(path, foreign_file().substr(0, 34'992'011));
  EXPECT_THAT(refusal(path), HasSubstr("byte 34992011: found 34992011 bytes, expected 34992012"));
  write_bytes(path, foreign_file() + "x");
  EXPECT_THAT(refusal(path), HasSubstr("byte 34992012: found 34992013 bytes, expected 34992012"));
}

TEST_F(MerlFile, RefusesOtherDimensions) {
  const fs::path path = folder_ / "a.binary";
  for (const auto& header :
       {std::array<std::int32_t, 3>{180, 90, 90}, {90, 90, 360}, {-90, 90, -180}}) {
    write_bytes(path, raw_bytes_of(header) + foreign_file().substr(12));
    EXPECT_THAT(refusal(path),
                AllOf(HasSubstr("byte 0: found dimensions " + std::to_string(header[0])),
                      HasSubstr("expected 90 x 90 x 180")));
  }
  // Big-endian, as a careless converter would write it.
  write_bytes(path, raw_bytes_of(std::array<std::int32_t, 3>{0x5A000000, 0x5A000000, -0x4C000000}) +
                        foreign_file().substr(12));
  EXPECT_THAT(refusal(path), HasSubstr("found dimensions"));
}

TEST_F(MerlFile, RefusesValuesThatAreNotFiniteWithOffsetAndIndex) {
  const fs::path path = folder_ / "a.binary";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  write_bytes(path, foreign_file_with(0, nan));
  EXPECT_THAT(refusal(path), HasSubstr("byte 12: found NaN in the R plane at index (0, 0, 0)"));
  write_bytes(path, foreign_file_with(1'458'000 + 179, -nan));
  EXPECT_THAT(refusal(path),
              HasSubstr("byte 11665444: found NaN in the G plane at index (0, 0, 179)"));
  write_bytes(path, foreign_file_with(3 * 1'458'000 - 1, -infinity));
  EXPECT_THAT(
      refusal(path),
      HasSubstr("byte 34992004: found an infinite value in the B plane at index (89, 89, 179)"));
}

TEST_F(MerlFile, RefusesAFileWithoutAUsableCell) {
  const fs::path path = folder_ / "a.binary";
  std::vector<double> stored(3 * lattice::kCells, -1.0);
  const auto write_stored = [&] {
    write_bytes(path,
                foreign_file().substr(0, 12) +
                    std::string(reinterpret_cast<const char*>(stored.data()), 8 * stored.size()));
  };
  write_stored();
  EXPECT_THAT(refusal(path), HasSubstr("no valid cell above the horizon"));
  for (const std::size_t plane : {0, 1, 2}) stored[(plane + 1) * lattice::kCells - 1] = 1.0;
  write_stored();  // (89, 89, 179) is below the horizon
  EXPECT_THAT(refusal(path), HasSubstr("no valid cell above the horizon"));
  for (const std::size_t plane : {0, 1, 2}) stored[plane * lattice::kCells] = 1.0;
  write_stored();
  EXPECT_NO_THROW(read_merl(path));
}

TEST_F(MerlFile, RefusesWhatIsNotARegularFileWithoutWaitingForIt) {
  EXPECT_THAT(refusal<FileError>(folder_.path()),
              HasSubstr("found a folder, expected a regular file"));
  const fs::path pipe = folder_ / "pipe.binary";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(refusal<FileError>(pipe), HasSubstr("expected a regular file"));
  EXPECT_THAT(refusal<FileError>("/dev/zero"), HasSubstr("expected a regular file"));
  EXPECT_THROW(read_merl(folder_ / "missing.binary"), FileError);
}

/// One sidecar that read_merl() must refuse, and what it must say.
struct BadSidecar {
  const char* text;
  const char* message;
};

constexpr const char* kSum = "0000000000000000000000000000000000000000000000000000000000000000";

std::string complete(const std::string& without_sum) {
  std::string text = without_sum;
  const std::size_t at = text.find("SUM");
  return at == std::string::npos ? text : text.replace(at, 3, kSum);
}

TEST_F(MerlFile, RefusesBrokenSidecarsNamingTheKey) {
  write_bytes(folder_ / "a.binary", foreign_file());
  const BadSidecar bad[] = {
      {"", "byte 1: not valid JSON"},
      {"{\"format\": ", "not valid JSON"},
      {"\xFF\xFE", "not valid JSON"},
      {"[1, 2]", "byte 0: found a JSON array, expected an object"},
      {"7", "byte 0: found a JSON number, expected an object"},
      {"{}", "key \"format\": missing"},
      {R"({"format": 3})", "key \"format\": found a number, expected a string"},
      {R"({"format": "x"})", "key \"format\": found \"x\", expected \"gonio-merl-sidecar\""},
      {R"({"format": "gonio-merl-sidecar", "format_version": 2})",
       "key \"format_version\": found 2, expected 1"},
      {R"({"format": "gonio-merl-sidecar", "format_version": 1, "lattice_convention": "middle"})",
       "key \"lattice_convention\": unknown lattice convention \"middle\""},
      {R"({"format": "gonio-merl-sidecar", "format_version": 1, "lattice_convention": "dtu",
           "radiometric_scale": null})",
       "key \"radiometric_scale\": found a null"},
      {R"({"format": "gonio-merl-sidecar", "format_version": 1, "lattice_convention": "dtu",
           "radiometric_scale": "SI"})",
       "key \"radiometric_scale\": unknown radiometric scale \"SI\""},
      {R"({"format": "gonio-merl-sidecar", "format_version": 1, "lattice_convention": "dtu",
           "radiometric_scale": "si", "binary_sha256": "12"})",
       "key \"binary_sha256\": expected 64"},
      {R"({"format": "gonio-merl-sidecar", "format_version": 1, "lattice_convention": "dtu",
           "radiometric_scale": "si", "binary_sha256": "SUM", "provenance": []})",
       "key \"provenance\": found a array, expected an object"},
      {R"({"format": "gonio-merl-sidecar", "format_version": 1, "lattice_convention": "dtu",
           "radiometric_scale": "si", "binary_sha256": "SUM", "provenance": {}})",
       "key \"binary_sha256\": found the sum of another file"},
      {R"({"format": 1e999})", "not usable JSON"},
  };
  for (const BadSidecar& sidecar : bad) {
    write_bytes(folder_ / "a.json", complete(sidecar.text));
    const std::string message = refusal(folder_ / "a.binary");
    EXPECT_THAT(message, AllOf(HasSubstr("a.json: "), HasSubstr(sidecar.message))) << sidecar.text;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST_F(MerlFile, RefusesHostileSidecars) {
  write_bytes(folder_ / "a.binary", foreign_file());
  write_bytes(folder_ / "a.json", std::string(2'000'000, ' '));
  EXPECT_THAT(refusal(folder_ / "a.binary"),
              HasSubstr("2000000 bytes, expected a sidecar of at most"));
  write_bytes(folder_ / "a.json", std::string(500'000, '['));
  EXPECT_THAT(refusal(folder_ / "a.binary"), HasSubstr("nested deeper than 64 levels"));
  std::string nested = "{\"format\": ";
  nested += std::string(400'000, '[') + std::string(400'000, ']') + "}";
  write_bytes(folder_ / "a.json", nested);
  EXPECT_THAT(refusal(folder_ / "a.binary"), HasSubstr("nested deeper than 64 levels"));
  fs::remove(folder_ / "a.json");
  ASSERT_EQ(::mkfifo((folder_ / "a.json").c_str(), 0600), 0);
  EXPECT_THAT(refusal<FileError>(folder_ / "a.binary"), HasSubstr("expected a regular file"));
  fs::remove(folder_ / "a.json");
  fs::create_directory(folder_ / "a.json");
  EXPECT_THAT(refusal<FileError>(folder_ / "a.binary"), HasSubstr("expected a regular file"));
}

}  // namespace
}  // namespace gonio::brdf
