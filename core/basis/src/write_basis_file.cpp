#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "basis_schema.h"
#include "gonio/basis/basis_file.h"
#include "gonio/errors/errors.h"
#include "hdf5_handles.h"

namespace gonio::basis {
namespace {

using detail::H5Handle;

class Writer {
 public:
  explicit Writer(files::AtomicFile& file) : target_(file.target()), file_(create(file)) {}

  void attribute(const char* name, const char* text) {
    write_attribute(name, detail::text_type(), &text);
  }
  void attribute(const char* name, double value) {
    write_attribute(name, H5Handle(H5Tcopy(H5T_IEEE_F64LE), H5Tclose), &value);
  }
  void attribute(const char* name, int value) {
    write_attribute(name, H5Handle(H5Tcopy(H5T_STD_I32LE), H5Tclose), &value);
  }

  template <std::size_t Rank>
  void data_set(const char* name, hid_t type, const std::array<hsize_t, Rank>& shape,
                const void* data) {
    const H5Handle space(check(H5Screate_simple(Rank, shape.data(), nullptr), name), H5Sclose);
    const H5Handle creation(check(H5Pcreate(H5P_DATASET_CREATE), name), H5Pclose);
    // No time stamps: the same basis gives the same bytes.
    check(H5Pset_obj_track_times(creation.get(), false), name);
    check(H5Pset_fill_time(creation.get(), H5D_FILL_TIME_NEVER), name);
    const H5Handle set(check(H5Dcreate2(file_.get(), name, type, space.get(), H5P_DEFAULT,
                                        creation.get(), H5P_DEFAULT),
                             name),
                       H5Dclose);
    check(H5Dwrite(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), name);
  }

  void texts(const char* name, const std::vector<std::string>& texts) {
    std::size_t width = 1;
    for (const std::string& text : texts) width = std::max(width, text.size());
    std::string padded(width * texts.size(), '\0');
    for (std::size_t i = 0; i < texts.size(); ++i) texts[i].copy(&padded[i * width], width);
    data_set<1>(name, detail::fixed_text_type(width).get(), {texts.size()}, padded.data());
  }

  void close() {
    if (!file_.close()) fail("the end of the file");
  }

 private:
  H5Handle create(files::AtomicFile& file) {
    const H5Handle access(check(H5Pcreate(H5P_FILE_ACCESS), "access"), H5Pclose);
    // Large data sets start on a page, so that they can be mapped or read around the cache.
    check(H5Pset_alignment(access.get(), 1 << 20, 4096), "alignment");
    return {
        check(H5Fcreate(file.temporary_path().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()),
              "the file"),
        H5Fclose};
  }

  void write_attribute(const char* name, const H5Handle& type, const void* value) {
    const H5Handle space(check(H5Screate(H5S_SCALAR), name), H5Sclose);
    const H5Handle attribute(
        check(H5Acreate2(file_.get(), name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
              name),
        H5Aclose);
    check(H5Awrite(attribute.get(), type.get(), value), name);
  }

  template <typename Result>
  Result check(Result result, const char* what) const {
    if (result < 0) fail(what);
    return result;
  }

  [[noreturn]] void fail(const char* what) const {
    const std::string reason = detail::last_h5_message();
    throw FileError(target_, std::string("write ") + what,
                    reason.empty() ? std::string("HDF5 failed") : reason);
  }

  std::filesystem::path target_;
  H5Handle file_;
};

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
    for (const std::string* text : {&id.name, &id.family, &id.sha256}) {
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
    Writer writer(file);
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
                     std::string(to_string(brdf::IndexConvention::bin_centre)).c_str());
    writer.attribute("cell_number", "phi_d + 180 (theta_d + 90 theta_h), indices of the lattice");
    writer.attribute(schema::kAttributeScale, std::string(to_string(basis.scale)).c_str());
    writer.attribute("training_rows", basis.row_count());
    writer.attribute("prior", "c ~ N(0, I/training_rows)");
    writer.attribute("eta_rule", "eta = training_rows sigma^2, sigma in the mapped domain");

    const hsize_t p = static_cast<hsize_t>(basis.components.rows());
    const hsize_t k = static_cast<hsize_t>(basis.components.cols());
    std::vector<std::string> names, families, hashes;
    std::vector<double> scale_factors;
    for (const MaterialId& id : basis.materials) {
      names.push_back(id.name);
      families.push_back(id.family);
      hashes.push_back(id.sha256);
      scale_factors.push_back(id.scale_factor);
    }
    writer.texts(schema::kMaterialNames, names);
    writer.texts(schema::kMaterialFamilies, families);
    writer.texts(schema::kMaterialHashes, hashes);
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
