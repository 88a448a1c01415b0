#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>

#include "columns.h"
#include "gonio/errors/errors.h"
#include "gonio/samples/samples.h"

namespace gonio::samples {
namespace {

using Triple = std::array<std::size_t, 3>;

constexpr std::string_view kScaleKey = "radiometric_scale";

/// All three columns or none: a lone sigma_r is a mistake, not a column to skip.
std::optional<Triple> triple(const CsvReader& reader, const ColumnNames& names, bool required,
                             std::set<std::size_t>& known) {
  Triple columns{};
  std::string missing;
  int found = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (const auto column = reader.column(names[i])) {
      columns[i] = *column;
      known.insert(*column);
      ++found;
    } else {
      missing += (missing.empty() ? "" : ", ") + std::string(names[i]);
    }
  }
  if (found == 3) return columns;
  if (found == 0 && !required) return std::nullopt;
  throw DataFormatError(reader.path(), "line " + std::to_string(reader.header_line()),
                        "found no column " + missing + " in the header, expected " +
                            std::string(names[0]) + "," + std::string(names[1]) + "," +
                            std::string(names[2]));
}

std::optional<std::size_t> single(const CsvReader& reader, std::string_view name,
                                  std::set<std::size_t>& known) {
  const auto column = reader.column(name);
  if (column) known.insert(*column);
  return column;
}

struct Layout {
  Triple direction;
  Triple value;
  std::optional<Triple> sigma;
  std::optional<Triple> common;
  std::optional<Triple> angle;
  std::optional<std::size_t> phi_h;
  std::optional<std::size_t> tilt;
  std::optional<std::size_t> kernel;
  std::optional<std::size_t> pose;
  std::optional<std::size_t> spot;
  std::optional<std::size_t> flags;
  std::vector<std::size_t> extra;
};

Layout layout_of(const CsvReader& reader) {
  std::set<std::size_t> known;
  Layout layout{*triple(reader, kDirectionColumns, true, known),
                *triple(reader, kValueColumns, true, known),
                triple(reader, kSigmaColumns, false, known),
                triple(reader, kCommonColumns, false, known),
                triple(reader, kAngleColumns, false, known),
                single(reader, kPhiHColumn, known),
                single(reader, kTiltColumn, known),
                single(reader, kKernelColumn, known),
                single(reader, kPoseColumn, known),
                single(reader, kSpotColumn, known),
                single(reader, kFlagsColumn, known),
                {}};
  for (std::size_t i = 0; i < reader.header().size(); ++i) {
    if (known.count(i) == 0) layout.extra.push_back(i);
  }
  return layout;
}

brdf::Rgb rgb_of(const CsvReader& reader, const CsvRow& row, const Triple& columns, double min) {
  brdf::Rgb rgb;
  for (Eigen::Index i = 0; i < 3; ++i) {
    rgb[i] = reader.number_within(row, columns[static_cast<std::size_t>(i)], min, kLargest_per_sr);
  }
  return rgb;
}

Angle non_negative_angle(const CsvReader& reader, const CsvRow& row, std::size_t column) {
  return Angle::from_degrees(reader.number_within(row, column, 0.0, 360.0));
}

Sample sample_of(const CsvReader& reader, const CsvRow& row, const Layout& layout) {
  Sample sample;
  sample.direction = direction_of(reader, row, layout.direction);
  refuse_below_horizon(reader, row, layout.direction, sample.direction);
  sample.value_per_sr = rgb_of(reader, row, layout.value, -kLargest_per_sr);
  if (layout.sigma) sample.sigma_per_sr = rgb_of(reader, row, *layout.sigma, 0.0);
  if (layout.common) sample.u_common_per_sr = rgb_of(reader, row, *layout.common, 0.0);
  if (layout.angle) {
    sample.u_theta_h = non_negative_angle(reader, row, (*layout.angle)[0]);
    sample.u_theta_d = non_negative_angle(reader, row, (*layout.angle)[1]);
    sample.u_phi_d = non_negative_angle(reader, row, (*layout.angle)[2]);
  }
  if (layout.phi_h) {
    sample.direction.phi_h =
        Angle::from_degrees(reader.number_within(row, *layout.phi_h, -180.0, 180.0));
  }
  if (layout.tilt) {
    sample.u_tilt =
        Angle::from_degrees(reader.number_within(row, *layout.tilt, 0.0, kLargestTilt_deg));
  }
  if (layout.kernel) sample.kernel = non_negative_angle(reader, row, *layout.kernel);
  const auto number = [&](const std::optional<std::size_t>& column) {
    if (!column || row.cells[*column].empty()) return -1;
    return static_cast<int>(
        reader.integer_within(row, *column, -1, std::numeric_limits<int>::max()));
  };
  sample.pose = number(layout.pose);
  sample.spot = number(layout.spot);
  if (layout.flags) sample.flags = row.cells[*layout.flags];
  sample.extra.reserve(layout.extra.size());
  for (const std::size_t column : layout.extra) sample.extra.push_back(row.cells[column]);
  return sample;
}

/// The value of a `radiometric_scale = value` comment, if it is one.
std::optional<std::string_view> scale_value(std::string_view comment) {
  if (comment.substr(0, kScaleKey.size()) != kScaleKey) return std::nullopt;
  const auto rest = trimmed(comment.substr(kScaleKey.size()));
  if (rest.empty() || (rest.front() != '=' && rest.front() != ':')) return std::nullopt;
  return trimmed(rest.substr(1));
}

void take_comments(const CsvReader& reader, SampleSet& set) {
  std::optional<brdf::RadiometricScale> scale;
  for (const CsvReader::Comment& comment : reader.comments()) {
    const auto value = scale_value(comment.text);
    if (!value) {
      set.comments.push_back(comment.text);
      continue;
    }
    const std::string place = "line " + std::to_string(comment.line) + ", radiometric_scale";
    try {
      const auto found = brdf::radiometric_scale_from_string(*value);
      if (scale && *scale != found) {
        throw DataFormatError(reader.path(), place, "found a second, different scale");
      }
      scale = found;
    } catch (const std::invalid_argument&) {
      throw DataFormatError(reader.path(), place,
                            "found '" + std::string(*value) + "', expected si or merl");
    }
  }
  if (scale) {
    set.scale = *scale;
  } else {
    set.warnings.push_back(reader.path().string() +
                           ": no '# radiometric_scale = si' or 'merl' line; values taken as si");
  }
}

}  // namespace

SampleSet read_samples(const std::filesystem::path& path) {
  CsvReader reader(path);
  const Layout layout = layout_of(reader);
  SampleSet set;
  for (const std::size_t column : layout.extra) {
    set.extra_columns.push_back(reader.header()[column]);
    set.warnings.push_back(path.string() + ": column '" + reader.header()[column] +
                           "' is not known; kept, not used");
  }
  while (const auto row = reader.next()) set.samples.push_back(sample_of(reader, *row, layout));
  if (set.samples.empty()) {
    throw DataFormatError(path, "line " + std::to_string(reader.header_line()),
                          "found a header without rows, expected at least one sample");
  }
  take_comments(reader, set);
  const bool tilted_pose = std::any_of(set.samples.begin(), set.samples.end(), [](const Sample& s) {
    return s.pose >= 0 && s.spot > 0 && s.u_tilt > Angle();
  });
  if (tilted_pose && !layout.phi_h) {
    set.warnings.push_back(path.string() +
                           ": u_tilt_deg without phi_h_deg; all samples of a pose are taken to lie "
                           "on one side of the normal");
  }
  return set;
}

}  // namespace gonio::samples
