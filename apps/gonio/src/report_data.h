#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gonio/basis/reconstruct.h"
#include "gonio/quality/homogeneity.h"
#include "gonio/report/report.h"
#include "stored_session.h"

namespace gonio::cli {

/// The page of a session: poses, timing, facts and provenance from the archive. Methods, samples
/// and truth are added by the caller.
report::ReportData session_report(const StoredSession& session);

/// What the session watched itself by, as rows of the page's checks, also when all is well: lamp,
/// sentinel, points measured twice.
std::vector<report::CheckResult> session_checks(const acquisition::SessionReader& archive,
                                                const acquisition::Reduction& reduction);

/// Samples beside the fit, for the page.
std::vector<report::FittedSample> fitted_samples(const samples::SampleSet& samples,
                                                 const basis::Fit& fit);
std::vector<report::FittedSample> fitted_samples(const samples::SampleSet& samples,
                                                 const brdf::BrdfTable& table);

/// "3.1 % rms between places of the sample, ...".
std::string to_text(const quality::HomogeneityCheck& check);

/// The same as a row of the page's checks.
report::CheckResult evenness(const samples::SampleSet& samples, const basis::Fit& fit);
/// Bands of a method whose table is the fit's, and the verdict at the top of the page.
void add_trust(const basis::Basis& basis, const samples::SampleSet& samples, const basis::Fit& fit,
               report::MethodResult& method, report::ReportData& data);

/// Self-checks of a result: energy, and how well it explains its samples where a fit is given.
std::vector<report::CheckResult> self_checks(const brdf::BrdfTable& table, const basis::Fit* fit);

}  // namespace gonio::cli
