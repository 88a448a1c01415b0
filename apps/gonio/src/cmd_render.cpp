#include <fmt/format.h>

#include "command.h"
#include "gonio/render/comparison_sheet.h"
#include "gonio/render/png.h"
#include "materials_input.h"
#include "outputs.h"
#include "rgl_output.h"
#include "scene_files.h"

namespace gonio::cli {
namespace {

struct RenderOptions {
  std::string material;
  std::string reference;
  std::string out;
  std::string scene;
  ScaleWish scale;
  int size = 320;
  bool force = false;
};

/// The scene and the material it names, beside each other.
int write_scene(Context& context, const RenderOptions& options) {
  if (!options.reference.empty()) {
    throw UsageError("--scene shows one material: found --reference as well");
  }
  const std::filesystem::path scene(options.out);
  std::filesystem::path material = scene;
  material.replace_extension(".bsdf");
  if (material == scene) throw UsageError(options.out + ": expected a scene's name, not .bsdf");
  require_output(options.out, options.force, {options.material});
  require_output(material.string(), options.force, {options.material});
  std::filesystem::path image = scene.filename();
  image.replace_extension(".exr");
  const std::string text = options.scene == "mitsuba"
                               ? mitsuba_scene(material.filename().string())
                               : pbrt_scene(material.filename().string(), image.string());
  NamedMaterial named = named_material(options.material);
  report_conventions(context.console, named, Report::warnings);
  if (!options.scale.scale.empty()) {
    named.scale = brdf::radiometric_scale_from_string(options.scale.scale);
    named.merl_to_si = options.scale.merl_to_si;
  }
  const quality::LatticeError error = write_rgl_of(load_table(named), options.material,
                                                   material.string(), overwrite(options.force));
  files::write_text_file(scene, text, overwrite(options.force));
  context.console.say(fmt::format("{} and {}: the material differs by {:.4f} (weighted log RMSE)",
                                  scene.string(), material.string(), error.weighted_log_rmse));
  return kSuccess;
}

int render_sheet(Context& context, const RenderOptions& options) {
  if (!options.scene.empty()) return write_scene(context, options);
  require_output(options.out, options.force, {options.material, options.reference});
  const NamedMaterial named = named_material(options.material);
  report_conventions(context.console, named, Report::warnings);
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
  context.check_stop();
  render::write_png(options.out, image, overwrite(options.force));
  context.console.say(options.out);
  return kSuccess;
}

}  // namespace

void add_render(const Command& root) {
  auto options = std::make_shared<RenderOptions>();
  const Command command =
      root.add("render", "Pictures of spheres, alone or beside a reference",
               "gonio render found.binary --reference truth.binary --out spheres.png");
  command.text("MATERIAL", options->material, "Material file or builtin:NAME", Need::required);
  command.text("--out", options->out, "PNG file to write, or the scene", Need::required);
  command.text("--reference", options->reference,
               "Show this beside it, and the difference in false colour");
  command.choice("--scene", options->scene, {"mitsuba", "pbrt"},
                 "Write a ready scene for this renderer, with a .bsdf of the same name beside it");
  add_scale_options(command, options->scale);
  command.integer("--size", options->size, 64, 1024, "Diameter of a sphere in pixels");
  command.force(options->force);
  command.on_call(options, render_sheet);
}

}  // namespace gonio::cli
