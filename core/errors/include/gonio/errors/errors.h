#pragma once

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

/// The exceptions of the libraries. Each what() is one line that a user can act on; apps print it
/// after the program's name and leave with an exit code by type:
///
///   2  DataFormatError, FileError, ConfigError (and wrong usage): the input is at fault
///   3  DeviceError (gonio/devices): a device is
///   4  a session that ended incomplete      (a result, not an exception)
///   5  a complete result not to be trusted  (a result, not an exception)
///   1  everything else: NumericalError, CalibrationError, std::invalid_argument, ...
///
/// Expected outcomes (a saturated point, an unreachable direction) are values, never exceptions.
/// A broken precondition is std::invalid_argument. The layer that knows the file, line or device
/// names it; nothing is nested.
namespace gonio {

/// A file was read but is not what it should be.
class DataFormatError : public std::runtime_error {
 public:
  /// `place`    Where in the file: "byte 12", "line 7", "attribute eps", "dimension 2".
  /// `message`  What was found and what was expected: "found 91, expected 90".
  DataFormatError(std::filesystem::path path, std::string place, const std::string& message)
      : std::runtime_error(path.string() + ": " + place + ": " + message),
        path_(std::move(path)),
        place_(std::move(place)) {}

  const std::filesystem::path& path() const noexcept { return path_; }
  const std::string& place() const noexcept { return place_; }

 private:
  std::filesystem::path path_;
  std::string place_;
};

/// A file or folder could not be opened, written, renamed, or exists and may not be replaced.
class FileError : public std::runtime_error {
 public:
  /// `action`  What was tried, after "cannot": "open for reading", "rename to X".
  /// `reason`  Why not: the system's words, or ours where the system has none.
  FileError(std::filesystem::path path, const std::string& action, const std::string& reason)
      : std::runtime_error(path.string() + ": cannot " + action + ": " + reason),
        path_(std::move(path)) {}

  /// From errno, which the caller saved before anything else could overwrite it.
  FileError(std::filesystem::path path, const std::string& action, int saved_errno)
      : FileError(std::move(path), action, std::generic_category().message(saved_errno)) {}

  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

/// A value in a configuration file (or its override on the command line) is unusable.
class ConfigError : public std::runtime_error {
 public:
  /// `line`  From 1; 0 when the value came from no file line.
  /// `key`   Dotted: "camera.exposure_us".
  /// `why`   What was found, what was expected, and for an unknown key what may have been meant.
  ConfigError(std::filesystem::path file, int line, std::string key, const std::string& why)
      : std::runtime_error(file.string() + (line > 0 ? ":" + std::to_string(line) : "") + " " +
                           key + ": " + why),
        file_(std::move(file)),
        line_(line),
        key_(std::move(key)) {}

  const std::filesystem::path& file() const noexcept { return file_; }
  int line() const noexcept { return line_; }
  const std::string& key() const noexcept { return key_; }

 private:
  std::filesystem::path file_;
  int line_;
  std::string key_;
};

/// Mathematics failed on admissible input: no convergence, a singular system.
class NumericalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A calibration is missing, stale, or contradicts what is measured.
class CalibrationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace gonio
