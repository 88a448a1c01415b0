#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "command.h"
#include "gonio/basis/basis_file.h"
#include "materials_input.h"
#include "outputs.h"
#include "provenance.h"
#include "siblings_input.h"

namespace gonio::cli {
namespace {

struct TrainOptions {
  std::vector<std::string> inputs;
  std::string out;
  std::string append;
  int components = 0;  ///< 0: kDefaultComponents, or as many as the basis appended to has
  std::vector<std::string> excluded;
  ScaleWish scale;
  std::string source;
  std::string siblings;
  bool force = false;
};

/// A word that is safe to print and to compare.
void require_label(const std::string& label) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
  };
  if (label.size() > 64 || !std::all_of(label.begin(), label.end(), fits)) {
    throw UsageError(
        "--source: found something else than at most 64 lower-case letters, digits, "
        "'-', '_' and '.'");
  }
}

/// "90 merl, 8 rgl"
std::string sources_text(const basis::Basis& basis) {
  std::string text;
  for (const auto& [source, count] : source_counts(basis)) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, source);
  }
  return text;
}

/// Before the long work: what append() would refuse at its end.
void require_appendable(const basis::Basis& old, const TrainingInput& input,
                        const std::string& file) {
  for (std::size_t i = 0; i < input.size(); ++i) {
    for (const basis::MaterialId& id : old.materials) {
      if (id.name == input.name(i)) {
        throw UsageError(fmt::format("material \"{}\" is already in {}", id.name, file));
      }
    }
  }
}

int train(Context& context, const TrainOptions& options) {
  require_output(options.out, options.force, {options.append});
  require_label(options.source);
  TrainingInput input = training_input(options.inputs, options.excluded, options.scale);
  for (basis::MaterialFile& file : input.files) {
    file.source = options.source;
    require_output(options.out, options.force, {file.path.string()});
  }
  const std::size_t fewest = options.append.empty() ? 2 : 1;
  if (input.size() < fewest) {
    throw UsageError(fmt::format("found {} material{} to train on, expected at least {}",
                                 input.size(), input.size() == 1 ? "" : "s", fewest));
  }
  std::optional<basis::Basis> old;
  if (!options.append.empty()) {
    const PhaseTimer timer(context.console, "reading the basis");
    old = basis::read_basis(options.append);
    require_appendable(*old, input, options.append);
  }
  if (!options.siblings.empty()) {
    read_siblings(context.console, options.siblings, input, old ? &old->materials : nullptr);
  }
  if (old && old->scale != input.scale) {
    throw UsageError(
        fmt::format("materials in scale {}, {} is in scale {}", brdf::to_string(input.scale),
                    options.append, brdf::to_string(old->scale)),
        fmt::format("--scale {} brings them there", brdf::to_string(old->scale)));
  }
  for (std::size_t i = 0; i < input.size(); ++i) {
    report_conventions(context.console, input.material(i), Report::warnings);
  }
  const auto set = [&] {
    const PhaseTimer timer(context.console, "reading materials");
    Progress progress(context.console, "reading materials");
    return load_training_set(input, [&](double fraction) {
      context.check_stop();
      progress.update(fraction);
    });
  }();
  context.check_stop();
  const int wanted = options.components > 0 ? options.components
                     : old                  ? old->component_count()
                                            : basis::kDefaultComponents;
  const basis::Basis basis = [&] {
    const PhaseTimer timer(context.console, "training");
    return old ? basis::append(*old, set, wanted)
               : basis::train(set, basis::centred_gram(set), wanted);
  }();
  context.check_stop();
  {
    const PhaseTimer timer(context.console, "writing the basis");
    basis::write_basis(options.out, basis, overwrite(options.force));
  }
  context.console.say(fmt::format("{}: {} components of {} materials ({}), scale {}", options.out,
                                  basis.component_count(), basis.materials.size(),
                                  sources_text(basis), brdf::to_string(basis.scale)));
  if (basis.component_count() < wanted) {
    context.console.say(
        fmt::format("  {} were asked for; {}", wanted,
                    old ? fmt::format("beyond, {} had left out too much", options.append)
                        : fmt::format("{} materials have no more", basis.materials.size())));
  }
  if (old && old->component_count() < old->row_count() - 1) {
    const double kept = old->singular_values.head(old->component_count()).squaredNorm() /
                        old->singular_values.squaredNorm();
    context.console.say(fmt::format(
        "  the {} old materials enter as the {} components of {} have them, {:.3f} % of their "
        "variance",
        old->materials.size(), old->component_count(), options.append, 100.0 * kept));
  }
  return kSuccess;
}

}  // namespace

void add_train(const Command& root) {
  auto options = std::make_shared<TrainOptions>();
  const Command command =
      root.add("train", "Learn a basis from materials",
               "gonio train BRDFDatabase/brdfs --out basis.h5 --exclude teflon");
  command.texts(
      "FILES_OR_DIRS", options->inputs,
      "Material files (.binary, .bsdf, .brdf), folders of them, \"builtin\" or \"builtin:NAME\"",
      Need::required);
  command.text("--out", options->out, "Basis file to write (HDF5)", Need::required);
  command.text("--append", options->append,
               "Add the materials to this basis instead, without the files it was trained on");
  command.integer("--components", options->components, 1, 10000,
                  fmt::format("Number of components (default {}; with --append as before)",
                              basis::kDefaultComponents));
  command.texts("--exclude", options->excluded,
                "Leave out materials by name, or \"family:NAME\" of built-in ones");
  add_scale_options(command, options->scale);
  command.text("--source", options->source,
               "Database the files come from, kept with the basis (default: their format's name)");
  add_siblings_option(command, options->siblings);
  command.force(options->force);
  command.on_call(options, train);
}

}  // namespace gonio::cli
