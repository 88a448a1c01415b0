#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/console/console.h"
#include "gonio/console/failures.h"
#include "gonio/files/atomic_file.h"

namespace CLI {
class App;
}

namespace gonio::cli {

/// What every subcommand shares.
struct Context {
  Console console;
  bool quiet = false;
  bool verbose = false;
  unsigned threads = 0;         ///< 0: one per processor
  std::function<int()> action;  ///< what the command line asked for; set by parsing
  /// Requested by SIGINT or SIGTERM. Commands look at it between their steps, so that they unwind
  /// and nothing half-written stays behind, not even under a hidden name.
  std::stop_token stop;
  /// From its call on, the first SIGINT asks for what it returns, a pause, and the second for a
  /// stop.
  std::function<std::stop_token()> pause_on_interrupt;

  /// Throws Interrupted when a stop was asked for.
  void check_stop() const {
    if (stop.stop_requested()) throw Interrupted();
  }
};

enum class Need { optional, required };

/// One (sub)command of the command line being described. A thin front of CLI11, whose templates
/// then are compiled in one place only (command_line.cpp). Names without dashes are positional.
/// The variables must live as long as the command; their values are the defaults shown.
class Command {
 public:
  Command(CLI::App& app, Context& context) : app_(&app), context_(&context) {}

  /// A subcommand with the options all of them have (-v -q --threads) and an example under its
  /// help.
  Command add(const std::string& name, const std::string& description,
              const std::string& example) const;
  /// One of its subcommands must be given.
  void require_subcommand() const;

  void flag(const std::string& name, bool& value, const std::string& help) const;
  void text(const std::string& name, std::string& value, const std::string& help,
            Need need = Need::optional) const;
  /// Text that is stored and shown later: control characters are refused.
  void label(const std::string& name, std::string& value, const std::string& help) const;
  void texts(const std::string& name, std::vector<std::string>& values, const std::string& help,
             Need need = Need::optional) const;
  void integer(const std::string& name, int& value, int min, int max,
               const std::string& help) const;
  /// Empty unless it was given; `if_bare` when without a value.
  void port(const std::string& name, std::optional<std::uint16_t>& value, std::uint16_t if_bare,
            const std::string& help) const;
  /// One or several, separated by commas.
  void integers(const std::string& name, std::vector<int>& values, int min, int max,
                const std::string& help) const;
  void number(const std::string& name, double& value, double min, double max,
              const std::string& help, Need need = Need::optional) const;
  /// Empty unless it was given; more than zero.
  void positive(const std::string& name, std::optional<double>& value, double max,
                const std::string& help) const;
  /// One or several, separated by commas.
  void numbers(const std::string& name, std::vector<double>& values, const std::string& help) const;
  void seed(std::uint64_t& value, const std::string& help) const;
  /// Empty unless it was given.
  void seed(std::optional<std::uint64_t>& value, const std::string& help) const;
  void choice(const std::string& name, std::string& value, const std::vector<std::string>& words,
              const std::string& help, Need need = Need::optional) const;
  /// --force
  void force(bool& value) const { flag("--force", value, "Replace an output that exists"); }

  /// Makes `run(context, options)` the action when this command is called.
  template <class Options, class Run>
  void on_call(std::shared_ptr<Options> options, Run run) const {
    set_action([context = context_, options, run] { return run(*context, *options); });
  }

  /// Every command below and including this one with what may follow it, for completion.
  struct Words {
    std::string path;  ///< "", "rig", "rig check", ...
    std::vector<std::string> words;
  };
  std::vector<Words> all_words() const;

 private:
  void set_action(std::function<int()> action) const;

  CLI::App* app_;
  Context* context_;
};

inline files::Overwrite overwrite(bool force) {
  return force ? files::Overwrite::Yes : files::Overwrite::No;
}

/// Parses the command line and runs what it asks for; returns the exit code.
int run_command_line(int argc, char** argv);

// One file per subcommand.
void add_demo(const Command& root);
void add_materials(const Command& root);
void add_train(const Command& root);
void add_plan(const Command& root);
void add_rig(const Command& root);
void add_board(const Command& root);
void add_calibrate(const Command& root);
void add_align(const Command& root);
void add_measure(const Command& root);
void add_resume(const Command& root);
void add_devices(const Command& root);
void add_home(const Command& root);
void add_jog(const Command& root);
void add_goto(const Command& root);
void add_park(const Command& root);
void add_shutter(const Command& root);
void add_snap(const Command& root);
void add_status(const Command& root);
void add_reduce(const Command& root);
void add_reconstruct(const Command& root);
void add_sample(const Command& root);
void add_evaluate(const Command& root);
void add_compare(const Command& root);
void add_convert(const Command& root);
void add_render(const Command& root);
void add_report(const Command& root);
void add_completion(const Command& root);

}  // namespace gonio::cli
