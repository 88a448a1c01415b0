#include <set>
#include <stdexcept>

#include "columns.h"
#include "gonio/samples/samples.h"

namespace gonio::samples {
namespace {

/// Which optional columns say something.
struct Used {
  bool sigma = false;
  bool common = false;
  bool angle = false;
  bool phi_h = false;
  bool tilt = false;
  bool kernel = false;
  bool pose = false;
  bool spot = false;
  bool flags = false;
};

Used used_by(const std::vector<Sample>& samples) {
  Used used;
  for (const Sample& s : samples) {
    used.sigma |= (s.sigma_per_sr != 0.0).any();
    used.common |= (s.u_common_per_sr != 0.0).any();
    used.angle |= s.u_theta_h != Angle() || s.u_theta_d != Angle() || s.u_phi_d != Angle();
    used.phi_h |= s.direction.phi_h != Angle();
    used.tilt |= s.u_tilt != Angle();
    used.kernel |= s.kernel != Angle();
    used.pose |= s.pose != -1;
    used.spot |= s.spot != -1;
    used.flags |= !s.flags.empty();
  }
  return used;
}

bool is_uncertainty(const brdf::Rgb& rgb) {
  return (rgb >= 0.0).all() && (rgb <= kLargest_per_sr).all();
}

bool within(Angle angle, double min_deg, double max_deg) {
  return angle >= Angle::from_degrees(min_deg) && angle <= Angle::from_degrees(max_deg);
}

/// Empty, or why read_samples() would refuse the sample.
std::string fault_of(const Sample& s, std::size_t extra_columns) {
  if (!within(s.direction.theta_h, 0.0, 90.0) || !within(s.direction.theta_d, 0.0, 90.0) ||
      !within(s.direction.phi_d, -180.0, 180.0) || !within(s.direction.phi_h, -180.0, 180.0)) {
    return "direction out of range";
  }
  if (!brdf::above_horizon(s.direction.theta_h, s.direction.theta_d, s.direction.phi_d)) {
    return "direction below the horizon";
  }
  if (!s.value_per_sr.isFinite().all()) return "value is not finite";
  if ((s.value_per_sr.abs() > kLargest_per_sr).any()) return "value is beyond 1e12 1/sr";
  if (!is_uncertainty(s.sigma_per_sr)) return "sigma is negative or not within 1e12 1/sr";
  if (!is_uncertainty(s.u_common_per_sr)) return "u_common is negative or not within 1e12 1/sr";
  for (const Angle u : {s.u_theta_h, s.u_theta_d, s.u_phi_d, s.kernel}) {
    if (!within(u, 0.0, 360.0)) return "angle uncertainty or kernel is negative or too large";
  }
  if (!within(s.u_tilt, 0.0, kLargestTilt_deg)) return "u_tilt is negative or above 45 deg";
  if (s.pose < -1) return "pose id below -1";
  if (s.spot < -1) return "spot number below -1";
  if (!s.extra.empty() && s.extra.size() != extra_columns) {
    return "has " + std::to_string(s.extra.size()) + " extra cells for " +
           std::to_string(extra_columns) + " extra columns";
  }
  return "";
}

void append(std::string& line, const std::string& cell) {
  if (!line.empty()) line.push_back(',');
  line += cell;
}

void append(std::string& line, const ColumnNames& names) {
  for (const std::string_view name : names) append(line, std::string(name));
}

void append(std::string& line, const brdf::Rgb& rgb) {
  for (const double value : {rgb[0], rgb[1], rgb[2]}) append(line, csv_number(value));
}

std::string header_of(const SampleSet& set, const Used& used) {
  std::string line;
  append(line, kDirectionColumns);
  append(line, kValueColumns);
  if (used.sigma) append(line, kSigmaColumns);
  if (used.common) append(line, kCommonColumns);
  if (used.angle) append(line, kAngleColumns);
  if (used.phi_h) append(line, std::string(kPhiHColumn));
  if (used.tilt) append(line, std::string(kTiltColumn));
  if (used.kernel) append(line, std::string(kKernelColumn));
  if (used.pose) append(line, std::string(kPoseColumn));
  if (used.spot) append(line, std::string(kSpotColumn));
  if (used.flags) append(line, std::string(kFlagsColumn));
  for (const std::string& name : set.extra_columns) append(line, csv_cell(name));
  return line;
}

std::string row_of(const Sample& s, const Used& used, std::size_t extra_columns) {
  std::string line;
  append(line, csv_degrees(s.direction.theta_h));
  append(line, csv_degrees(s.direction.theta_d));
  append(line, csv_degrees(s.direction.phi_d));
  append(line, s.value_per_sr);
  if (used.sigma) append(line, s.sigma_per_sr);
  if (used.common) append(line, s.u_common_per_sr);
  if (used.angle) {
    for (const Angle u : {s.u_theta_h, s.u_theta_d, s.u_phi_d}) append(line, csv_degrees(u));
  }
  if (used.phi_h) append(line, csv_degrees(s.direction.phi_h));
  if (used.tilt) append(line, csv_degrees(s.u_tilt));
  if (used.kernel) append(line, csv_degrees(s.kernel));
  if (used.pose) append(line, std::to_string(s.pose));
  if (used.spot) append(line, std::to_string(s.spot));
  if (used.flags) append(line, csv_cell(s.flags));
  for (std::size_t i = 0; i < extra_columns; ++i) {
    append(line, s.extra.empty() ? std::string() : csv_cell(s.extra[i]));
  }
  return line;
}

/// Header names must be different, or the file could not be read again.
void refuse_clashing_names(const std::vector<std::string>& extra_columns) {
  std::set<std::string_view> taken{kPhiHColumn, kTiltColumn, kKernelColumn,
                                   kPoseColumn, kSpotColumn, kFlagsColumn};
  for (const ColumnNames& names :
       {kDirectionColumns, kValueColumns, kSigmaColumns, kCommonColumns, kAngleColumns}) {
    taken.insert(names.begin(), names.end());
  }
  for (const std::string& name : extra_columns) {
    if (name.empty() || !taken.insert(name).second) {
      throw std::invalid_argument("write_samples: extra column '" + name +
                                  "' has no name or one that is taken");
    }
  }
}

std::string text_of(const SampleSet& set) {
  refuse_clashing_names(set.extra_columns);
  const Used used = used_by(set.samples);
  std::string text = "# radiometric_scale = " + std::string(to_string(set.scale)) + "\n";
  for (const std::string& comment : set.comments) {
    csv_cell(comment);  // refuses line breaks, which would turn a comment into data
    text += "# " + comment + "\n";
  }
  text += header_of(set, used) + "\n";
  for (std::size_t i = 0; i < set.samples.size(); ++i) {
    const std::string fault = fault_of(set.samples[i], set.extra_columns.size());
    if (!fault.empty()) {
      throw std::invalid_argument("write_samples: sample " + std::to_string(i) + ": " + fault);
    }
    text += row_of(set.samples[i], used, set.extra_columns.size()) + "\n";
  }
  return text;
}

}  // namespace

void write_samples(const std::filesystem::path& path, const SampleSet& set,
                   files::Overwrite overwrite) {
  if (set.samples.empty()) throw std::invalid_argument("write_samples: no samples");
  files::write_text_file(path, text_of(set), overwrite);
}

}  // namespace gonio::samples
