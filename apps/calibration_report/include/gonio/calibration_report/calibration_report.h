#pragma once

#include <map>
#include <string>
#include <vector>

#include "gonio/calibration/routine/findings.h"
#include "gonio/calibration/routine/observations.h"
#include "gonio/calibration/routine/routine.h"
#include "gonio/instrument/calibration_archive.h"
#include "gonio/instrument/instrument.h"

/// A calibration as a page that a person judges at a glance: one HTML file without scripts and
/// without anything loaded from elsewhere.
namespace gonio::calibration_report {

/// A step that was not accepted in the run the page is about.
struct RefusedStep {
  std::string step;
  std::string why;
};

/// Everything the page shows. All text may be hostile: it is escaped.
struct CalibrationReportData {
  std::string rig;
  instrument::CalibrationArchive archive;
  /// By step; one that is absent has no figure made of what was seen.
  std::map<std::string, calibration::routine::Observations> observations;
  calibration::routine::Findings findings;
  instrument::Instrument instrument;  ///< with all that was found
  instrument::UtcSeconds now{};       ///< what "expired" is told by
  std::vector<RefusedStep> refused;
};

/// What the archive's results were made from, out of the folder's raw files.
/// Throws FileError; DataFormatError for contents that are not those the archive names.
std::map<std::string, calibration::routine::Observations> read_observations(
    const instrument::CalibrationArchive& archive, const calibration::routine::Folder& folder);

/// The page. Equal data give equal bytes. Threads: any.
std::string html(const CalibrationReportData& data);

}  // namespace gonio::calibration_report
