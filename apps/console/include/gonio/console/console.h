#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace gonio::cli {

/// What the user sees. Results go to standard output, everything else to standard error. Control
/// characters in what they are given are shown, not obeyed (printable.h); line ends count in
/// results only.
///
/// Threads  One.
class Console {
 public:
  int verbosity = 0;  ///< -1: errors only, 0: usual, 1: details and times

  Console();

  /// A result: a table, a verdict, JSON. Throws FileError when it cannot be written, unless the
  /// reader went away.
  void result(std::string_view text) const;
  /// What the program is doing or has done; not with -q.
  void say(std::string_view line) const;
  /// The same, with -v only.
  void detail(std::string_view line) const;
  void warn(std::string_view line) const;
  void error(std::string_view message, std::string_view hint = {}) const;

  bool error_is_terminal() const { return error_is_terminal_; }

 private:
  std::string marked(std::string_view word, std::string_view colour) const;

  bool error_is_terminal_;
  bool colour_;  ///< standard error is a terminal and NO_COLOR is not set
};

/// Progress of one piece of work: a bar with the time left on a terminal, otherwise a line now and
/// then once it has taken two seconds. Ends its line when it goes out of scope.
class Progress {
 public:
  Progress(const Console& console, std::string_view label);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `fraction` in [0, 1]. The time left is estimated from the time taken, once there is enough.
  void update(double fraction, std::string_view text = {});
  /// With the time left known better, as by a session's own clock.
  void update(double fraction, std::string_view text, double remaining_s);

 private:
  using Clock = std::chrono::steady_clock;

  const Console& console_;
  std::string label_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_;
  bool drawn_ = false;
};

/// Prints how long a phase took, with -v.
class PhaseTimer {
 public:
  PhaseTimer(const Console& console, std::string name);
  ~PhaseTimer();
  PhaseTimer(const PhaseTimer&) = delete;
  PhaseTimer& operator=(const PhaseTimer&) = delete;

 private:
  const Console& console_;
  std::string name_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// "42 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

}  // namespace gonio::cli
