#include "command.h"
#include "gonio/render/comparison_sheet.h"
#include "gonio/render/png.h"
#include "materials_input.h"
#include "outputs.h"

namespace gonio::cli {
namespace {

struct Options {
  std::string material;
  std::string reference;
  std::string out;
  int size = 320;
  bool force = false;
};

int render_sheet(Context& context, const Options& options) {
  require_output(options.out, options.force, {options.material, options.reference});
  const NamedMaterial named = named_material(options.material);
  const SampleMaterial material = load_sample(named);
  render::SheetOptions sheet;
  sheet.sphere_size = options.size;
  sheet.result_name = named.name;
  const render::Image image = [&] {
    const PhaseTimer timer(context.console, "rendering");
    if (options.reference.empty()) {
      return render::sphere_sheet(*material.model, material.scale, sheet);
    }
    const NamedMaterial named_reference = named_material(options.reference);
    const SampleMaterial reference = load_sample(named_reference);
    if (reference.scale != material.scale) {
      throw UsageError(options.reference + ": radiometric scale: found " +
                       std::string(brdf::to_string(reference.scale)) + ", expected " +
                       std::string(brdf::to_string(material.scale)) + " as in " + options.material);
    }
    sheet.reference_name = named_reference.name;
    return render::comparison_sheet(*reference.model, *material.model, material.scale, sheet);
  }();
  render::write_png(options.out, image, overwrite(options.force));
  context.console.say(options.out);
  return kSuccess;
}

}  // namespace

void add_render(const Command& root) {
  auto options = std::make_shared<Options>();
  const Command command =
      root.add("render", "Pictures of spheres, alone or beside a reference",
               "gonio render found.binary --reference truth.binary --out spheres.png");
  command.text("MATERIAL", options->material, "Material file or builtin:NAME", Need::required);
  command.text("--out", options->out, "PNG file to write", Need::required);
  command.text("--reference", options->reference,
               "Show this beside it, and the difference in false colour");
  command.integer("--size", options->size, 64, 1024, "Diameter of a sphere in pixels");
  command.force(options->force);
  command.on_call(options, render_sheet);
}

}  // namespace gonio::cli
