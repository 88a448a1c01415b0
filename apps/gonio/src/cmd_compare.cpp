#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "command.h"
#include "gonio/quality/metrics.h"
#include "json_text.h"
#include "materials_input.h"

namespace gonio::cli {

namespace {

struct CompareOptions {
  std::string truth;
  std::string found;
  ScaleWish scale;
  bool json = false;
};

/// Flat keys with units (docs/formats.md); a figure that is infinite or not known becomes null.
nlohmann::ordered_json to_json(const quality::Comparison& comparison) {
  const quality::LatticeError& lattice = comparison.lattice;
  return {{"psnr_a_db", comparison.lighting_a.psnr_db},
          {"psnr_b_db", comparison.lighting_b.psnr_db},
          {"mean_delta_e_a", comparison.lighting_a.mean_delta_e},
          {"mean_delta_e_b", comparison.lighting_b.mean_delta_e},
          {"weighted_log_rmse", lattice.weighted_log_rmse},
          {"weighted_log_bias", lattice.weighted_log_bias},
          {"grazing_log_rmse", lattice.grazing_log_rmse},
          {"grazing_log_bias", lattice.grazing_log_bias},
          {"raw_rmse_per_sr", lattice.raw_rmse_per_sr},
          {"cells", lattice.cells},
          {"only_in_first", lattice.only_in_truth},
          {"only_in_second", lattice.only_in_found}};
}

int compare(Context& context, const CompareOptions& options) {
  const auto load = [&](const std::string& word) {
    NamedMaterial material = named_material(word);
    report_conventions(context.console, material, Report::warnings);
    if (!options.scale.scale.empty()) {
      material.scale = brdf::radiometric_scale_from_string(options.scale.scale);
      material.merl_to_si = options.scale.merl_to_si;
    }
    return load_table(material);
  };
  const brdf::BrdfTable truth = load(options.truth);
  const brdf::BrdfTable found = load(options.found);
  const quality::Comparison comparison =
      blame(options.found, [&] { return quality::compare(truth, found); });
  context.check_stop();
  if (options.json) {
    context.console.result(json_text(to_json(comparison)));
    return kSuccess;
  }
  const quality::LatticeError& lattice = comparison.lattice;
  std::string text;
  text += fmt::format("weighted log RMSE     {:8.4f} (bias {:+.4f})\n", lattice.weighted_log_rmse,
                      lattice.weighted_log_bias);
  text += fmt::format("grazing log RMSE      {:8.4f} (bias {:+.4f})\n", lattice.grazing_log_rmse,
                      lattice.grazing_log_bias);
  text += fmt::format("raw RMSE              {:8.4f} 1/sr\n", lattice.raw_rmse_per_sr);
  text += fmt::format("PSNR, lighting A      {:8.2f} dB (mean dE00 {:.2f})\n",
                      comparison.lighting_a.psnr_db, comparison.lighting_a.mean_delta_e);
  text += fmt::format("PSNR, lighting B      {:8.2f} dB (mean dE00 {:.2f})\n",
                      comparison.lighting_b.psnr_db, comparison.lighting_b.mean_delta_e);
  text += fmt::format("cells compared        {:8}\n", lattice.cells);
  if (lattice.only_in_truth + lattice.only_in_found > 0) {
    text += fmt::format("  {} are valid in {} alone, {} in {} alone\n", lattice.only_in_truth,
                        options.truth, lattice.only_in_found, options.found);
  }
  context.console.result(text);
  return kSuccess;
}

}  // namespace

void add_compare(const Command& root) {
  auto options = std::make_shared<CompareOptions>();
  const Command command =
      root.add("compare", "Errors of a BRDF against a reference: lattice and pictures",
               "gonio compare truth.binary found.binary --json");
  command.text("A", options->truth, "Reference: a material file or builtin:NAME", Need::required);
  command.text("B", options->found, "What is compared with it", Need::required);
  add_scale_options(command, options->scale);
  command.flag("--json", options->json, "Print JSON");
  command.on_call(options, compare);
}

}  // namespace gonio::cli
