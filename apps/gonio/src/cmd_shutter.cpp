#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "command.h"
#include "hands_on.h"

namespace gonio::cli {
namespace {

struct ShutterOptions : HandsOnOptions {
  std::string state;
  std::string channel;
  double seconds = 0.0;
};

constexpr std::chrono::milliseconds kStopPoll{50};

int shutter(Context& context, const ShutterOptions& options) {
  const bool open = options.state == "open";
  if (!open && (!options.channel.empty() || options.seconds > 0.0)) {
    throw UsageError("close takes neither --channel nor --seconds");
  }
  HandsOn rig(context, options, Parts::axes_and_lamp);
  if (!open) {
    rig.finish();
    context.console.say("closed");
    return kSuccess;
  }
  const std::string channel =
      options.channel.empty() ? rig.devices().light->channels().front().name : options.channel;
  try {
    rig.guarded().light(channel);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  // The program that opened it watches over it: leaving closes the shutter.
  context.console.say(options.seconds > 0.0
                          ? fmt::format("{} is lit for {:g} s", channel, options.seconds)
                          : fmt::format("{} is lit until Control-C", channel));
  const auto start = std::chrono::steady_clock::now();
  const std::chrono::duration<double> wanted(options.seconds);
  while (!context.stop.stop_requested() &&
         (options.seconds == 0.0 || std::chrono::steady_clock::now() - start < wanted)) {
    std::this_thread::sleep_for(kStopPoll);
  }
  rig.finish();
  context.console.say("closed");
  return kSuccess;
}

}  // namespace

void add_shutter(const Command& root) {
  auto options = std::make_shared<ShutterOptions>();
  const Command command =
      root.add("shutter", "Open the lamp's shutter for a while, or close it",
               "gonio shutter rigs/lab_example.toml open --channel G --seconds 10");
  add_hands_on_options(command, *options, false);
  command.choice("STATE", options->state, {"open", "close"}, "What to do", Need::required);
  command.text("--channel", options->channel, "Which to light (default: the first)");
  command.number("--seconds", options->seconds, 0.0, 86400.0,
                 "How long; 0: until Control-C. It closes when the program ends");
  command.on_call(options, shutter);
}

}  // namespace gonio::cli
