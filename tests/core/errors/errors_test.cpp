#include "gonio/errors/errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <string>
#include <type_traits>

namespace gonio {
namespace {

using ::testing::StrEq;

TEST(DataFormatError, NamesPathPlaceAndMessageInOneLine) {
  const DataFormatError error("paints/blue.binary", "byte 4", "found 91, expected 90");
  EXPECT_THAT(error.what(), StrEq("paints/blue.binary: byte 4: found 91, expected 90"));
  EXPECT_EQ(error.path(), "paints/blue.binary");
  EXPECT_EQ(error.place(), "byte 4");
}

TEST(FileError, SaysWhatWasTriedAndWhyItFailed) {
  const FileError error("out/basis.h5", "create", "it exists");
  EXPECT_THAT(error.what(), StrEq("out/basis.h5: cannot create: it exists"));
}

TEST(FileError, TranslatesTheSystemsErrorNumber) {
  const FileError error("out/basis.h5", "open for reading", ENOENT);
  EXPECT_THAT(error.what(),
              StrEq("out/basis.h5: cannot open for reading: No such file or directory"));
}

TEST(ConfigError, NamesFileLineAndKey) {
  const ConfigError error("rig.toml", 12, "camera.exposure_us", "found -5, expected > 0");
  EXPECT_THAT(error.what(), StrEq("rig.toml:12 camera.exposure_us: found -5, expected > 0"));
  EXPECT_EQ(error.line(), 12);
}

TEST(ConfigError, LeavesOutALineItDoesNotHave) {
  const ConfigError error("command line", 0, "seed", "found \"x\", expected an integer");
  EXPECT_THAT(error.what(), StrEq("command line seed: found \"x\", expected an integer"));
}

TEST(Errors, CanAllBeCaughtAsRuntimeErrors) {
  EXPECT_TRUE((std::is_base_of_v<std::runtime_error, DataFormatError>));
  EXPECT_TRUE((std::is_base_of_v<std::runtime_error, FileError>));
  EXPECT_TRUE((std::is_base_of_v<std::runtime_error, ConfigError>));
  EXPECT_TRUE((std::is_base_of_v<std::runtime_error, NumericalError>));
  EXPECT_TRUE((std::is_base_of_v<std::runtime_error, CalibrationError>));
}

}  // namespace
}  // namespace gonio
