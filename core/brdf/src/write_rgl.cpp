#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/brdf/rgl_file.h"
#include "gonio/brdf/spectrum.h"
#include "tensor_file.h"

namespace gonio::brdf {
namespace {

using Shape = std::vector<std::uint64_t>;

/// Collects the fields of a tensor file.
class TensorWriter {
 public:
  template <typename Number>
  void add(std::string_view name, TensorFile::Type type, Shape shape,
           std::span<const Number> data) {
    const auto bytes = std::as_bytes(data);
    fields_.push_back({std::string(name), static_cast<std::uint8_t>(type), std::move(shape),
                       std::vector<std::byte>(bytes.begin(), bytes.end())});
  }
  void floats(std::string_view name, Shape shape, std::span<const float> data) {
    add(name, TensorFile::Type::float32, std::move(shape), data);
  }

  void write(files::AtomicFile& file) const {
    std::string head("tensor_file\0\1\0", 14);
    put(head, static_cast<std::uint32_t>(fields_.size()));
    std::uint64_t offset = head.size();
    for (const Field& field : fields_) offset += 13 + field.name.size() + 8 * field.shape.size();
    for (const Field& field : fields_) {
      put(head, static_cast<std::uint16_t>(field.name.size()));
      head += field.name;
      put(head, static_cast<std::uint16_t>(field.shape.size()));
      put(head, field.type);
      put(head, offset);
      for (const std::uint64_t extent : field.shape) put(head, extent);
      offset += field.data.size();
    }
    file.write(head);
    for (const Field& field : fields_) file.write(field.data);
  }

 private:
  struct Field {
    std::string name;
    std::uint8_t type;
    Shape shape;
    std::vector<std::byte> data;
  };

  template <typename Number>
  static void put(std::string& out, Number value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out.append(bytes, sizeof value);
  }

  std::vector<Field> fields_;
};

/// Below it a renderer would never try a direction that reflects a little.
constexpr float kLowestShare = 1e-3f;

/// A sampling density over the warped square, per theta_i.
std::vector<float> sampling_density(const RglTables& tables, std::size_t plane) {
  std::vector<float> density;
  const float* rgb = tables.rgb.values.data();
  for (std::size_t slice = 0; slice < tables.theta_i_rad.size(); ++slice, rgb += 3 * plane) {
    const std::size_t begin = density.size();
    for (std::size_t i = 0; i < plane; ++i) {
      density.push_back(std::max(
          0.2126f * rgb[i] + 0.7152f * rgb[plane + i] + 0.0722f * rgb[2 * plane + i], 0.0f));
    }
    const auto first = density.begin() + static_cast<std::ptrdiff_t>(begin);
    const float floor = std::max(kLowestShare * *std::max_element(first, density.end()), 1e-20f);
    std::for_each(first, density.end(), [floor](float& value) { value = std::max(value, floor); });
  }
  return density;
}

constexpr double kWrittenFirst_nm = 400.0;
constexpr double kWrittenLast_nm = 700.0;
constexpr double kWrittenStep_nm = 10.0;

}  // namespace

void write_rgl(const std::filesystem::path& path, const RglTables& tables,
               files::Overwrite overwrite) {
  const RglBrdf checked(tables);
  if (tables.rgb.height != tables.rgb.width) {
    throw std::invalid_argument("rgb: the warped grid must be square to be written");
  }
  const std::uint64_t slices = tables.theta_i_rad.size();
  const std::uint64_t side = tables.rgb.width;
  const std::size_t plane = static_cast<std::size_t>(side * side);

  std::vector<double> wavelengths;
  for (double at = kWrittenFirst_nm; at <= kWrittenLast_nm; at += kWrittenStep_nm)
    wavelengths.push_back(at);
  const Eigen::MatrixX3f primaries = smooth_spectra(wavelengths).cast<float>();
  std::vector<float> spectra;
  spectra.reserve(static_cast<std::size_t>(slices) * wavelengths.size() * plane);
  for (std::size_t slice = 0; slice < slices; ++slice) {
    const float* const rgb = tables.rgb.values.data() + 3 * slice * plane;
    for (Eigen::Index wavelength = 0; wavelength < primaries.rows(); ++wavelength) {
      for (std::size_t i = 0; i < plane; ++i) {
        const float value = primaries(wavelength, 0) * rgb[i] +
                            primaries(wavelength, 1) * rgb[plane + i] +
                            primaries(wavelength, 2) * rgb[2 * plane + i];
        spectra.push_back(std::max(value, 0.0f));  // renderers take no negative light
      }
    }
  }

  TensorWriter writer;
  const std::vector<std::uint32_t> version = {1, 0};
  writer.add<std::uint32_t>("version", TensorFile::Type::uint32, {2}, version);
  const std::string description = tables.description.empty() ? "unnamed" : tables.description;
  const std::vector<std::uint8_t> text(description.begin(), description.end());
  writer.add<std::uint8_t>("description", TensorFile::Type::uint8, {text.size()}, text);
  const std::vector<float> phi_i = {0.0f};
  writer.floats("phi_i", {1}, phi_i);
  writer.floats("theta_i", {slices}, tables.theta_i_rad);
  writer.floats("sigma", {tables.sigma.height, tables.sigma.width}, tables.sigma.values);
  writer.floats("ndf", {tables.ndf.height, tables.ndf.width}, tables.ndf.values);
  writer.floats("vndf", {1, slices, tables.vndf.height, tables.vndf.width}, tables.vndf.values);
  writer.floats("luminance", {1, slices, side, side}, sampling_density(tables, plane));
  writer.floats("rgb", {1, slices, 3, side, side}, tables.rgb.values);
  const std::vector<float> wavelengths_float(wavelengths.begin(), wavelengths.end());
  writer.floats("wavelengths", {wavelengths.size()}, wavelengths_float);
  writer.floats("spectra", {1, slices, wavelengths.size(), side, side}, spectra);
  const std::vector<std::uint8_t> jacobian = {tables.jacobian ? std::uint8_t{1} : std::uint8_t{0}};
  writer.add<std::uint8_t>("jacobian", TensorFile::Type::uint8, {1}, jacobian);

  files::AtomicFile file(path, overwrite);
  writer.write(file);
  file.commit();
}

}  // namespace gonio::brdf
