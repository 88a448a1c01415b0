#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "temporary_folder.h"

namespace gonio::samples::test {

/// Every test case with a folder of its own.
class ScratchFolder : public testing::Test {
 protected:
  std::filesystem::path file(std::string_view name) const { return folder_ / name; }

  std::filesystem::path written(std::string_view text, std::string_view name = "in.csv") const {
    return folder_.write(name, text);
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
  TemporaryFolder folder_;
};

}  // namespace gonio::samples::test
