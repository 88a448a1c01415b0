#pragma once

#include <initializer_list>
#include <stop_token>
#include <string>

namespace gonio::cli {

/// What came of waiting for a line.
struct LineInput {
  enum class Ended {
    line,     ///< `text` is one, without its end
    end,      ///< standard input has ended, or cannot be read
    stopped,  ///< a stop was asked for first
  };
  Ended ended = Ended::end;
  std::string text;
};

/// Waits for a line of standard input, and hears stop requests meanwhile, those made before as
/// well. Takes no byte beyond the line; must not be mixed with std::cin. Longer lines end at 4096
/// bytes. Threads: one at a time.
LineInput read_line(std::initializer_list<std::stop_token> until);

}  // namespace gonio::cli
