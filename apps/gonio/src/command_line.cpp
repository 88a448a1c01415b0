#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "command.h"
#include "gonio/console/printable.h"
#include "gonio/console/stop_signals.h"
#include "gonio/console/suggest.h"
#include "gonio/devices/device_error.h"
#include "gonio/parallel/parallel.h"
#include "gonio/version/version.h"

namespace gonio::cli {
namespace {

std::vector<std::string> subcommand_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands({})) names.push_back(sub->get_name());
  return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

CLI::App* subcommand(CLI::App& app, const std::string& name) {
  for (CLI::App* sub : app.get_subcommands({})) {
    if (sub->get_name() == name) return sub;
  }
  return nullptr;
}

/// The innermost subcommand that the words lead to, and the first word after it that is no option.
struct Called {
  CLI::App* command;
  std::string next;
};
Called called_command(CLI::App& app, const std::vector<std::string>& words) {
  Called called{&app, {}};
  for (const std::string& word : words) {
    if (word.starts_with("-")) continue;
    CLI::App* next = subcommand(*called.command, word);
    if (next == nullptr) {
      called.next = word;
      break;
    }
    called.command = next;
  }
  return called;
}

/// What is wrong with a command line, in one line.
std::string usage_message(const Called& called, const CLI::ParseError& error) {
  const std::vector<std::string> subcommands = subcommand_names(*called.command);
  if (!subcommands.empty() && !called.next.empty()) {
    return fmt::format("unknown subcommand \"{}\"{}", called.next,
                       did_you_mean(called.next, subcommands));
  }
  // A mistyped option is also the reason when the one that was meant is missed.
  for (const std::string& extra : called.command->remaining()) {
    const std::string name = extra.substr(0, extra.find('='));
    if (!name.starts_with("-")) return fmt::format("unexpected argument \"{}\"", extra);
    return fmt::format("unknown option {}{}", name,
                       did_you_mean(name, option_names(*called.command)));
  }
  if (!subcommands.empty()) return "a subcommand is required";
  std::string text = error.what();
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

void collect_words(const CLI::App& command, const std::string& path,
                   std::vector<Command::Words>& all) {
  Command::Words own{path, subcommand_names(command)};
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) own.words.push_back("--" + name);
    for (const std::string& name : option->get_snames()) own.words.push_back("-" + name);
  }
  all.push_back(std::move(own));
  for (const CLI::App* sub : command.get_subcommands({})) {
    collect_words(*sub, path.empty() ? sub->get_name() : path + " " + sub->get_name(), all);
  }
}

void mark(CLI::Option* option, Need need, bool show_default) {
  if (need == Need::required) {
    option->required();
  } else if (show_default) {
    option->capture_default_str();
  }
}

/// A range lets NaN through: it is neither below nor above.
CLI::Validator is_number() {
  return {[](const std::string& text) {
            return std::isfinite(std::strtod(text.c_str(), nullptr))
                       ? std::string()
                       : "found " + text + ", expected a number";
          },
          ""};
}

}  // namespace

Command Command::add(const std::string& name, const std::string& description,
                     const std::string& example) const {
  CLI::App& command = *app_->add_subcommand(name, description);
  command.footer("Example:\n  " + example);
  const Command added(command, *context_);
  added.flag("-v,--verbose", context_->verbose, "Say more, with times");
  added.flag("-q,--quiet", context_->quiet, "Say nothing but results and errors");
  command.add_option("--threads", context_->threads, "How many to use; 0: one per processor")
      ->check(CLI::Range(0U, 1024U));
  return added;
}

void Command::require_subcommand() const { app_->require_subcommand(1); }

void Command::flag(const std::string& name, bool& value, const std::string& help) const {
  app_->add_flag(name, value, help);
}

void Command::text(const std::string& name, std::string& value, const std::string& help,
                   Need need) const {
  mark(app_->add_option(name, value, help), need, !value.empty());
}

void Command::label(const std::string& name, std::string& value, const std::string& help) const {
  app_->add_option(name, value, help)->check([](const std::string& text) -> std::string {
    if (find_unprintable(text) == std::string::npos) return "";
    return "found \"" + printable_line(text) + "\", expected no control characters";
  });
}

void Command::texts(const std::string& name, std::vector<std::string>& values,
                    const std::string& help, Need need) const {
  mark(app_->add_option(name, values, help), need, false);
}

void Command::integer(const std::string& name, int& value, int min, int max,
                      const std::string& help) const {
  mark(app_->add_option(name, value, help)->check(CLI::Range(min, max)), Need::optional,
       value != 0);
}

void Command::integers(const std::string& name, std::vector<int>& values, int min, int max,
                       const std::string& help) const {
  mark(app_->add_option(name, values, help)->delimiter(',')->check(CLI::Range(min, max)),
       Need::optional, !values.empty());
}

void Command::number(const std::string& name, double& value, double min, double max,
                     const std::string& help, Need need) const {
  mark(app_->add_option(name, value, help)->check(is_number())->check(CLI::Range(min, max)), need,
       value != 0.0);
}

void Command::positive(const std::string& name, std::optional<double>& value, double max,
                       const std::string& help) const {
  mark(app_->add_option(name, value, help)
           ->check(is_number())
           ->check(CLI::Range(std::numeric_limits<double>::min(), max, "more than 0")),
       Need::optional, false);
}

void Command::numbers(const std::string& name, std::vector<double>& values,
                      const std::string& help) const {
  app_->add_option(name, values, help)->delimiter(',')->check(is_number());
}

namespace {

// CLI11 itself takes -1 for the largest number of all.
std::string whole_number(const std::string& text) {
  std::uint64_t parsed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), parsed);
  if (error == std::errc() && end == text.data() + text.size()) return "";
  return fmt::format("found {}, expected a whole number from 0 to {}", text,
                     std::numeric_limits<std::uint64_t>::max());
}

}  // namespace

void Command::seed(std::uint64_t& value, const std::string& help) const {
  mark(app_->add_option("--seed", value, help)->check(whole_number), Need::optional, true);
}

void Command::seed(std::optional<std::uint64_t>& value, const std::string& help) const {
  mark(app_->add_option("--seed", value, help)->check(whole_number), Need::optional, false);
}

void Command::port(const std::string& name, std::optional<std::uint16_t>& value,
                   std::uint16_t if_bare, const std::string& help) const {
  const auto parsed = [](const std::string& text) -> std::optional<std::uint16_t> {
    std::uint16_t port = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return port;
  };
  app_->add_option_function<std::string>(
          name, [&value, parsed](const std::string& text) { value = parsed(text); }, help)
      ->expected(0, 1)
      ->default_str(std::to_string(if_bare))
      ->option_text("[PORT]")
      ->check([parsed, name](const std::string& text) {
        // What was meant for the next argument ends up here as well.
        return parsed(text) ? std::string()
                            : fmt::format(
                                  "found {}, expected a port from 0 to 65535; without one "
                                  "{} goes last",
                                  text, name);
      });
}

void Command::choice(const std::string& name, std::string& value,
                     const std::vector<std::string>& words, const std::string& help,
                     Need need) const {
  mark(app_->add_option(name, value, help)->check(CLI::IsMember(words)), need, !value.empty());
}

std::vector<Command::Words> Command::all_words() const {
  std::vector<Words> all;
  collect_words(*app_, "", all);
  return all;
}

void Command::set_action(std::function<int()> action) const {
  app_->callback([context = context_, action = std::move(action)] { context->action = action; });
}

int run_command_line(int argc, char** argv) {
  Context context;
  CLI::App app{"Measures the BRDF of flat isotropic samples with few directions.", "gonio"};
  app.set_version_flag("--version", fmt::format("gonio {} ({})", version(), revision()));
  app.footer("Start with:\n  gonio demo");
  const Command root(app, context);
  root.require_subcommand();
  for (const auto add :
       {add_demo,      add_materials,   add_train,     add_plan,     add_rig,     add_board,
        add_calibrate, add_align,       add_measure,   add_resume,   add_devices, add_home,
        add_jog,       add_goto,        add_park,      add_shutter,  add_snap,    add_status,
        add_reduce,    add_reconstruct, add_sample,    add_evaluate, add_compare, add_convert,
        add_render,    add_report,      add_completion}) {
    add(root);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    const Called called =
        called_command(app, std::vector<std::string>(argv + std::min(1, argc), argv + argc));
    std::string name;  // with those above it: "rig check"
    for (const CLI::App* each = called.command; each != &app; each = each->get_parent()) {
      name = " " + each->get_name() + name;
    }
    context.console.error(usage_message(called, error),
                          fmt::format("gonio{} --help says more", name));
    return kBadInput;
  }
  context.console.verbosity = context.quiet ? -1 : (context.verbose ? 1 : 0);
  try {
    parallel::set_thread_count(context.threads);
    StopSignals signals;
    context.stop = signals.token();
    context.pause_on_interrupt = [&signals] { return signals.pause_on_interrupt(); };
    return context.action();
  } catch (const devices::DeviceError& error) {
    const Failure failure = describe(error);
    // What a stop request stopped says so; it is no failure of a device.
    if (context.stop.stop_requested() && error.code() == devices::DeviceErrc::Stopped) {
      context.console.error("interrupted");
      return kFailure;
    }
    context.console.error(failure.message, failure.hint);
    return failure.code;
  } catch (const std::exception& error) {
    const Failure failure = describe(error);
    context.console.error(failure.message, failure.hint);
    return failure.code;
  }
}

}  // namespace gonio::cli
