#include "find_alignment.h"

#include <utility>

#include "calibration_run.h"
#include "gonio/calibration/routine/sample_alignment.h"
#include "gonio/files/sha256.h"
#include "gonio/instrument/calibration_file.h"
#include "gonio/setup/calibration_settings.h"

namespace gonio::cli {
namespace {

instrument::Alignment alignment_on(const AlignmentRig& rig, std::string method,
                                   const Eigen::Matrix2d& covariance) {
  instrument::Alignment alignment;
  alignment.method = std::move(method);
  alignment.found = now_utc();
  alignment.instrument_sha256 = files::sha256_of_bytes(instrument::to_json(rig.constants));
  alignment.covariance = covariance;
  if (rig.calibrated) {
    const double datum = rig.constants.u_normal.radians();
    alignment.covariance.diagonal().array() += datum * datum;
  }
  return alignment;
}

}  // namespace

instrument::Alignment alignment_by_highlight(const Console& console, const AlignmentRig& rig,
                                             OpenedRig& opened, std::stop_token stop) {
  Progress progress(console, "aligning");
  const auto found = calibration::routine::align_sample(
      opened.devices(), rig.constants, calibration_settings(rig.file),
      [&](const std::string& what, double fraction) { progress.update(fraction, what); },
      std::move(stop));
  instrument::Alignment alignment = alignment_on(rig, "highlight", found.normal.covariance);
  alignment.tilt_x = found.normal.tilt_x;
  alignment.tilt_y = found.normal.tilt_y;
  return alignment;
}

instrument::Alignment alignment_by_seat(const AlignmentRig& rig, Angle sigma) {
  return alignment_on(rig, "seat", sigma.radians() * sigma.radians() * Eigen::Matrix2d::Identity());
}

}  // namespace gonio::cli
