#include "gonio/brdf/rgl_file.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tensor_file.h"

namespace gonio::brdf {
namespace {

/// Far above any file of the database; what a description can put on a terminal.
constexpr std::size_t kLongestDescription = 1024;

std::string text_of(const std::vector<std::uint64_t>& shape) {
  std::string text;
  for (const std::uint64_t extent : shape) {
    text += (text.empty() ? "" : " x ") + std::to_string(extent);
  }
  return text.empty() ? "a single number" : text;
}

/// The last two extents are rows and columns; those before must be `leading`.
RglTables::Grid read_grid(TensorFile& file, const char* name,
                          const std::vector<std::uint64_t>& leading) {
  const std::vector<std::uint64_t>& shape = file.field(name).shape;
  const bool fits = shape.size() == leading.size() + 2 &&
                    std::equal(leading.begin(), leading.end(), shape.begin());
  if (!fits) {
    std::string expected;
    for (const std::uint64_t extent : leading) expected += std::to_string(extent) + " x ";
    file.fail(name, "found shape " + text_of(shape) + ", expected " + expected + "rows x columns");
  }
  return {static_cast<std::size_t>(shape[shape.size() - 2]),
          static_cast<std::size_t>(shape[shape.size() - 1]), file.floats(name)};
}

std::vector<float> read_line(TensorFile& file, const char* name) {
  if (file.field(name).shape.size() != 1) {
    file.fail(name, "found shape " + text_of(file.field(name).shape) + ", expected one dimension");
  }
  return file.floats(name);
}

}  // namespace

RglTables read_rgl(const std::filesystem::path& path) {
  TensorFile file(path);
  RglTables tables;
  if (file.has("description")) {
    for (const std::uint8_t byte : file.bytes("description")) {
      if (tables.description.size() == kLongestDescription || byte == 0) break;
      tables.description += byte < 0x20 || byte == 0x7F ? '?' : static_cast<char>(byte);
    }
  }
  const std::vector<float> phi_i = read_line(file, "phi_i");
  if (phi_i.size() != 1) {
    file.fail("phi_i", "found " + std::to_string(phi_i.size()) +
                           " azimuths of the light (an anisotropic material), expected 1");
  }
  if (!file.has("rgb") && file.has("spectra")) {
    file.fail("rgb", "missing; this is a spectral file, expected the material's RGB file");
  }
  tables.theta_i_rad = read_line(file, "theta_i");
  const std::uint64_t slices = tables.theta_i_rad.size();
  tables.ndf = read_grid(file, "ndf", {});
  tables.sigma = read_grid(file, "sigma", {});
  tables.vndf = read_grid(file, "vndf", {1, slices});
  tables.rgb = read_grid(file, "rgb", {1, slices, 3});
  const std::vector<std::uint8_t> jacobian = file.bytes("jacobian");
  if (jacobian.size() != 1 || jacobian[0] > 1) {
    file.fail("jacobian", "expected one byte, 0 or 1");
  }
  tables.jacobian = jacobian[0] == 1;
  try {
    const RglBrdf checked(tables);
  } catch (const std::invalid_argument& error) {
    const std::string_view what = error.what();
    const std::size_t colon = what.find(": ");
    file.fail(what.substr(0, colon), std::string(what.substr(colon + 2)));
  }
  return tables;
}

}  // namespace gonio::brdf
