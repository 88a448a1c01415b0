#include <csignal>
#include <cstdio>
#include <exception>

#include "command.h"

int main(int argc, char** argv) {
  // A reader that goes away ("gonio plan | head") is an error to report, not a reason to die.
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return gonio::cli::run_command_line(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gonio: %s\n", error.what());
  } catch (...) {
    std::fputs("gonio: unknown failure\n", stderr);
  }
  return gonio::cli::kFailure;
}
