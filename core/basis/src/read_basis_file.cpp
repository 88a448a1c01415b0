#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "basis_checks.h"
#include "basis_schema.h"
#include "gonio/basis/basis_file.h"
#include "gonio/errors/errors.h"
#include "gonio/files/input_file.h"
#include "gonio/parallel/parallel.h"
#include "hdf5_handles.h"

namespace gonio::basis {
namespace {

using detail::H5Handle;

static_assert(std::endian::native == std::endian::little,
              "values are read as they stand in the file");

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path), file_(open(path)) {
    file_bytes_ = std::filesystem::file_size(path);
  }

  std::string text_attribute(const char* name) const {
    const H5Handle attribute = open_attribute(name);
    const H5Handle type(H5Aget_type(attribute.get()), H5Tclose);
    if (H5Tget_class(type.get()) != H5T_STRING) fail(name, "attribute is not a text");
    const htri_t variable = H5Tis_variable_str(type.get());
    if (variable <= 0) return fixed_text(name, attribute, H5Tget_size(type.get()));
    // Of an earlier gonio or another program.
    char* raw = nullptr;
    const H5Handle memory = detail::text_type();
    H5Tset_cset(memory.get(), H5Tget_cset(type.get()));
    if (H5Aread(attribute.get(), memory.get(), &raw) < 0) fail(name, "attribute cannot be read");
    const std::string text = raw == nullptr ? "" : raw;
    H5free_memory(raw);
    return text;
  }

  template <typename Number>
  Number number_attribute(const char* name) const {
    const H5Handle attribute = open_attribute(name);
    const H5Handle type(H5Aget_type(attribute.get()), H5Tclose);
    const bool whole = std::is_integral_v<Number>;
    if (H5Tget_class(type.get()) != (whole ? H5T_INTEGER : H5T_FLOAT)) {
      fail(name, whole ? "attribute is not a whole number" : "attribute is not a float");
    }
    Number value{};
    if (H5Aread(attribute.get(), whole ? H5T_NATIVE_INT : H5T_NATIVE_DOUBLE, &value) < 0) {
      fail(name, "attribute cannot be read");
    }
    return value;
  }

  /// A contiguous data set of this rank and type whose bytes lie in this very file.
  struct DataSet {
    H5Handle set;
    std::vector<hsize_t> shape;
  };
  DataSet open_set(const char* name, hid_t type, int rank) const {
    require_own_object(name);
    DataSet found{H5Handle(H5Dopen2(file_.get(), name, H5P_DEFAULT), H5Dclose), {}};
    if (!found.set.valid()) fail(name, "is not a readable data set");
    const H5Handle stored(H5Dget_type(found.set.get()), H5Tclose);
    if (H5Tequal(stored.get(), type) <= 0) fail(name, "has another number format than expected");
    const H5Handle space(H5Dget_space(found.set.get()), H5Sclose);
    const int dimensions = H5Sget_simple_extent_ndims(space.get());
    if (dimensions != rank) {
      fail(name,
           "found " + std::to_string(dimensions) + " dimensions, expected " + std::to_string(rank));
    }
    found.shape.resize(static_cast<std::size_t>(rank));
    H5Sget_simple_extent_dims(space.get(), found.shape.data(), nullptr);
    const H5Handle creation(H5Dget_create_plist(found.set.get()), H5Pclose);
    if (H5Pget_layout(creation.get()) != H5D_CONTIGUOUS ||
        H5Pget_external_count(creation.get()) != 0) {
      fail(name, "is not stored contiguously in this file (h5repack -l CONTI makes it so)");
    }
    return found;
  }

  bool has(const char* name) const { return H5Lexists(file_.get(), name, H5P_DEFAULT) > 0; }

  /// Refuses what is missing or a link, which could lead into any other file.
  void require_own_object(const char* name) const {
    H5L_info_t link{};
    if (H5Lexists(file_.get(), name, H5P_DEFAULT) <= 0 ||
        H5Lget_info(file_.get(), name, &link, H5P_DEFAULT) < 0) {
      fail(name, "data set is missing");
    }
    if (link.type != H5L_TYPE_HARD) fail(name, "is a link out of the file, expected a data set");
  }

  void expect_length(const char* name, hsize_t found, std::size_t expected) const {
    if (found != expected) {
      fail(name,
           "found length " + std::to_string(found) + ", expected " + std::to_string(expected));
    }
  }

  /// Call before allocating: refuses a data set whose values the file does not hold.
  void expect_stored(const char* name, const DataSet& data, std::uintmax_t bytes) const {
    if (bytes > file_bytes_ || H5Dget_storage_size(data.set.get()) != bytes) {
      fail(name, "the file does not hold the values its shape promises");
    }
    const haddr_t offset = H5Dget_offset(data.set.get());
    if (offset == HADDR_UNDEF || offset > file_bytes_ - bytes) {
      fail(name, "the values lie beyond the end of the file");
    }
  }

  void read(const char* name, const DataSet& data, hid_t type, void* out) const {
    if (H5Dread(data.set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out) < 0) {
      fail(name, "cannot be read: " + detail::last_h5_message());
    }
  }

  /// Many float32 values, refused unless finite. Around HDF5, which copies on one thread and would
  /// leave the check a second pass over memory: the data set is contiguous in the file that is
  /// open.
  void read_finite(const char* name, const DataSet& data, float* out, std::size_t count) const {
    constexpr std::size_t kBlock = 1 << 18;  // a megabyte: checked while it is in the cache
    void* handle = nullptr;
    if (H5Fget_vfd_handle(file_.get(), H5P_DEFAULT, &handle) < 0 || handle == nullptr) {
      fail(name, "cannot be read: " + detail::last_h5_message());
    }
    const int descriptor = *static_cast<const int*>(handle);
    const haddr_t begin_of_values = H5Dget_offset(data.set.get());
    parallel::for_each_block(0, count, kBlock, [&](std::size_t begin, std::size_t end) {
      char* const to = reinterpret_cast<char*>(out + begin);
      const std::size_t bytes = (end - begin) * sizeof(float);
      for (std::size_t done = 0; done < bytes;) {
        const ssize_t got =
            ::pread(descriptor, to + done, bytes - done,
                    static_cast<off_t>(begin_of_values + begin * sizeof(float) + done));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw FileError(path_, std::string("read ") + name, errno);
        if (got == 0) fail(name, "the file ends before its values do");
        done += static_cast<std::size_t>(got);
      }
      // Infinity and NaN have all exponent bits set; an integer maximum is vectorised.
      std::uint32_t largest = 0;
      for (std::size_t i = begin; i < end; ++i) {
        largest = std::max(largest, std::bit_cast<std::uint32_t>(out[i]) & 0x7fffffffu);
      }
      if (largest >= 0x7f800000u) fail(name, "holds a value that is NaN or infinite");
    });
  }

  std::vector<std::string> texts(const char* name) const;

  [[noreturn]] void fail(const std::string& place, const std::string& message) const {
    throw DataFormatError(path_, place, message);
  }

 private:
  static H5Handle open(const std::filesystem::path& path) {
    files::require_regular_file(path);
    H5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (!file.valid()) {
      throw DataFormatError(path, "file", "not a readable HDF5 file, expected a gonio basis");
    }
    return file;
  }

  std::string fixed_text(const char* name, const H5Handle& attribute, std::size_t width) const {
    if (width > schema::kLongestText) {
      fail(name, "found a text of " + std::to_string(width) + " bytes, expected at most " +
                     std::to_string(schema::kLongestText));
    }
    std::string text(width, '\0');
    const H5Handle stored(H5Aget_type(attribute.get()), H5Tclose);
    if (H5Aread(attribute.get(), stored.get(), text.data()) < 0) {
      fail(name, "attribute cannot be read");
    }
    text.erase(std::min(text.find('\0'), width));
    return text;
  }

  H5Handle open_attribute(const char* name) const {
    H5Handle attribute(H5Aopen(file_.get(), name, H5P_DEFAULT), H5Aclose);
    if (!attribute.valid()) fail(name, "attribute is missing");
    const H5Handle space(H5Aget_space(attribute.get()), H5Sclose);
    if (H5Sget_simple_extent_npoints(space.get()) != 1) fail(name, "attribute is not one value");
    return attribute;
  }

  std::filesystem::path path_;
  H5Handle file_;
  std::uintmax_t file_bytes_ = 0;
};

std::vector<std::string> Reader::texts(const char* name) const {
  require_own_object(name);
  std::size_t width = 0;
  {
    const H5Handle probe(H5Dopen2(file_.get(), name, H5P_DEFAULT), H5Dclose);
    const H5Handle type(probe.valid() ? H5Dget_type(probe.get()) : H5I_INVALID_HID, H5Tclose);
    if (!type.valid() || H5Tget_class(type.get()) != H5T_STRING ||
        H5Tis_variable_str(type.get()) != 0) {
      fail(name, "is not a data set of strings of fixed length");
    }
    width = H5Tget_size(type.get());
  }
  if (width == 0 || width > schema::kLongestText) {
    fail(name, "texts of " + std::to_string(width) + " bytes, at most " +
                   std::to_string(schema::kLongestText) + " expected");
  }
  const H5Handle type = detail::fixed_text_type(width);
  const DataSet data = open_set(name, type.get(), 1);
  if (data.shape[0] > schema::kMostMaterials) {
    fail(name, "found " + std::to_string(data.shape[0]) + " materials, at most " +
                   std::to_string(schema::kMostMaterials) + " expected");
  }
  const std::size_t count = static_cast<std::size_t>(data.shape[0]);
  if (count == 0) fail(name, "there are no materials");
  expect_stored(name, data, count * width);
  std::string padded(count * width, '\0');
  read(name, data, type.get(), padded.data());
  std::vector<std::string> found(count);
  for (std::size_t i = 0; i < count; ++i) {
    found[i] = padded.substr(i * width, width);
    found[i].erase(std::min(found[i].find('\0'), width));
  }
  return found;
}

void check_header(const Reader& reader) {
  const auto expect = [&](const char* name, const std::string& found, const std::string& wanted) {
    if (found != wanted) reader.fail(name, "found '" + found + "', expected '" + wanted + "'");
  };
  expect(schema::kAttributeKind, reader.text_attribute(schema::kAttributeKind), schema::kFileKind);
  const int version = reader.number_attribute<int>(schema::kAttributeVersion);
  if (version != schema::kVersion) {
    reader.fail(schema::kAttributeVersion,
                "found " + std::to_string(version) + ", expected " +
                    std::to_string(schema::kVersion) +
                    (version < schema::kVersion ? ": written by an earlier gonio, train again"
                                                : ": written by a later gonio"));
  }
  expect(schema::kAttributeConvention, reader.text_attribute(schema::kAttributeConvention),
         std::string(to_string(brdf::IndexConvention::bin_centre)));
}

LogMapping read_mapping(const Reader& reader) {
  LogMapping mapping;
  mapping.epsilon = reader.number_attribute<double>(schema::kAttributeEpsilon);
  mapping.cosine_floor = reader.number_attribute<double>(schema::kAttributeFloor);
  if (!(mapping.epsilon > 1e-30 && mapping.epsilon < 1e30)) {
    reader.fail(schema::kAttributeEpsilon,
                "found " + std::to_string(mapping.epsilon) + ", expected a positive number");
  }
  if (!(mapping.cosine_floor > 0.0 && mapping.cosine_floor <= 1.0)) {
    reader.fail(schema::kAttributeFloor,
                "found " + std::to_string(mapping.cosine_floor) + ", expected a number in (0, 1]");
  }
  return mapping;
}

brdf::RadiometricScale read_scale(const Reader& reader) {
  const std::string name = reader.text_attribute(schema::kAttributeScale);
  try {
    return brdf::radiometric_scale_from_string(name);
  } catch (const std::invalid_argument& error) {
    reader.fail(schema::kAttributeScale, error.what());
  }
}

void read_scale_factors(const Reader& reader, std::vector<MaterialId>& materials) {
  const char* const name = schema::kMaterialScaleFactors;
  const Reader::DataSet data = reader.open_set(name, H5T_IEEE_F64LE, 1);
  reader.expect_length(name, data.shape[0], materials.size());
  reader.expect_stored(name, data, materials.size() * sizeof(double));
  std::vector<double> factors(materials.size());
  reader.read(name, data, H5T_NATIVE_DOUBLE, factors.data());
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (!(factors[i] > 0.0 && std::isfinite(factors[i]))) {
      reader.fail(name, "found " + std::to_string(factors[i]) + " for " + materials[i].name +
                            ", expected a finite number above 0");
    }
    materials[i].scale_factor = factors[i];
  }
}

std::vector<MaterialId> read_materials(const Reader& reader) {
  std::vector<std::string> names = reader.texts(schema::kMaterialNames);
  std::vector<std::string> families = reader.texts(schema::kMaterialFamilies);
  std::vector<std::string> hashes = reader.texts(schema::kMaterialHashes);
  reader.expect_length(schema::kMaterialFamilies, families.size(), names.size());
  reader.expect_length(schema::kMaterialHashes, hashes.size(), names.size());
  std::vector<MaterialId> materials(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    materials[i] = {std::move(names[i]), std::move(families[i]), std::move(hashes[i])};
  }
  if (reader.has(schema::kMaterialSources)) {
    std::vector<std::string> sources = reader.texts(schema::kMaterialSources);
    reader.expect_length(schema::kMaterialSources, sources.size(), materials.size());
    for (std::size_t i = 0; i < sources.size(); ++i) materials[i].source = std::move(sources[i]);
  }
  if (reader.has(schema::kMaterialScaleFactors)) read_scale_factors(reader, materials);
  return materials;
}

/// Orthonormal to the accuracy of the eigensolver, with room for another program's.
constexpr double kOrthonormalTolerance = 1e-6;

Eigen::MatrixXd read_left_vectors(const Reader& reader, std::size_t rows, std::size_t k) {
  const char* const name = schema::kLeftVectors;
  const Reader::DataSet set = reader.open_set(name, H5T_IEEE_F64LE, 2);
  if (set.shape[0] != rows || set.shape[1] != k) {
    reader.fail(name, "found shape " + std::to_string(set.shape[0]) + " x " +
                          std::to_string(set.shape[1]) + ", expected " + std::to_string(rows) +
                          " x " + std::to_string(k));
  }
  reader.expect_stored(name, set, rows * k * sizeof(double));
  Eigen::MatrixXd by_rows(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(rows));
  reader.read(name, set, H5T_NATIVE_DOUBLE, by_rows.data());
  if (!by_rows.allFinite()) reader.fail(name, "holds a value that is NaN or infinite");
  Eigen::MatrixXd product = by_rows * by_rows.transpose();
  product.diagonal().array() -= 1.0;
  if (!(product.cwiseAbs().maxCoeff() < kOrthonormalTolerance)) {
    reader.fail(name, "columns are not orthonormal");
  }
  if (!(by_rows.rowwise().sum().cwiseAbs().maxCoeff() < kOrthonormalTolerance)) {
    reader.fail(name, "columns do not sum to 0, as those of centred rows do");
  }
  return by_rows.transpose();
}

Basis read_checked(const Reader& reader) {
  check_header(reader);
  Basis basis;
  basis.mapping = read_mapping(reader);
  basis.scale = read_scale(reader);
  basis.materials = read_materials(reader);
  const std::size_t rows = 3 * basis.materials.size();
  const int claimed = reader.number_attribute<int>(schema::kAttributeRows);
  if (claimed != basis.row_count()) {
    reader.fail(schema::kAttributeRows, "found " + std::to_string(claimed) + ", expected " +
                                            std::to_string(rows) + ", three for each material");
  }

  const std::vector<std::uint32_t>& cells = brdf::lattice::cells_above_horizon();
  const std::size_t p = cells.size();
  const Reader::DataSet cell_set = reader.open_set(schema::kCells, H5T_STD_U32LE, 1);
  reader.expect_length(schema::kCells, cell_set.shape[0], p);
  reader.expect_stored(schema::kCells, cell_set, p * sizeof(std::uint32_t));
  std::vector<std::uint32_t> found_cells(p);
  reader.read(schema::kCells, cell_set, H5T_NATIVE_UINT32, found_cells.data());
  if (found_cells != cells) {
    reader.fail(schema::kCells, "are not the bin centres above the horizon");
  }

  const Reader::DataSet values = reader.open_set(schema::kSingularValues, H5T_IEEE_F64LE, 1);
  reader.expect_length(schema::kSingularValues, values.shape[0], rows - 1);
  reader.expect_stored(schema::kSingularValues, values, (rows - 1) * sizeof(double));
  basis.singular_values.resize(static_cast<Eigen::Index>(rows - 1));
  reader.read(schema::kSingularValues, values, H5T_NATIVE_DOUBLE, basis.singular_values.data());

  const Reader::DataSet mean = reader.open_set(schema::kMean, H5T_IEEE_F32LE, 1);
  reader.expect_length(schema::kMean, mean.shape[0], p);
  reader.expect_stored(schema::kMean, mean, p * sizeof(float));
  basis.mean.resize(static_cast<Eigen::Index>(p));
  reader.read_finite(schema::kMean, mean, basis.mean.data(), p);

  const Reader::DataSet components = reader.open_set(schema::kComponents, H5T_IEEE_F32LE, 2);
  reader.expect_length(schema::kComponents, components.shape[0], p);
  const hsize_t k = components.shape[1];
  if (k < 1 || k > rows - 1) {
    reader.fail(schema::kComponents, "found " + std::to_string(k) + " components, expected 1 to " +
                                         std::to_string(rows - 1));
  }
  const std::size_t count = p * static_cast<std::size_t>(k);
  reader.expect_stored(schema::kComponents, components, count * sizeof(float));
  basis.components.resize(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(k));
  reader.read_finite(schema::kComponents, components, basis.components.data(), count);

  basis.left_vectors = read_left_vectors(reader, rows, static_cast<std::size_t>(k));

  const auto leading = basis.singular_values.head(static_cast<Eigen::Index>(k)).array();
  if (!basis.singular_values.allFinite() || !(leading > 0.0).all()) {
    reader.fail(schema::kSingularValues, "are not all finite, or not positive where used");
  }
  if (const auto found = detail::contradiction_in(basis)) {
    reader.fail(found->data_set, found->message);
  }
  return basis;
}

}  // namespace

Basis read_basis(const std::filesystem::path& path) {
  const std::lock_guard lock(schema::library_mutex());
  const detail::SilentH5Errors silent;
  return read_checked(Reader(path));
}

}  // namespace gonio::basis
