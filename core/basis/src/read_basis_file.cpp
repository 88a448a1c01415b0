#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "basis_checks.h"
#include "basis_schema.h"
#include "gonio/basis/basis_file.h"
#include "gonio/errors/errors.h"
#include "hdf5_reader.h"

namespace gonio::basis {
namespace {

using detail::Hdf5Reader;

void check_header(const Hdf5Reader& reader) {
  const auto expect = [&](const char* name, const std::string& found, const std::string& wanted) {
    if (found != wanted) reader.fail(name, "found '" + found + "', expected '" + wanted + "'");
  };
  expect(schema::kAttributeKind, reader.text_attribute(schema::kAttributeKind), schema::kFileKind);
  const int version = reader.int_attribute(schema::kAttributeVersion);
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

LogMapping read_mapping(const Hdf5Reader& reader) {
  LogMapping mapping;
  mapping.epsilon = reader.double_attribute(schema::kAttributeEpsilon);
  mapping.cosine_floor = reader.double_attribute(schema::kAttributeFloor);
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

brdf::RadiometricScale read_scale(const Hdf5Reader& reader) {
  const std::string name = reader.text_attribute(schema::kAttributeScale);
  try {
    return brdf::radiometric_scale_from_string(name);
  } catch (const std::invalid_argument& error) {
    reader.fail(schema::kAttributeScale, error.what());
  }
}

void read_scale_factors(const Hdf5Reader& reader, std::vector<MaterialId>& materials) {
  const char* const name = schema::kMaterialScaleFactors;
  const Hdf5Reader::DataSet data = reader.open_set(name, H5T_IEEE_F64LE, 1);
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

std::vector<MaterialId> read_materials(const Hdf5Reader& reader) {
  std::vector<std::string> names = reader.texts(schema::kMaterialNames);
  std::vector<std::string> families = reader.texts(schema::kMaterialFamilies);
  std::vector<std::string> hashes = reader.texts(schema::kMaterialHashes);
  reader.expect_length(schema::kMaterialFamilies, families.size(), names.size());
  reader.expect_length(schema::kMaterialHashes, hashes.size(), names.size());
  std::vector<MaterialId> materials(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    materials[i] = {std::move(names[i]), std::move(families[i]), std::move(hashes[i])};
  }
  const auto read_optional = [&](const char* name, std::string MaterialId::*text) {
    if (!reader.has(name)) return;
    std::vector<std::string> texts = reader.texts(name);
    reader.expect_length(name, texts.size(), materials.size());
    for (std::size_t i = 0; i < texts.size(); ++i) materials[i].*text = std::move(texts[i]);
  };
  read_optional(schema::kMaterialSources, &MaterialId::source);
  read_optional(schema::kMaterialGroups, &MaterialId::group);
  if (reader.has(schema::kMaterialScaleFactors)) read_scale_factors(reader, materials);
  return materials;
}

/// Orthonormal to the accuracy of the eigensolver, with room for another program's.
constexpr double kOrthonormalTolerance = 1e-6;

Eigen::MatrixXd read_left_vectors(const Hdf5Reader& reader, std::size_t rows, std::size_t k) {
  const char* const name = schema::kLeftVectors;
  const Hdf5Reader::DataSet set = reader.open_set(name, H5T_IEEE_F64LE, 2);
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

Basis read_checked(const Hdf5Reader& reader) {
  check_header(reader);
  Basis basis;
  basis.mapping = read_mapping(reader);
  basis.scale = read_scale(reader);
  basis.materials = read_materials(reader);
  const std::size_t rows = 3 * basis.materials.size();
  const int claimed = reader.int_attribute(schema::kAttributeRows);
  if (claimed != basis.row_count()) {
    reader.fail(schema::kAttributeRows, "found " + std::to_string(claimed) + ", expected " +
                                            std::to_string(rows) + ", three for each material");
  }

  const std::vector<std::uint32_t>& cells = brdf::lattice::cells_above_horizon();
  const std::size_t p = cells.size();
  const Hdf5Reader::DataSet cell_set = reader.open_set(schema::kCells, H5T_STD_U32LE, 1);
  reader.expect_length(schema::kCells, cell_set.shape[0], p);
  reader.expect_stored(schema::kCells, cell_set, p * sizeof(std::uint32_t));
  std::vector<std::uint32_t> found_cells(p);
  reader.read(schema::kCells, cell_set, H5T_NATIVE_UINT32, found_cells.data());
  if (found_cells != cells) {
    reader.fail(schema::kCells, "are not the bin centres above the horizon");
  }

  const Hdf5Reader::DataSet values = reader.open_set(schema::kSingularValues, H5T_IEEE_F64LE, 1);
  reader.expect_length(schema::kSingularValues, values.shape[0], rows - 1);
  reader.expect_stored(schema::kSingularValues, values, (rows - 1) * sizeof(double));
  basis.singular_values.resize(static_cast<Eigen::Index>(rows - 1));
  reader.read(schema::kSingularValues, values, H5T_NATIVE_DOUBLE, basis.singular_values.data());

  const Hdf5Reader::DataSet mean = reader.open_set(schema::kMean, H5T_IEEE_F32LE, 1);
  reader.expect_length(schema::kMean, mean.shape[0], p);
  reader.expect_stored(schema::kMean, mean, p * sizeof(float));
  basis.mean.resize(static_cast<Eigen::Index>(p));
  reader.read_finite(schema::kMean, mean, basis.mean.data(), p);

  const Hdf5Reader::DataSet components = reader.open_set(schema::kComponents, H5T_IEEE_F32LE, 2);
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
  return read_checked(Hdf5Reader(path));
}

}  // namespace gonio::basis
