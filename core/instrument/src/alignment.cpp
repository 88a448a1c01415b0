#include "gonio/instrument/alignment.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "gonio/files/text_file.h"
#include "gonio/instrument/utc_time.h"
#include "gonio/json/json_document.h"
#include "gonio/json/json_fields.h"

namespace gonio::instrument {
namespace {

constexpr const char* kAlignmentFormat = "gonio-alignment";
constexpr int kAlignmentVersion = 2;
constexpr std::int64_t kLastFound_s = 253402300799;  // of the year 9999
constexpr double kMaxTilt_deg = 20.0;
// No sample is known better, and one known worse is not aligned.
constexpr Angle kLeastSigma = Angle::from_degrees(1e-5);
constexpr Angle kMostSigma = Angle::from_degrees(10.0);
constexpr std::size_t kMaxAlignmentBytes = 1U << 16U;

void require_alignment(bool ok, const std::string& what) {
  if (!ok) throw std::invalid_argument(what);
}

}  // namespace

void Alignment::validate() const {
  for (const Angle tilt : {tilt_x, tilt_y}) {
    require_alignment(std::abs(tilt.degrees()) <= kMaxTilt_deg,
                      "tilt: expected at most 20 deg either way");
  }
  for (const double variance : {covariance(0, 0), covariance(1, 1)}) {
    require_alignment(variance >= std::pow(kLeastSigma.radians(), 2) &&
                          variance <= std::pow(kMostSigma.radians(), 2),
                      fmt::format("covariance: found a sigma of {:g} deg, expected {:g} to {:g}",
                                  Angle::from_radians(std::sqrt(variance)).degrees(),
                                  kLeastSigma.degrees(), kMostSigma.degrees()));
  }
  require_alignment(covariance.allFinite() && covariance(0, 0) >= 0.0 && covariance(1, 1) >= 0.0 &&
                        covariance(0, 1) == covariance(1, 0) && covariance.determinant() >= 0.0,
                    "covariance: expected a symmetric, positive one");
  require_alignment(method == "highlight" || method == "seat",
                    "method: expected \"highlight\" or \"seat\"");
  require_alignment(sample.find('\n') == std::string::npos, "sample: expected one line");
  require_alignment(instrument_sha256.size() == 64 && instrument_sha256.find_first_not_of(
                                                          "0123456789abcdef") == std::string::npos,
                    "instrument_sha256: expected 64 hexadecimal digits");
}

std::vector<std::string> reasons_against(const Alignment& alignment, const std::string& sample,
                                         std::chrono::sys_seconds now) {
  std::vector<std::string> reasons;
  if (!sample.empty() && !alignment.sample.empty() && sample != alignment.sample) {
    reasons.push_back(fmt::format("alignment: found one of sample \"{}\", expected \"{}\"",
                                  alignment.sample, sample));
  }
  if (const std::string to_come = time_to_come(alignment.found, now); !to_come.empty()) {
    reasons.push_back("alignment: found_utc_s: " + to_come);
  }
  if (now > alignment.found + kAlignmentHolds) {
    reasons.push_back(
        fmt::format("alignment: is of {:%Y-%m-%d %H:%M} UTC, expected one of the "
                    "last {} hours",
                    alignment.found, kAlignmentHolds.count()));
  }
  return reasons;
}

Instrument aligned(const Instrument& instrument, const Alignment& alignment) {
  alignment.validate();
  Instrument result = instrument;
  const Eigen::Vector3d turn(alignment.tilt_x.radians(), alignment.tilt_y.radians(), 0.0);
  if (turn.norm() > 0.0) {
    result.rig.sample.home_pose.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  }
  result.u_normal = Angle::from_radians(std::sqrt(0.5 * alignment.covariance.trace()));
  return result;
}

std::string to_json(const Alignment& alignment) {
  const Eigen::Matrix2d& c = alignment.covariance;
  const nlohmann::ordered_json document = {
      {"format", kAlignmentFormat},
      {"version", kAlignmentVersion},
      {"tilt_rad", {alignment.tilt_x.radians(), alignment.tilt_y.radians()}},
      {"covariance_rad2", {c(0, 0), c(0, 1), c(1, 0), c(1, 1)}},
      {"method", alignment.method},
      {"sample", alignment.sample},
      {"found_utc_s", alignment.found.time_since_epoch().count()},
      {"instrument_sha256", alignment.instrument_sha256}};
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Alignment alignment_from_json(const std::string& text, const std::filesystem::path& place) {
  const nlohmann::json document =
      json::parse_document(text, place, kAlignmentFormat, kAlignmentVersion);
  json::JsonFields fields(document, "", place);
  Alignment alignment;
  const auto tilt = fields.vector<2>("tilt_rad");
  alignment.tilt_x = Angle::from_radians(tilt[0]);
  alignment.tilt_y = Angle::from_radians(tilt[1]);
  const auto covariance = fields.vector<4>("covariance_rad2");
  alignment.covariance << covariance[0], covariance[1], covariance[2], covariance[3];
  alignment.method = fields.text("method");
  alignment.sample = fields.text("sample");
  alignment.found =
      std::chrono::sys_seconds(std::chrono::seconds(fields.whole("found_utc_s", 0, kLastFound_s)));
  alignment.instrument_sha256 = fields.text("instrument_sha256");
  fields.finish();
  try {
    alignment.validate();
  } catch (const std::invalid_argument& error) {
    throw DataFormatError(place, "contents", error.what());
  }
  return alignment;
}

Alignment read_alignment(const std::filesystem::path& path) {
  return alignment_from_json(files::read_text_file(path, kMaxAlignmentBytes), path);
}

void write_alignment(const std::filesystem::path& path, const Alignment& alignment,
                     files::Overwrite overwrite) {
  alignment.validate();
  files::write_text_file(path, to_json(alignment), overwrite);
}

}  // namespace gonio::instrument
