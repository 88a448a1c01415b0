#include <fmt/format.h>

#include "command.h"
#include "gonio/basis/basis_file.h"
#include "gonio/basis/dense_field.h"
#include "materials_input.h"
#include "outputs.h"
#include "report_data.h"
#include "samples_input.h"

namespace gonio::cli {
namespace {

struct ReportOptions {
  std::string session;
  std::string basis;
  std::string brdf;
  std::string reference;
  std::string out;
  bool force = false;
};

int make_report(Context& context, const ReportOptions& options) {
  if (options.basis.empty() == options.brdf.empty()) {
    throw UsageError("give either --basis to reconstruct the session, or --brdf with its result");
  }
  require_output(options.out, options.force, {options.basis, options.brdf, options.reference});
  const StoredSession session = open_session(options.session);
  const acquisition::Reduction reduction = reduce_session(session, session.rig.reduction);
  report::ReportData data = session_report(session);
  for (const std::string& warning : reduction.warnings) data.warnings.push_back(warning);
  for (const acquisition::PartBridge& bridge : reduction.bridges) {
    data.session.push_back({"Interruption", to_text(bridge)});
  }

  report::MethodResult method{"This measurement", "", nullptr, std::nullopt};
  std::optional<basis::Fit> fit;
  if (!options.brdf.empty()) {
    method.table = std::make_shared<brdf::BrdfTable>(load_table(named_material(options.brdf)));
    if (method.table->scale() != reduction.samples.scale) {
      throw UsageError(fmt::format("{}: found radiometric scale {}, the session's values are {}",
                                   options.brdf, brdf::to_string(method.table->scale()),
                                   brdf::to_string(reduction.samples.scale)));
    }
    data.samples = fitted_samples(reduction.samples, *method.table);
  } else {
    const basis::Basis basis = basis::read_basis(options.basis);
    require_scale_of(basis, options.basis, reduction.samples.scale, options.session);
    fit = blame(options.session, [&] { return basis::fit(basis, reduction.samples); });
    method.table = std::make_shared<brdf::BrdfTable>(basis::expand(basis, fit->coefficients));
    data.samples = fitted_samples(reduction.samples, *fit);
    add_trust(basis, reduction.samples, *fit, method, data);
  }
  data.checks = self_checks(*method.table, fit ? &*fit : nullptr);
  if (fit) data.checks.push_back(evenness(reduction.samples, *fit));
  for (report::CheckResult& row : session_checks(session.archive, reduction)) {
    data.checks.push_back(std::move(row));
  }
  if (!options.reference.empty()) {
    data.truth = std::make_shared<brdf::BrdfTable>(load_table(named_material(options.reference)));
    method.comparison =
        blame(options.reference, [&] { return quality::compare(*data.truth, *method.table); });
  }
  data.methods.push_back(std::move(method));
  data.summary =
      fmt::format("{} directions, {} values each; {} in all.", data.poses.size(),
                  session.rig.reduction.grid * session.rig.reduction.grid, duration_text([&] {
                    double total = 0.0;
                    for (const auto& entry : data.timing) total += entry.seconds;
                    return total;
                  }()));
  context.check_stop();
  report::write_report(options.out, data, overwrite(options.force));
  context.console.say(options.out);
  return kSuccess;
}

}  // namespace

void add_report(const Command& root) {
  auto options = std::make_shared<ReportOptions>();
  const Command command = root.add("report", "A session as one self-contained page",
                                   "gonio report session --basis basis.h5 --out report.html");
  command.text("SESSION", options->session, "Session archive", Need::required);
  command.text("--basis", options->basis, "Reconstruct with this basis");
  command.text("--brdf", options->brdf, "Show this reconstruction instead");
  command.text("--reference", options->reference,
               "The true BRDF where it is known: material file or builtin:NAME");
  command.text("--out", options->out, "HTML file to write", Need::required);
  command.force(options->force);
  command.on_call(options, make_report);
}

}  // namespace gonio::cli
