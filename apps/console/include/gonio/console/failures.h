#pragma once

#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace gonio::cli {

/// How the program ends; the same for every subcommand.
enum ExitCode : int {
  kSuccess = 0,
  kFailure = 1,   ///< everything that has no code of its own
  kBadInput = 2,  ///< usage or input files
  kDeviceFailure = 3,
  kIncompleteSession = 4,
  kDoNotTrust = 5  ///< a whole result whose verdict is against it
};

/// Wrong usage or unusable input, in words for the user: exit code 2. One line; `hint`, when
/// given, is a second line that says what to do next.
class UsageError : public std::runtime_error {
 public:
  explicit UsageError(const std::string& message, std::string hint = "")
      : std::runtime_error(message), hint_(std::move(hint)) {}
  const std::string& hint() const noexcept { return hint_; }

 private:
  std::string hint_;
};

/// The user asked to stop; what was begun has been taken back.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted; nothing was written") {}
};

struct Failure {
  ExitCode code = kFailure;
  std::string message;  ///< one line, as far as the names in it are
  std::string hint;     ///< may be empty
};

/// What to print and return for an exception, nested contexts included.
Failure describe(const std::exception& error);

/// Runs `work` on one input file: whatever is wrong with its contents is bad input naming it.
/// For library calls that know a value but not the file it came from.
template <class Work>
auto blame(const std::filesystem::path& input, Work&& work) {
  try {
    return work();
  } catch (const std::invalid_argument& error) {
    throw UsageError(input.string() + ": " + error.what());
  }
}

}  // namespace gonio::cli
