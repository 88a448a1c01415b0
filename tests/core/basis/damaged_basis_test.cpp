#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "gonio/basis/basis_file.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

using test::refusal;
using test::small_basis;
using ::testing::HasSubstr;

/// One way to make a good file bad, and what the refusal must say.
struct Damage {
  const char* name;
  std::function<void(hid_t file)> inflict;
  std::vector<const char*> words;
};

void delete_link(hid_t file, const char* name) { ASSERT_GE(H5Ldelete(file, name, H5P_DEFAULT), 0); }

/// A data set that has a shape but no values: what a file claims costs it nothing.
void replace_by_claim(hid_t file, const char* name, hid_t type, std::vector<hsize_t> shape) {
  delete_link(file, name);
  const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  const hid_t set = H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  ASSERT_GE(set, 0);
  H5Dclose(set);
  H5Sclose(space);
}

template <typename Number>
void poke(hid_t file, const char* name, hid_t type, hsize_t rank, Number value) {
  const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
  const hid_t space = H5Dget_space(set);
  const hsize_t at[2] = {2, 1};
  H5Sselect_elements(space, H5S_SELECT_SET, 1, at);
  const hsize_t one = 1;
  const hid_t memory = H5Screate_simple(1, &one, nullptr);
  ASSERT_GE(H5Dwrite(set, type, memory, space, H5P_DEFAULT, &value), 0);
  ASSERT_EQ(H5Sget_simple_extent_ndims(space), static_cast<int>(rank));
  H5Sclose(memory);
  H5Sclose(space);
  H5Dclose(set);
}

/// `size`: of the text, or H5T_VARIABLE.
void replace_text(hid_t file, const char* name, std::size_t size, const char* text) {
  ASSERT_GE(H5Adelete(file, name), 0);
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, size);
  const hid_t space = H5Screate(H5S_SCALAR);
  const hid_t attribute = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  const void* const value = size == H5T_VARIABLE ? static_cast<const void*>(&text) : text;
  ASSERT_GE(H5Awrite(attribute, type, value), 0);
  H5Sclose(space);
  H5Tclose(type);
  H5Aclose(attribute);
}

template <typename Number>
void replace_number(hid_t file, const char* name, hid_t type, Number value) {
  const hid_t attribute = H5Aopen(file, name, H5P_DEFAULT);
  ASSERT_GE(H5Awrite(attribute, type, &value), 0);
  H5Aclose(attribute);
}

/// Changes all values of a data set of float32 or float64, as they lie in the file.
template <typename Number>
void change_all(hid_t file, const char* name, hid_t type,
                const std::function<void(std::vector<Number>& values)>& change) {
  const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
  const hid_t space = H5Dget_space(set);
  std::vector<Number> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  ASSERT_GE(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  change(values);
  ASSERT_GE(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space);
  H5Dclose(set);
}

using Floats = std::vector<float>;
using Doubles = std::vector<double>;

/// Orthonormal columns, but the first is the one that no centred row has a part of.
void add_mean_to_left_vectors(hid_t file) {
  std::vector<double> values(27, 0.0);
  const auto at = [&](std::size_t row, std::size_t column) -> double& {
    return values[3 * row + column];
  };
  for (std::size_t row = 0; row < 9; ++row) at(row, 0) = 1.0 / 3.0;
  at(0, 1) = at(2, 2) = std::sqrt(0.5);
  at(1, 1) = at(3, 2) = -std::sqrt(0.5);
  const hid_t set = H5Dopen2(file, "left_vectors", H5P_DEFAULT);
  ASSERT_GE(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Dclose(set);
}

constexpr hsize_t kCells = 1096216;

const std::vector<Damage>& damages() {
  static const std::vector<Damage> all = {
      {"missing data set", [](hid_t f) { delete_link(f, "mean"); }, {"mean", "missing"}},
      {"missing attribute",
       [](hid_t f) { H5Adelete(f, "radiometric_scale"); },
       {"radiometric_scale", "missing"}},
      {"other kind",
       [](hid_t f) { replace_text(f, "file_kind", 10, "gonio cake"); },
       {"file_kind", "gonio cake"}},
      {"later version",
       [](hid_t f) { replace_number(f, "format_version", H5T_NATIVE_INT, 99); },
       {"format_version", "found 99, expected 2", "later gonio"}},
      {"earlier version",
       [](hid_t f) { replace_number(f, "format_version", H5T_NATIVE_INT, 1); },
       {"format_version", "found 1, expected 2", "train again"}},
      {"other lattice",
       [](hid_t f) { replace_text(f, "lattice_convention", 9, "left_edge"); },
       {"lattice_convention", "left_edge", "bin_centre"}},
      {"unknown scale",
       [](hid_t f) { replace_text(f, "radiometric_scale", 7, "furlong"); },
       {"radiometric_scale", "furlong"}},
      {"negative epsilon",
       [](hid_t f) { replace_number(f, "mapping_epsilon", H5T_NATIVE_DOUBLE, -1.0); },
       {"mapping_epsilon"}},
      {"NaN floor",
       [](hid_t f) {
         replace_number(f, "mapping_cosine_floor", H5T_NATIVE_DOUBLE,
                        std::numeric_limits<double>::quiet_NaN());
       },
       {"mapping_cosine_floor"}},
      {"NaN component",
       [](hid_t f) {
         poke(f, "components", H5T_NATIVE_FLOAT, 2, std::numeric_limits<float>::quiet_NaN());
       },
       {"components", "NaN"}},
      {"infinite mean",
       [](hid_t f) {
         poke(f, "mean", H5T_NATIVE_FLOAT, 1, -std::numeric_limits<float>::infinity());
       },
       {"mean", "infinite"}},
      {"singular value 0",
       [](hid_t f) { poke(f, "singular_values", H5T_NATIVE_DOUBLE, 1, 0.0); },
       {"singular_values"}},
      {"training rows below 0",
       [](hid_t f) { replace_number(f, "training_rows", H5T_NATIVE_INT, -9); },
       {"training_rows", "found -9, expected 9"}},
      {"training rows of other materials",
       [](hid_t f) { replace_number(f, "training_rows", H5T_NATIVE_INT, 90); },
       {"training_rows", "found 90, expected 9"}},
      {"mean of no logarithm",
       [](hid_t f) { poke(f, "mean", H5T_NATIVE_FLOAT, 1, -3e4f); },
       {"mean", "found -30000 at 2", "within 100 of 0"}},
      {"singular values ascending",
       [](hid_t f) {
         change_all<double>(f, "singular_values", H5T_NATIVE_DOUBLE,
                            [](Doubles& values) { std::swap(values[0], values[1]); });
       },
       {"singular_values", "at 1 after", "expected descending"}},
      {"singular value below 0",
       [](hid_t f) {
         change_all<double>(f, "singular_values", H5T_NATIVE_DOUBLE,
                            [](Doubles& values) { values.back() = -1.0; });
       },
       {"singular_values", "found -1 at 7, expected at least 0"}},
      {"components of 0",
       [](hid_t f) {
         change_all<float>(f, "components", H5T_NATIVE_FLOAT,
                           [](Floats& values) { std::fill(values.begin(), values.end(), 0.0f); });
       },
       {"components", "found column 0 of length 0, expected its singular value"}},
      {"a component of another length",
       [](hid_t f) {
         change_all<float>(f, "components", H5T_NATIVE_FLOAT, [](Floats& values) {
           for (std::size_t i = 1; i < values.size(); i += 3) values[i] *= 1.05f;
         });
       },
       {"components", "found column 1 of length"}},
      {"components not at right angles",
       [](hid_t f) {
         // Column 1 turned by 6 degrees towards column 0, its length kept.
         change_all<float>(f, "components", H5T_NATIVE_FLOAT, [](Floats& values) {
           double squares[2] = {0.0, 0.0};
           for (std::size_t i = 0; i < values.size(); i += 3) {
             for (std::size_t c = 0; c < 2; ++c) squares[c] += values[i + c] * values[i + c];
           }
           const auto into = static_cast<float>(0.1 * std::sqrt(squares[1] / squares[0]));
           for (std::size_t i = 0; i < values.size(); i += 3) {
             values[i + 1] = 0.995f * values[i + 1] + into * values[i];
           }
         });
       },
       {"components", "found columns 0 and 1 with product", "right angles"}},
      {"a number for a text",
       [](hid_t f) {
         H5Adelete(f, "file_kind");
         const hid_t space = H5Screate(H5S_SCALAR);
         H5Aclose(H5Acreate2(f, "file_kind", H5T_STD_I32LE, space, H5P_DEFAULT, H5P_DEFAULT));
         H5Sclose(space);
       },
       {"file_kind", "not a text"}},
      {"a long text",
       [](hid_t f) { replace_text(f, "file_kind", 2000, std::string(2000, 'a').c_str()); },
       {"file_kind", "found a text of 2000 bytes, expected at most 1024"}},
      {"a text of variable length",
       [](hid_t f) { replace_text(f, "file_kind", H5T_VARIABLE, "gonio basis"); },
       {"root group", "a text of variable length"}},
      {"no left vectors",
       [](hid_t f) { delete_link(f, "left_vectors"); },
       {"left_vectors", "missing"}},
      {"NaN left vector",
       [](hid_t f) {
         poke(f, "left_vectors", H5T_NATIVE_DOUBLE, 2, std::numeric_limits<double>::quiet_NaN());
       },
       {"left_vectors", "NaN"}},
      {"left vectors of another length",
       [](hid_t f) { poke(f, "left_vectors", H5T_NATIVE_DOUBLE, 2, 0.5); },
       {"left_vectors", "not orthonormal"}},
      {"left vectors with a mean", add_mean_to_left_vectors, {"left_vectors", "sum to 0"}},
      {"left vectors of fewer rows",
       [](hid_t f) {
         replace_by_claim(f, "left_vectors", H5T_IEEE_F64LE, {hsize_t{1} << 40, 3});
       },
       {"left_vectors", "expected 9 x 3"}},
      {"left vectors without values",
       [](hid_t f) {
         replace_by_claim(f, "left_vectors", H5T_IEEE_F64LE, {9, 3});
       },
       {"left_vectors", "does not hold"}},
      {"moved cell", [](hid_t f) { poke(f, "cells", H5T_NATIVE_UINT32, 1, 77u); }, {"cells"}},
      {"huge components",
       [](hid_t f) {
         replace_by_claim(f, "components", H5T_IEEE_F32LE, {kCells, hsize_t{1} << 38});
       },
       {"components", "expected 1 to 8"}},
      {"overflowing components",
       [](hid_t f) {
         replace_by_claim(f, "components", H5T_IEEE_F32LE, {hsize_t{1} << 31, hsize_t{1} << 29});
       },
       {"components", "length"}},
      {"components without values",
       [](hid_t f) {
         replace_by_claim(f, "components", H5T_IEEE_F32LE, {kCells, 8});
       },
       {"components", "does not hold"}},
      {"too many components",
       [](hid_t f) {
         replace_by_claim(f, "components", H5T_IEEE_F32LE, {kCells, 9});
       },
       {"components", "found 9", "expected 1 to 8"}},
      {"components of rank 1",
       [](hid_t f) { replace_by_claim(f, "components", H5T_IEEE_F32LE, {kCells}); },
       {"components", "found 1 dimensions, expected 2"}},
      {"components in double",
       [](hid_t f) {
         replace_by_claim(f, "components", H5T_IEEE_F64LE, {kCells, 3});
       },
       {"components", "number format"}},
      {"billions of materials",
       [](hid_t f) {
         const hid_t type = H5Tcopy(H5T_C_S1);
         H5Tset_size(type, 8);
         H5Tset_cset(type, H5T_CSET_UTF8);
         H5Tset_strpad(type, H5T_STR_NULLPAD);
         replace_by_claim(f, "material_names", type, {hsize_t{1} << 40});
         H5Tclose(type);
       },
       {"material_names", "at most"}},
      {"long texts",
       [](hid_t f) {
         const hid_t type = H5Tcopy(H5T_C_S1);
         H5Tset_size(type, std::size_t{1} << 31);
         replace_by_claim(f, "material_families", type, {3});
         H5Tclose(type);
       },
       {"material_families", "bytes"}},
      {"sources of fewer materials",
       [](hid_t f) {
         const hid_t type = H5Tcopy(H5T_C_S1);
         H5Tset_size(type, 3);
         H5Tset_cset(type, H5T_CSET_UTF8);
         H5Tset_strpad(type, H5T_STR_NULLPAD);
         replace_by_claim(f, "material_sources", type, {2});
         H5Tclose(type);
       },
       {"material_sources"}},
      {"scale factor 0",
       [](hid_t f) { poke(f, "material_scale_factors", H5T_NATIVE_DOUBLE, 1, 0.0); },
       {"material_scale_factors", "above 0"}},
      {"NaN scale factor",
       [](hid_t f) {
         poke(f, "material_scale_factors", H5T_NATIVE_DOUBLE, 1,
              std::numeric_limits<double>::quiet_NaN());
       },
       {"material_scale_factors", "nan"}},
      {"scale factors of fewer materials",
       [](hid_t f) { replace_by_claim(f, "material_scale_factors", H5T_IEEE_F64LE, {2}); },
       {"material_scale_factors"}},
      {"link to another file",
       [](hid_t f) {
         delete_link(f, "components");
         H5Lcreate_external("whole.h5", "/components", f, "components", H5P_DEFAULT, H5P_DEFAULT);
       },
       {"components", "link"}},
      {"names in another file",
       [](hid_t f) {
         delete_link(f, "material_names");
         H5Lcreate_external("whole.h5", "/material_names", f, "material_names", H5P_DEFAULT,
                            H5P_DEFAULT);
       },
       {"material_names", "link"}},
  };
  return all;
}

TEST(DamagedBasis, ThatIsHostileIsRefusedByName) {
  const TemporaryFolder folder;
  write_basis(folder / "whole.h5", small_basis());
  for (const Damage& damage : damages()) {
    SCOPED_TRACE(damage.name);
    std::filesystem::copy_file(folder / "whole.h5", folder / "bad.h5",
                               std::filesystem::copy_options::overwrite_existing);
    const hid_t file = H5Fopen((folder / "bad.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(file, 0);
    damage.inflict(file);
    H5Fclose(file);
    const std::string message = refusal(folder / "bad.h5");
    EXPECT_THAT(message, HasSubstr("bad.h5: "));
    for (const char* word : damage.words) EXPECT_THAT(message, HasSubstr(word));
  }
}

}  // namespace
}  // namespace gonio::basis
