#include "gonio/brdf/material_file.h"

#include <algorithm>
#include <array>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "gonio/brdf/cornell_file.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/brdf/rgl_file.h"
#include "gonio/brdf/scattered_brdf.h"
#include "gonio/errors/errors.h"

namespace gonio::brdf {
namespace {

ScatteredBrdf scattered(const std::filesystem::path& path, Symmetry symmetry) {
  const std::vector<ScatteredValue> samples = read_cornell(path);
  try {
    return ScatteredBrdf(samples, symmetry);
  } catch (const std::invalid_argument& error) {
    throw DataFormatError(path, "as scattered samples", error.what());
  }
}

/// The sharpest networks of the databases reach 5e6; a lobe of a thousandth of a degree has 1e9.
constexpr double kLargestBrdf_per_sr = 1e9;

/// The table, unless nothing can be learned from it.
BrdfTable usable(const std::filesystem::path& path, const char* place, BrdfTable table) {
  double largest = 0.0;
  for (const std::uint32_t cell : lattice::cells_above_horizon(table.convention())) {
    if (table.valid(cell)) largest = std::max(largest, table.value(cell).maxCoeff());
  }
  if (!(largest > 0.0)) {
    throw DataFormatError(path, place,
                          "found no value above 0 above the horizon, expected at least one");
  }
  if (largest > kLargestBrdf_per_sr) {
    std::ostringstream found;
    found << "found " << largest << " 1/sr, expected at most " << kLargestBrdf_per_sr;
    throw DataFormatError(path, place, found.str());
  }
  return table;
}

}  // namespace

std::string_view to_string(MaterialFormat format) {
  switch (format) {
    case MaterialFormat::merl:
      return "merl";
    case MaterialFormat::rgl:
      return "rgl";
    case MaterialFormat::cornell:
      return "cornell";
  }
  throw std::invalid_argument("unknown material format");
}

MaterialFormat material_format(const std::filesystem::path& path) {
  const std::filesystem::path extension = path.extension();
  if (extension == ".bsdf") return MaterialFormat::rgl;
  if (extension == ".brdf") return MaterialFormat::cornell;
  return MaterialFormat::merl;
}

std::span<const std::string_view> material_extensions() {
  static constexpr std::array<std::string_view, 3> kExtensions = {".binary", ".bsdf", ".brdf"};
  return kExtensions;
}

RadiometricScale material_scale(const std::filesystem::path& path) {
  if (material_format(path) != MaterialFormat::merl) return RadiometricScale::si;
  const auto sidecar = read_merl_sidecar(path);
  return sidecar ? sidecar->scale : RadiometricScale::merl;
}

BrdfTable read_material(const std::filesystem::path& path) {
  switch (material_format(path)) {
    case MaterialFormat::rgl:
      return usable(path, "field rgb", tabulate(RglBrdf(read_rgl(path)), RadiometricScale::si));
    case MaterialFormat::cornell:
      return usable(path, "as scattered samples",
                    tabulate_covered(scattered(path, Symmetry::reciprocal), RadiometricScale::si));
    case MaterialFormat::merl:
      break;
  }
  return usable(path, "values", read_merl(path));
}

std::optional<ConventionReport> check_file_conventions(const std::filesystem::path& path) {
  switch (material_format(path)) {
    case MaterialFormat::rgl: {
      const RglBrdf brdf(read_rgl(path));
      return check_conventions([&](const DirectionPair& pair) { return brdf.one_way(pair); },
                               [](const DirectionPair&) { return true; });
    }
    case MaterialFormat::cornell: {
      const ScatteredBrdf brdf = scattered(path, Symmetry::one_way);
      return check_conventions([&](const DirectionPair& pair) { return brdf.evaluate(pair); },
                               [&](const DirectionPair& pair) { return brdf.covers(pair); });
    }
    case MaterialFormat::merl:
      break;
  }
  return std::nullopt;
}

}  // namespace gonio::brdf
