#include "asking_changer.h"

#include <fmt/format.h>

#include "gonio/console/line_input.h"

namespace gonio::cli {

void AskingChanger::mount(devices::Target target) {
  if (mounted_ == target) return;
  const std::string_view what = devices::in_words(target);
  fmt::print(stderr, "Mount the {}, then press Enter (q and Enter to give up): ", what);
  const LineInput answer = read_line({stop_, pause_});
  const auto give_up = [&](const std::string& why) {
    throw devices::DeviceError(devices::DeviceErrc::Stopped, name_, why);
  };
  switch (answer.ended) {
    case LineInput::Ended::stopped:
      fmt::print(stderr, "\n");
      if (on_pause_ && !stop_.stop_requested()) on_pause_();
      give_up(fmt::format("stopped before the {} was mounted", what));
      break;
    case LineInput::Ended::end:
      fmt::print(stderr, "\n");
      give_up(
          fmt::format("found the end of standard input, expected Enter once the {} is mounted: "
                      "run it at a terminal, or let a motorised changer do it (--yes)",
                      what));
      break;
    case LineInput::Ended::line:
      if (answer.text == "q") give_up(fmt::format("nobody mounted the {}", what));
      break;
  }
  if (own_ != nullptr) own_->mount(target);
  mounted_ = target;
}

}  // namespace gonio::cli
