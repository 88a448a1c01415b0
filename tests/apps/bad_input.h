#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <regex>
#include <string>
#include <vector>

#include "gonio/brdf/merl_lattice.h"
#include "gonio_process.h"
#include "temporary_folder.h"

namespace gonio {

constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kPlaneValues = brdf::lattice::kCells;

/// A MERL file of one value throughout.
inline std::string merl_file(double value) {
  std::string bytes(kHeaderBytes + 3 * kPlaneValues * sizeof(double), '\0');
  const std::int32_t dimensions[3] = {90, 90, 180};
  std::memcpy(bytes.data(), dimensions, sizeof dimensions);
  for (std::size_t i = 0; i < 3 * kPlaneValues; ++i) {
    std::memcpy(bytes.data() + kHeaderBytes + i * sizeof value, &value, sizeof value);
  }
  return bytes;
}

constexpr const char* kHeader = "theta_h_deg,theta_d_deg,phi_d_deg\n";
constexpr const char* kSampleHeader = "theta_h_deg,theta_d_deg,phi_d_deg,r,g,b\n";

/// Without the lines that show progress, as a slow machine brings them.
inline std::string without_progress(const std::string& text) {
  static const std::regex progress("[a-z ]+: [0-9]+ %[^\n]*\n");
  return std::regex_replace(text, progress, "");
}

class BadInput : public testing::Test {
 protected:
  /// Runs it; expects exit code 2, one line that holds all `words`, and a folder left as it was.
  void refused(const std::vector<std::string>& arguments, const std::vector<std::string>& words,
               std::uint64_t max_file_bytes = 0) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const std::vector<std::string> before = folder.names();
    Ended ended = run_gonio(arguments, folder.path(), max_file_bytes);
    ended.error = without_progress(ended.error);
    EXPECT_EQ(ended.exit_code, 2) << ended.error;
    EXPECT_EQ(ended.out, "");
    EXPECT_THAT(ended.error, testing::StartsWith("gonio: "));
    for (const std::string& word : words) EXPECT_THAT(ended.error, testing::HasSubstr(word));
    // A hint, indented, may follow the one line of the error.
    const std::size_t second = ended.error.find('\n') + 1;
    EXPECT_TRUE(second == ended.error.size() || ended.error.compare(second, 2, "  ") == 0)
        << ended.error;
    EXPECT_EQ(folder.names(), before) << "something was left behind";
  }

  TemporaryFolder folder;
};

}  // namespace gonio
