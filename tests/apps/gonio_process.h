#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace gonio {

/// What a run of the program left.
struct Ended {
  int exit_code = -1;  ///< -1: ended by a signal
  std::string out;
  std::string error;
};

/// A running `gonio`, standard error on a pipe.
class GonioProcess {
 public:
  GonioProcess(const std::vector<std::string>& arguments, const std::filesystem::path& folder);
  ~GonioProcess();
  GonioProcess(const GonioProcess&) = delete;
  GonioProcess& operator=(const GonioProcess&) = delete;

  /// Blocks until standard error has said `text`; false when the program ends first.
  bool wait_for(const std::string& text);
  void send(int signal);
  Ended wait();

 private:
  bool read_more();

  pid_t pid_ = -1;
  int error_pipe_ = -1;
  int out_file_ = -1;
  std::string error_;
};

Ended run_gonio(const std::vector<std::string>& arguments, const std::filesystem::path& folder);

/// A fresh folder, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  /// Names in it, sorted, hidden ones as well.
  std::vector<std::string> names() const;
  void write(const std::string& name, const std::string& text) const;
  std::string read(const std::string& name) const;

 private:
  std::filesystem::path path_;
};

}  // namespace gonio
