#include "gonio/basis/uncertainty_file.h"

#include <stdexcept>
#include <vector>

#include "basis_schema.h"
#include "gonio/brdf/merl_lattice.h"
#include "hdf5_handles.h"
#include "hdf5_writer.h"

namespace gonio::basis {
namespace {

namespace lattice = brdf::lattice;

constexpr int kVersion = 1;
constexpr std::size_t kDataSets = 5;

/// Limits of all cells, one row per cell: R, G, B in 1/sr.
std::vector<float> limits(const Basis& basis, const Fit& fit, const Uncertainty& uncertainty,
                          double factor) {
  const brdf::BrdfTable table = limit(basis, fit, uncertainty, factor);
  const std::vector<double> planes =
      brdf::values_at_cells(table, std::span(lattice::cells_above_horizon()));
  const std::size_t p = planes.size() / 3;
  std::vector<float> rows(planes.size());
  for (std::size_t i = 0; i < p; ++i) {
    for (std::size_t c = 0; c < 3; ++c) rows[3 * i + c] = static_cast<float>(planes[c * p + i]);
  }
  return rows;
}

}  // namespace

std::filesystem::path uncertainty_path(const std::filesystem::path& binary) {
  std::filesystem::path path = binary;
  if (path.extension() == ".binary") path.replace_extension();
  path += ".uncertainty.h5";
  return path;
}

void write_uncertainty(const std::filesystem::path& path, const Basis& basis, const Fit& fit,
                       const Uncertainty& uncertainty, const std::string& brdf_sha256,
                       files::Overwrite overwrite) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  if (static_cast<std::size_t>(uncertainty.sigma.rows()) != cells.size()) {
    throw std::invalid_argument("write_uncertainty: the uncertainty does not cover the cells");
  }
  if (brdf_sha256.size() != 64 ||
      brdf_sha256.find_first_not_of("0123456789abcdef") != std::string::npos) {
    throw std::invalid_argument(
        "write_uncertainty: the SHA-256 of the BRDF is not 64 lower-case hexadecimal digits");
  }
  files::AtomicFile file(path, overwrite);
  // HDF5 does not survive a disk that is full while it writes: it crashes when it closes.
  constexpr std::uintmax_t kHeaders = std::uintmax_t{1} << 20U;
  file.require_room(kHeaders + cells.size() * 3 * sizeof(float) * kDataSets);
  {
    const std::array<hsize_t, 2> shape = {static_cast<hsize_t>(cells.size()), 3};
    const std::lock_guard lock(schema::library_mutex());
    const detail::SilentH5Errors silent;
    detail::Hdf5Writer writer(file);
    writer.attribute(schema::kAttributeKind, "gonio uncertainty");
    writer.attribute(schema::kAttributeVersion, kVersion);
    writer.attribute("description",
                     "Limits of a reconstructed BRDF, one row per lattice cell above the horizon, "
                     "columns R, G, B: the true value lies between lower_95 and upper_95 with a "
                     "probability of 95 %, between lower_68 and upper_68 with 68 %");
    writer.attribute("unit", "1/sr");
    writer.attribute("brdf_sha256", brdf_sha256);
    writer.attribute(schema::kAttributeConvention,
                     std::string(to_string(brdf::IndexConvention::bin_centre)));
    writer.attribute("cell_number", "phi_d + 180 (theta_d + 90 theta_h), indices of the lattice");
    writer.attribute(schema::kAttributeScale, std::string(to_string(basis.scale)));
    writer.attribute("mapping",
                     "log_sigma is the standard deviation of ln(f w + mapping_epsilon), "
                     "w = clip(cos theta_i cos theta_o, mapping_cosine_floor, 1)");
    writer.attribute(schema::kAttributeEpsilon, basis.mapping.epsilon);
    writer.attribute(schema::kAttributeFloor, basis.mapping.cosine_floor);
    writer.attribute("factor_68", uncertainty.factor_68);
    writer.attribute("factor_95", uncertainty.factor_95);
    writer.data_set<1>(schema::kCells, H5T_STD_U32LE, {shape[0]}, cells.data());
    const struct {
      const char* name;
      double factor;
    } all[] = {{"lower_68", -uncertainty.factor_68},
               {"upper_68", uncertainty.factor_68},
               {"lower_95", -uncertainty.factor_95},
               {"upper_95", uncertainty.factor_95}};
    for (const auto& [name, factor] : all) {
      writer.data_set<2>(name, H5T_IEEE_F32LE, shape,
                         limits(basis, fit, uncertainty, factor).data());
    }
    const RowMajorMatrixXf sigma = uncertainty.sigma;
    writer.data_set<2>("log_sigma", H5T_IEEE_F32LE, shape, sigma.data());
    writer.close();
  }
  file.commit();
}

}  // namespace gonio::basis
