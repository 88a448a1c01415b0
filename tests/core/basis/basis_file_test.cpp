#include "gonio/basis/basis_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>

#include "gonio/errors/errors.h"
#include "temporary_folder.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Basis small_basis() {
  return train(test::training_set(), test::training_gram(), std::vector<std::size_t>{0, 1, 3}, 3);
}

std::string refusal(const std::filesystem::path& path) {
  try {
    read_basis(path);
  } catch (const DataFormatError& error) {
    return error.what();
  } catch (const std::exception& error) {
    return std::string("another exception: ") + error.what();
  }
  return "accepted";
}

TEST(BasisFile, ReturnsWhatWasWritten) {
  const TemporaryFolder folder;
  Basis written = small_basis();
  written.materials[1].scale_factor = 2.75;
  written.materials[1].source = "rgl";
  write_basis(folder / "a.h5", written);
  const Basis read = read_basis(folder / "a.h5");
  EXPECT_EQ(read.components, written.components);
  EXPECT_EQ(read.mean, written.mean);
  EXPECT_EQ(read.singular_values, written.singular_values);
  EXPECT_EQ(read.left_vectors, written.left_vectors);
  EXPECT_EQ(read.mapping, written.mapping);
  EXPECT_EQ(read.scale, written.scale);
  ASSERT_EQ(read.materials.size(), 3u);
  EXPECT_EQ(read.materials[0].scale_factor, 1.0);
  EXPECT_EQ(read.materials[1].scale_factor, 2.75);
  EXPECT_EQ(read.materials[0].source, "");
  EXPECT_EQ(read.materials[1].source, "rgl");
  EXPECT_EQ(read.materials[2].name, "lobe-3");
  EXPECT_EQ(read.materials[2].family, "odd");
  EXPECT_EQ(read.materials[2].sha256, written.materials[2].sha256);
  EXPECT_EQ(read.materials[2].sha256.size(), 64u);
}

TEST(BasisFile, HasTheSameBytesEveryTime) {
  const TemporaryFolder folder;
  write_basis(folder / "a.h5", small_basis());
  write_basis(folder / "b.h5", read_basis(folder / "a.h5"));
  EXPECT_TRUE(read_bytes(folder / "a.h5") == read_bytes(folder / "b.h5"));
}

TEST(BasisFile, IsNotReplacedUnlessAskedFor) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.h5") << "precious";
  EXPECT_THROW(write_basis(folder / "a.h5", small_basis()), FileError);
  EXPECT_EQ(read_bytes(folder / "a.h5"), "precious");
  write_basis(folder / "a.h5", small_basis(), files::Overwrite::Yes);
  EXPECT_EQ(refusal(folder / "a.h5"), "accepted");
  const auto entries = std::distance(std::filesystem::directory_iterator(folder.path()),
                                     std::filesystem::directory_iterator());
  EXPECT_EQ(entries, 1) << "a temporary file was left";
}

TEST(BasisFile, IsNotWrittenFromPartsThatDoNotFit) {
  const TemporaryFolder folder;
  Basis basis = small_basis();
  basis.materials.pop_back();
  EXPECT_THROW(write_basis(folder / "a.h5", basis), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
}

TEST(BasisFile, CannotBeReadWhenItIsNotThere) {
  const TemporaryFolder folder;
  EXPECT_THROW(read_basis(folder / "none.h5"), FileError);
  EXPECT_THROW(read_basis(folder.path()), FileError);
}

TEST(BasisFile, ThatIsNotHdf5OrEndsEarlyIsRefused) {
  const TemporaryFolder folder;
  std::ofstream(folder / "text.h5") << "theta_h_deg,theta_d_deg";
  EXPECT_THAT(refusal(folder / "text.h5"), HasSubstr("not a readable HDF5 file"));
  std::ofstream(folder / "empty.h5").close();
  EXPECT_THAT(refusal(folder / "empty.h5"), HasSubstr("not a readable HDF5 file"));

  write_basis(folder / "whole.h5", small_basis());
  const auto size = std::filesystem::file_size(folder / "whole.h5");
  for (const auto part : {size / 2, size - 1, std::uintmax_t{5000}, std::uintmax_t{600}}) {
    std::filesystem::copy_file(folder / "whole.h5", folder / "part.h5",
                               std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(folder / "part.h5", part);
    EXPECT_THAT(refusal(folder / "part.h5"), HasSubstr("part.h5: ")) << part << " bytes";
  }
}

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

void replace_text(hid_t file, const char* name, const char* text) {
  const hid_t attribute = H5Aopen(file, name, H5P_DEFAULT);
  const hid_t type = H5Aget_type(attribute);
  ASSERT_GE(H5Awrite(attribute, type, &text), 0);
  H5Tclose(type);
  H5Aclose(attribute);
}

template <typename Number>
void replace_number(hid_t file, const char* name, hid_t type, Number value) {
  const hid_t attribute = H5Aopen(file, name, H5P_DEFAULT);
  ASSERT_GE(H5Awrite(attribute, type, &value), 0);
  H5Aclose(attribute);
}

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
       [](hid_t f) { replace_text(f, "file_kind", "gonio cake"); },
       {"file_kind", "gonio cake"}},
      {"later version",
       [](hid_t f) { replace_number(f, "format_version", H5T_NATIVE_INT, 99); },
       {"format_version", "found 99, expected 2", "later gonio"}},
      {"earlier version",
       [](hid_t f) { replace_number(f, "format_version", H5T_NATIVE_INT, 1); },
       {"format_version", "found 1, expected 2", "train again"}},
      {"other lattice",
       [](hid_t f) { replace_text(f, "lattice_convention", "left_edge"); },
       {"lattice_convention", "left_edge", "bin_centre"}},
      {"unknown scale",
       [](hid_t f) { replace_text(f, "radiometric_scale", "furlong"); },
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

TEST(BasisFile, ThatIsHostileIsRefusedByName) {
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
