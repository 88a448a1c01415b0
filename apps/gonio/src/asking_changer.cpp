#include "asking_changer.h"

#include <fmt/format.h>

#include <iostream>

namespace gonio::cli {

void AskingChanger::mount(devices::Target target) {
  if (mounted_ == target) return;
  fmt::print(stderr, "Mount the {}, then press Enter (q and Enter to give up): ",
             devices::in_words(target));
  std::string answer;
  if (!std::getline(std::cin, answer) || answer == "q") {
    throw devices::DeviceError(devices::DeviceErrc::Stopped, name_,
                               "nobody confirmed that the target was changed");
  }
  if (own_ != nullptr) own_->mount(target);
  mounted_ = target;
}

}  // namespace gonio::cli
