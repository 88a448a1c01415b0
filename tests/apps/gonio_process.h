#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
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

/// Standard input of a program: at its end from the beginning, or a pipe to which nobody has
/// written yet, as a person who does not answer.
enum class Input { ended, open };

/// A running `gonio`, or another program, standard error on a pipe.
///
/// `max_file_bytes`  What `ulimit -f` sets: no file may become longer. 0: no limit.
class GonioProcess {
 public:
  GonioProcess(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
               std::uint64_t max_file_bytes = 0, const std::string& program = GONIO_PROGRAM,
               Input input = Input::ended);
  ~GonioProcess();
  GonioProcess(const GonioProcess&) = delete;
  GonioProcess& operator=(const GonioProcess&) = delete;

  /// Blocks until standard error has said `text`; false when the program ends first.
  bool wait_for(const std::string& text);
  /// What standard error has said, as far as wait_for() has read.
  const std::string& said() const { return error_; }
  void send(int signal);
  /// Writes to an open standard input.
  void answer(const std::string& text) const;
  /// Waits for its end, no longer than this. Who is not read meanwhile must not say much.
  bool ends_within(std::chrono::nanoseconds time) const;
  pid_t pid() const { return pid_; }
  Ended wait();

 private:
  bool read_more();

  pid_t pid_ = -1;
  int error_pipe_ = -1;
  int input_ = -1;  ///< -1: at its end
  int out_file_ = -1;
  std::string error_;
};

Ended run_gonio(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                std::uint64_t max_file_bytes = 0);

}  // namespace gonio
