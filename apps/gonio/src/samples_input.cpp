#include "samples_input.h"

#include <fmt/format.h>

#include <charconv>

#include "gonio/console/failures.h"
#include "session_run.h"

namespace gonio::cli {

samples::SampleSet samples_input(const Console& console, const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) {
    samples::SampleSet set = samples::read_samples(path);
    for (const std::string& warning : set.warnings) console.warn(warning);
    return set;
  }
  const StoredSession session = open_session(path);
  acquisition::Reduction reduction = reduce_session(session, session.rig.reduction);
  for (const std::string& warning : reduction.warnings) console.warn(warning);
  return std::move(reduction.samples);
}

void require_scale_of(const basis::Basis& basis, const std::string& basis_name,
                      brdf::RadiometricScale scale, const std::string& samples_name) {
  if (scale == basis.scale) return;
  const std::string hint =
      scale == brdf::RadiometricScale::si
          ? "samples in SI units need a basis in SI units: gonio train builtin --out si.h5"
          : "samples in the scale of the MERL files need a basis trained on such files";
  throw UsageError(
      fmt::format("{}: radiometric scale: found {}, expected {} as in {}", samples_name,
                  brdf::to_string(scale), brdf::to_string(basis.scale), basis_name),
      hint);
}

basis::ReconstructOptions reconstruct_options(const std::string& method, const std::string& eta) {
  basis::ReconstructOptions options;
  options.method = basis::method_from_string(method);
  if (eta == "auto") return options;
  double value = 0.0;
  const auto [end, error] = std::from_chars(eta.data(), eta.data() + eta.size(), value);
  if (error != std::errc() || end != eta.data() + eta.size() || !(value > 0.0) || !(value < 1e12)) {
    throw UsageError(fmt::format("--eta: found {:?}, expected auto or a number above 0", eta));
  }
  options.eta = value;
  return options;
}

}  // namespace gonio::cli
