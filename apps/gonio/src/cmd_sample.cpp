#include <fmt/format.h>

#include "command.h"
#include "directions_input.h"
#include "gonio/quality/synthetic_samples.h"
#include "materials_input.h"
#include "near_field_plan.h"
#include "noise_options.h"
#include "outputs.h"
#include "patch_geometry.h"

namespace gonio::cli {

namespace {

struct SampleOptions {
  std::string material;
  std::string directions;
  std::string out;
  std::string rig;
  bool near_field = false;
  NearFieldWords camera;
  NoiseWords noise;
  std::uint64_t seed = 1;
  bool force = false;
};

int sample(Context& context, const SampleOptions& options) {
  if (!options.near_field) refuse_near_field_options(options.camera, "--near-field");
  if (options.near_field && !options.rig.empty()) {
    throw UsageError("--rig does nothing with --near-field: give one of them");
  }
  require_output(options.out, options.force, {options.material, options.directions, options.rig});
  std::vector<brdf::HalfDiff> directions;
  for (const samples::Direction& each :
       directions_input(options.directions, samples::BelowHorizon::Refuse)) {
    directions.push_back(each.angles);
  }
  const quality::PatchGeometry patch =
      options.rig.empty() ? quality::PatchGeometry{} : patch_of(known_rig(options.rig));
  const NamedMaterial named = named_material(options.material);
  report_conventions(context.console, named, Report::warnings);
  const SampleMaterial material = load_sample(named);
  const quality::SyntheticNoise noise = synthetic_noise(options.noise);
  if (options.near_field && options.noise.tilt_deg > 0.0) {
    throw UsageError("--angle-error is not simulated for near-field photographs");
  }
  const samples::SampleSet set = blame(options.directions, [&] {
    if (options.near_field) {
      return quality::near_field_samples(*material.model, material.scale, directions,
                                         near_field_setup(options.camera), noise, options.seed);
    }
    return quality::synthetic_samples(*material.model, material.scale, directions, patch, noise,
                                      options.seed);
  });
  context.check_stop();
  samples::write_samples(options.out, set, overwrite(options.force));
  context.console.say(fmt::format("{}: {} samples", options.out, set.samples.size()));
  return kSuccess;
}

}  // namespace

void add_sample(const Command& root) {
  auto options = std::make_shared<SampleOptions>();
  const Command command =
      root.add("sample", "Evaluate a material at directions: a measurement without an instrument",
               "gonio sample truth.binary --directions plan.csv --noise 0.01 --out samples.csv");
  command.text("MATERIAL", options->material, "Material file or builtin:NAME", Need::required);
  command.text("--directions", options->directions, "CSV file or a published set", Need::required);
  command.text("--out", options->out, "Samples to write (CSV)", Need::required);
  add_noise_options(command, options->noise);
  command.text("--rig", options->rig, "Sub-samples per pose, as this rig would see them");
  command.flag("--near-field", options->near_field,
               "The directions are centres of photographs taken from near");
  add_near_field_options(command, options->camera);
  command.seed(options->seed, "Of the noise");
  command.force(options->force);
  command.on_call(options, sample);
}

}  // namespace gonio::cli
