#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gonio/brdf/brdf_table.h"
#include "gonio/files/atomic_file.h"
#include "gonio/quality/metrics.h"
#include "gonio/samples/samples.h"

/// One measurement as a page to hand to a customer: a single HTML file without scripts and without
/// anything loaded from elsewhere, for light and dark screens, phones and paper.
namespace gonio::report {

/// A way from samples to a BRDF, with what came out of it.
struct MethodResult {
  std::string name;  ///< "This measurement", "Published method, same samples", ...
  std::string note;  ///< what is different about it, a few words; may be empty
  std::shared_ptr<const brdf::BrdfTable> table;   ///< null: figures only
  std::optional<quality::Comparison> comparison;  ///< against the truth, where it is known
  /// Limits between which the true value lies in 95 of 100 cells; null: none are drawn. Of the
  /// table's convention and scale.
  std::shared_ptr<const brdf::BrdfTable> lower_95 = nullptr;
  std::shared_ptr<const brdf::BrdfTable> upper_95 = nullptr;
};

/// A sample beside what the fit says there.
struct FittedSample {
  samples::Sample sample;
  brdf::Rgb fitted_per_sr = brdf::Rgb::Zero();
  brdf::Rgb standardised = brdf::Rgb::Zero();  ///< residual over its sigma; NaN: not known
};

/// A pose of the session, in visiting order.
struct MeasuredPose {
  int pose = -1;             ///< the id its samples carry
  brdf::HalfDiff direction;  ///< measured, of the patch's centre
  char branch = 'A';
  std::string outcome;  ///< "Measured", "Saturated", ...
  double travel_s = 0.0;
  double dwell_s = 0.0;  ///< settling and exposures
};

/// A direction that was asked for and not measured.
struct RefusedDirection {
  brdf::HalfDiff direction;
  std::string reason;  ///< "BELOW_HORIZON: theta_i 91.7 deg, at most 80.0"
};

struct TimingEntry {
  std::string name;  ///< "travel", "exposure", "white", ...
  double seconds = 0.0;
};

enum class CheckStatus { passed, remark, failed, not_applicable };

/// The outcome of a self-check of the result.
struct CheckResult {
  std::string name;  ///< "Energy", "Reciprocity", ...
  CheckStatus status = CheckStatus::passed;
  std::string detail;  ///< one sentence with the figures
};

struct Fact {
  std::string name;
  std::string value;
};

/// Everything the page shows. All text may be hostile: it is escaped. Lists may be empty; their
/// sections are then left out.
struct ReportData {
  std::string material;
  std::string summary;  ///< one sentence under the title; may be empty
  std::string verdict;  ///< one line; empty: what the checks say together stands in its place
  std::optional<bool> trusted;  ///< what `verdict` comes to; nothing: it cannot tell
  std::shared_ptr<const brdf::BrdfTable> truth;  ///< null where it is not known
  std::vector<MethodResult> methods;  ///< the first is the one reported and needs a table
  std::vector<FittedSample> samples;
  std::vector<MeasuredPose> poses;
  std::vector<RefusedDirection> refused;
  std::vector<TimingEntry> timing;
  std::vector<CheckResult> checks;
  std::vector<std::string> warnings;
  std::vector<Fact> session;  ///< sample id, operator, instrument, ...
  std::vector<Fact>
      provenance;         ///< versions, hashes, wall-clock times: what may differ from run to run
  int sphere_size = 320;  ///< pixels, in [64, 1024]
};

/// The page. Equal data give equal bytes; what depends on `provenance` stands between
/// `<!-- provenance -->` and `<!-- /provenance -->` and nowhere else.
/// Throws   std::invalid_argument when there is no method with a table or the truth's scale or
///          convention is not the first table's.
/// Time     About 3 s of one processor for three tables, nearly all of it pictures.
std::string html(const ReportData& data);

/// The same as a file that appears when it is whole. Throws FileError before the pictures are made
/// if the file cannot be created.
void write_report(const std::filesystem::path& path, const ReportData& data,
                  files::Overwrite overwrite = files::Overwrite::No);

}  // namespace gonio::report
