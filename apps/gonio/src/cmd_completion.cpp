#include <fmt/format.h>

#include "command.h"

namespace gonio::cli {
namespace {

struct CompletionOptions {
  std::string shell;
  std::vector<Command::Words> commands;
};

int print_completion(Context& context, const CompletionOptions& options) {
  std::string cases;
  for (const Command::Words& command : options.commands) {
    cases +=
        fmt::format("    \"{}\") words=\"{}\" ;;\n", command.path, fmt::join(command.words, " "));
  }
  context.console.result(fmt::format(R"(# bash completion for gonio: source <(gonio completion bash)
_gonio() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" path="" words="" word
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$word" in
      -*) ;;
      *) _gonio_words "${{path:+$path }}$word" && path="${{path:+$path }}$word" ;;
    esac
  done
  _gonio_words "$path"
  COMPREPLY=($(compgen -W "$words" -- "$current"))
  if [[ "$current" != -* ]]; then COMPREPLY+=($(compgen -f -- "$current")); fi
}}
_gonio_words() {{
  words=""
  case "$1" in
{}    *) return 1 ;;
  esac
}}
complete -o filenames -F _gonio gonio
)",
                                     cases));
  return kSuccess;
}

}  // namespace

void add_completion(const Command& root) {
  auto options = std::make_shared<CompletionOptions>();
  const Command command =
      root.add("completion", "Print completions for a shell", "source <(gonio completion bash)");
  command.choice("SHELL", options->shell, {"bash"}, "bash", Need::required);
  options->commands = root.all_words();  // added last, so complete
  command.on_call(options, print_completion);
}

}  // namespace gonio::cli
