#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

namespace gonio::samples::test {

/// A folder of one test case's own, removed at the end.
class ScratchFolder : public testing::Test {
 protected:
  ScratchFolder() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("gonio_samples_" + std::string(info->name()) + "_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  ~ScratchFolder() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::filesystem::path file(const std::string& name) const { return folder_ / name; }

  std::filesystem::path written(std::string_view text, const std::string& name = "in.csv") const {
    std::ofstream stream(file(name), std::ios::binary);
    stream << text;
    return file(name);
  }

  static std::string content(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
  }

  /// what() of the exception of type Error that `call` throws.
  template <typename Error, typename Call>
  static std::string error_of(Call&& call) {
    try {
      call();
    } catch (const Error& error) {
      return error.what();
    }
    ADD_FAILURE() << "expected an exception";
    return {};
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace gonio::samples::test
