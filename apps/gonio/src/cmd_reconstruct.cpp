#include <fmt/format.h>

#include <optional>

#include "command.h"
#include "gonio/basis/basis_file.h"
#include "gonio/basis/dense_field.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/basis/siblings.h"
#include "gonio/basis/uncertainty_file.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/quality/homogeneity.h"
#include "gonio/quality/verdict.h"
#include "json_text.h"
#include "outputs.h"
#include "provenance.h"
#include "report_data.h"
#include "samples_input.h"
#include "verdict_json.h"

namespace gonio::cli {

namespace {

struct ReconstructOptions {
  std::string input;
  std::string basis;
  std::string out;
  std::string method = "auto";
  std::string eta = "auto";
  bool no_bands = false;
  bool json = false;
  bool force = false;
};

int reconstruct(Context& context, const ReconstructOptions& options) {
  const basis::ReconstructOptions how = reconstruct_options(options.method, options.eta);
  const std::filesystem::path bands_path = basis::uncertainty_path(options.out);
  require_output(options.out, options.force, {options.input, options.basis});
  // Also without bands: those of another result must not stay beside this one.
  require_output(bands_path.string(), options.force, {options.input, options.basis});
  if (std::filesystem::path(options.out).extension() != ".binary") {
    throw UsageError("--out: found " + options.out + ", expected a name that ends in .binary",
                     "gonio convert writes it in other formats");
  }
  const samples::SampleSet samples = samples_input(context.console, options.input);
  const basis::Basis basis = [&] {
    const PhaseTimer timer(context.console, "reading the basis");
    return basis::read_basis(options.basis);
  }();
  require_scale_of(basis, options.basis, samples.scale, options.input);
  const basis::Fit fit = [&] {
    const PhaseTimer timer(context.console, "fitting");
    return blame(options.input, [&] { return basis::fit(basis, samples, how); });
  }();
  const brdf::BrdfTable table = basis::expand(basis, fit.coefficients);
  const quality::HomogeneityCheck even = quality::check_homogeneity(samples, fit.fitted_per_sr);
  if (!even.passed) context.console.warn("uneven sample: " + to_text(even));
  const bool has_bands = fit.left_out_residuals.size() > 0 &&
                         basis::count_groups(basis.materials) >= basis::kFewestGroupsForBands;
  std::optional<basis::Uncertainty> bands;
  if (has_bands && !options.no_bands) {
    const PhaseTimer timer(context.console, "uncertainty bands");
    bands = basis::uncertainty(basis, fit);
  }
  const quality::Verdict verdict = [&] {
    const PhaseTimer timer(context.console, "verdict");
    return quality::judge(basis, samples, fit, table, bands ? &*bands : nullptr);
  }();
  context.check_stop();
  nlohmann::ordered_json record = provenance("reconstruct");
  record["samples"] = samples.samples.size();
  if (std::filesystem::is_regular_file(options.input)) {
    record["input"] = input_record(options.input);
  } else {
    record["input"] = {
        {"name", std::filesystem::path(options.input).lexically_normal().filename().string()}};
  }
  record["basis"] = basis_record(basis);
  record["method"] = options.method;
  record["eta"] = options.eta;
  record["kernel_share"] = fit.kernel_share;
  if (even.applicable) {
    record["unevenness_rms"] = even.rms;
    record["unevenness_p"] = even.p_value;
  }
  record["chi2_per_sample"] = fit.chi2_per_sample;
  record["innovation_chi2_per_sample"] = fit.innovation_chi2_per_sample;
  record["verdict"] = verdict_json(verdict);
  // The bands first: they say what result they belong to, a result does not say that it has bands.
  if (bands) {
    const PhaseTimer timer(context.console, "writing the bands");
    basis::write_uncertainty(bands_path, basis, fit, *bands, brdf::merl_sha256(table),
                             overwrite(options.force));
  }
  try {
    brdf::write_merl(options.out, table, overwrite(options.force), json_line(record));
  } catch (...) {
    std::error_code ignored;
    if (bands) std::filesystem::remove(bands_path, ignored);
    throw;
  }
  if (!bands && options.force) std::filesystem::remove(bands_path);
  context.console.say(fmt::format(
      "{}: {} samples; their chi2 against the prior is {:.2g} per value, about 1 for a material "
      "like those trained on",
      options.out, samples.samples.size(), fit.innovation_chi2_per_sample));
  context.console.result(options.json ? json_text(verdict_json(verdict)) : verdict.line + "\n");
  return verdict.trusted.value_or(true) ? kSuccess : kDoNotTrust;
}

}  // namespace

void add_reconstruct(const Command& root) {
  auto options = std::make_shared<ReconstructOptions>();
  const Command command = root.add(
      "reconstruct",
      "Fit a BRDF to samples; writes X.binary, X.json and X.uncertainty.h5, ends with a verdict",
      "gonio reconstruct session --basis basis.h5 --out found.binary");
  command.text("SESSION_OR_SAMPLES", options->input, "Session archive or samples.csv",
               Need::required);
  command.text("--basis", options->basis, "Basis file", Need::required);
  command.text("--out", options->out, "MERL file to write (X.binary)", Need::required);
  command.choice("--method", options->method, {"auto", "ridge", "kernel", "nielsen"},
                 "How to fit; auto weighs ridge and kernels by evidence, nielsen is as published");
  command.text("--eta", options->eta,
               "Ridge parameter: auto (from the samples' noise) or a number");
  command.flag("--no-bands", options->no_bands,
               "Do not write X.uncertainty.h5 (70 MB); ridge and nielsen never do");
  command.flag("--json", options->json, "Print the verdict as JSON");
  command.force(options->force);
  command.on_call(options, reconstruct);
}

}  // namespace gonio::cli
