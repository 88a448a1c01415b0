#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "basis_schema.h"
#include "gonio/basis/basis_file.h"
#include "hdf5_handles.h"
#include "hdf5_writer.h"

namespace gonio::basis {
namespace {

void check_basis(const Basis& basis) {
  const Eigen::Index k = basis.components.cols();
  const std::size_t p = brdf::lattice::cells_above_horizon().size();
  const bool fits =
      static_cast<std::size_t>(basis.mean.size()) == p &&
      static_cast<std::size_t>(basis.components.rows()) == p && k >= 1 &&
      basis.singular_values.size() == basis.row_count() - 1 && k <= basis.singular_values.size() &&
      basis.left_vectors.rows() == basis.row_count() && basis.left_vectors.cols() == k;
  if (!fits) throw std::invalid_argument("write_basis: the parts of the basis do not fit together");
  for (const MaterialId& id : basis.materials) {
    for (const std::string* text : {&id.name, &id.family, &id.sha256, &id.source, &id.group}) {
      if (text->size() > schema::kLongestText) {
        throw std::invalid_argument("write_basis: a material text of " +
                                    std::to_string(text->size()) + " bytes, at most " +
                                    std::to_string(schema::kLongestText) + " may be stored");
      }
    }
  }
}

/// At least what the file will hold.
std::uintmax_t file_bytes(const Basis& basis) {
  constexpr std::uintmax_t kHeaders = std::uintmax_t{2} << 20U;
  return kHeaders + sizeof(float) * static_cast<std::uintmax_t>(basis.components.size()) +
         (sizeof(float) + sizeof(std::uint32_t)) * static_cast<std::uintmax_t>(basis.mean.size()) +
         sizeof(double) * static_cast<std::uintmax_t>(basis.left_vectors.size());
}

}  // namespace

std::mutex& schema::library_mutex() {
  static std::mutex mutex;
  // Every file is closed here. What HDF5 itself leaves open of a damaged file it would otherwise
  // complain about on standard error when the program ends.
  [[maybe_unused]] static const herr_t once = H5dont_atexit();
  return mutex;
}

void write_basis(const std::filesystem::path& path, const Basis& basis,
                 files::Overwrite overwrite) {
  check_basis(basis);
  files::AtomicFile file(path, overwrite);
  // HDF5 does not survive a disk that is full while it writes: it crashes when it closes.
  file.require_room(file_bytes(basis));
  {
    const std::lock_guard lock(schema::library_mutex());
    const detail::SilentH5Errors silent;
    detail::Hdf5Writer writer(file);
    writer.attribute(schema::kAttributeKind, schema::kFileKind);
    writer.attribute(schema::kAttributeVersion, schema::kVersion);
    writer.attribute("description",
                     "Principal components of mapped BRDFs: x = mean + components c, one row per "
                     "lattice cell above the horizon, the columns scaled by the singular values; "
                     "training row t has the coefficients left_vectors[t]");
    writer.attribute("mapping",
                     "x = ln(f w + mapping_epsilon), "
                     "w = clip(cos theta_i cos theta_o, mapping_cosine_floor, 1), f in 1/sr");
    writer.attribute(schema::kAttributeEpsilon, basis.mapping.epsilon);
    writer.attribute(schema::kAttributeFloor, basis.mapping.cosine_floor);
    writer.attribute(schema::kAttributeConvention,
                     std::string(to_string(brdf::IndexConvention::bin_centre)));
    writer.attribute("cell_number", "phi_d + 180 (theta_d + 90 theta_h), indices of the lattice");
    writer.attribute(schema::kAttributeScale, std::string(to_string(basis.scale)));
    writer.attribute(schema::kAttributeRows, basis.row_count());
    writer.attribute("prior", "c ~ N(0, I/training_rows)");
    writer.attribute("eta_rule", "eta = training_rows sigma^2, sigma in the mapped domain");

    const hsize_t p = static_cast<hsize_t>(basis.components.rows());
    const hsize_t k = static_cast<hsize_t>(basis.components.cols());
    std::vector<std::string> names, families, hashes, sources, groups;
    std::vector<double> scale_factors;
    for (const MaterialId& id : basis.materials) {
      names.push_back(id.name);
      families.push_back(id.family);
      hashes.push_back(id.sha256);
      sources.push_back(id.source);
      groups.push_back(id.group);
      scale_factors.push_back(id.scale_factor);
    }
    writer.texts(schema::kMaterialNames, names);
    writer.texts(schema::kMaterialFamilies, families);
    writer.texts(schema::kMaterialHashes, hashes);
    writer.texts(schema::kMaterialSources, sources);
    writer.texts(schema::kMaterialGroups, groups);
    writer.data_set<1>(schema::kMaterialScaleFactors, H5T_IEEE_F64LE,
                       {static_cast<hsize_t>(scale_factors.size())}, scale_factors.data());
    writer.data_set<1>(schema::kSingularValues, H5T_IEEE_F64LE,
                       {static_cast<hsize_t>(basis.singular_values.size())},
                       basis.singular_values.data());
    const Eigen::MatrixXd left_by_rows = basis.left_vectors.transpose();
    writer.data_set<2>(schema::kLeftVectors, H5T_IEEE_F64LE,
                       {static_cast<hsize_t>(basis.row_count()), k}, left_by_rows.data());
    writer.data_set<1>(schema::kCells, H5T_STD_U32LE, {p},
                       brdf::lattice::cells_above_horizon().data());
    writer.data_set<1>(schema::kMean, H5T_IEEE_F32LE, {p}, basis.mean.data());
    writer.data_set<2>(schema::kComponents, H5T_IEEE_F32LE, {p, k}, basis.components.data());
    writer.close();
  }
  file.commit();
}

}  // namespace gonio::basis
