#include "changer_wait.h"

#include <fmt/format.h>

namespace gonio::cli {

void ChangerWait::mount(devices::Target target) {
  // Also when it throws.
  struct Moving {
    explicit Moving(std::atomic<bool>& flag) : moves(flag) { moves = true; }
    ~Moving() { moves = false; }
    std::atomic<bool>& moves;
  };
  const Moving moving(moves_);
  if (stop_.stop_requested()) tell();  // just before
  console_.detail(fmt::format("  {} brings the {}", name(), devices::in_words(target)));
  changer_.mount(target);
}

void ChangerWait::tell() {
  if (told_.exchange(true)) return;
  console_.say(
      "stopping: axes and shutter are told to; the program ends once the target changer is where "
      "it was sent, which cannot be told to stop");
}

}  // namespace gonio::cli
