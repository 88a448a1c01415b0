#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "temporary_folder.h"

namespace gonio::brdf::testing {

/// A file with these bytes in a folder of its own; both go with it.
class ScratchFile {
 public:
  ScratchFile(const std::string& name, const std::string& bytes) : path_(folder_.path() / name) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  TemporaryFolder folder_;
  std::filesystem::path path_;
};

}  // namespace gonio::brdf::testing
