#include <csignal>
#include <cstdio>
#include <exception>
#include <string_view>

#include "command.h"
#include "gonio/console/printable.h"
#include "gonio/console/standard_descriptors.h"
#include "gonio/opened_rig/watchdog.h"

int main(int argc, char** argv) {
  gonio::cli::hold_standard_descriptors();
  if (argc == 2 && std::string_view(argv[1]) == gonio::cli::kWatchdogArgument) {
    return gonio::cli::run_watchdog();
  }
  // A reader that goes away ("gonio plan | head") is an error to report, not a reason to die.
  std::signal(SIGPIPE, SIG_IGN);
  // So is a limit on the size of files (`ulimit -f`): writing then fails like on a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return gonio::cli::run_command_line(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gonio: %s\n", gonio::cli::printable_line(error.what()).c_str());
  } catch (...) {
    std::fputs("gonio: unknown failure\n", stderr);
  }
  return gonio::cli::kFailure;
}
