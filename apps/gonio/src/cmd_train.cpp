#include <fmt/format.h>

#include "command.h"
#include "gonio/basis/basis_file.h"
#include "materials_input.h"

namespace gonio::cli {
namespace {

struct Options {
  std::vector<std::string> inputs;
  std::string out;
  int components = basis::kDefaultComponents;
  std::vector<std::string> excluded;
  bool force = false;
};

int train(Context& context, const Options& options) {
  files::require_creatable(options.out, overwrite(options.force));
  const TrainingInput input = training_input(options.inputs, options.excluded);
  if (input.size() < 2) {
    throw UsageError(fmt::format("found {} material{} to train on, expected at least 2",
                                 input.size(), input.size() == 1 ? "" : "s"));
  }
  const auto set = [&] {
    const PhaseTimer timer(context.console, "reading materials");
    return load_training_set(input);
  }();
  context.check_stop();
  const basis::Basis basis = [&] {
    const PhaseTimer timer(context.console, "training");
    return basis::train(set, basis::centred_gram(set), options.components);
  }();
  context.check_stop();
  {
    const PhaseTimer timer(context.console, "writing the basis");
    basis::write_basis(options.out, basis, overwrite(options.force));
  }
  context.console.say(fmt::format("{}: {} components of {} materials, scale {}", options.out,
                                  basis.component_count(), basis.materials.size(),
                                  brdf::to_string(basis.scale)));
  if (basis.component_count() < options.components) {
    context.console.say(fmt::format("  {} were asked for; {} materials have no more",
                                    options.components, basis.materials.size()));
  }
  return kSuccess;
}

}  // namespace

void add_train(const Command& root) {
  auto options = std::make_shared<Options>();
  const Command command =
      root.add("train", "Learn a basis from materials",
               "gonio train BRDFDatabase/brdfs --out basis.h5 --exclude teflon");
  command.texts("FILES_OR_DIRS", options->inputs,
                "MERL files, folders of them, \"builtin\" or \"builtin:NAME\"", Need::required);
  command.text("--out", options->out, "Basis file to write (HDF5)", Need::required);
  command.integer("--components", options->components, 1, 10000, "Number of components");
  command.texts("--exclude", options->excluded,
                "Leave out materials by name, or \"family:NAME\" of built-in ones");
  command.force(options->force);
  command.on_call(options, train);
}

}  // namespace gonio::cli
