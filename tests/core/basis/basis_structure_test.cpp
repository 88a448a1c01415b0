#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "gonio/basis/basis_file.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"
#include "test_materials.h"
#include "value_ranges.h"

namespace gonio::basis {
namespace {

using test::refusal;
using test::small_basis;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Every third of the bytes between the values, without most of the zeros that only fill gaps: a
/// sum over the block finds any of them.
std::vector<std::size_t> structure_places(const std::filesystem::path& path,
                                          const std::string& bytes) {
  constexpr std::size_t kNear = 8;
  constexpr std::size_t kEveryGapByte = 509;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges = test::value_ranges(path);
  ranges.emplace_back(bytes.size(), bytes.size());
  std::vector<std::size_t> places;
  std::size_t at = 0;
  for (const auto& [begin, end] : ranges) {
    for (; at < begin; ++at) {
      const std::size_t from = at < kNear ? 0 : at - kNear;
      const std::string around = bytes.substr(from, std::min(at + kNear, begin) - from);
      const bool gap = around.find_first_not_of('\0') == std::string::npos;
      if (at % (gap ? kEveryGapByte : 3) == 0) places.push_back(at);
    }
    at = end;
  }
  return places;
}

TEST(BasisStructure, WithADamagedByteOfStructureIsRefusedOrReadAsItWas) {
  const TemporaryFolder folder;
  const Basis written =
      train(test::training_set(), test::training_gram(), std::vector<std::size_t>{0, 1}, 1);
  write_basis(folder / "a.h5", written);
  const std::string bytes = read_bytes(folder / "a.h5");
  const std::vector<std::size_t> places = structure_places(folder / "a.h5", bytes);
  EXPECT_GT(places.size(), 500u);
  std::fstream file(folder / "a.h5", std::ios::in | std::ios::out | std::ios::binary);
  const auto put = [&](std::size_t place, char byte) {
    file.seekp(static_cast<std::streamoff>(place)).put(byte).flush();
  };
  // A loop in HDF5 would end the test by its time limit.
  std::size_t refused = 0;
  for (const std::size_t place : places) {
    put(place, static_cast<char>(bytes[place] ^ 0x25));
    try {
      const Basis read = read_basis(folder / "a.h5");
      EXPECT_TRUE(read.components == written.components && read.mean == written.mean &&
                  read.singular_values == written.singular_values &&
                  read.mapping == written.mapping && read.scale == written.scale &&
                  read.materials[1].name == written.materials[1].name)
          << "byte " << place;
    } catch (const DataFormatError&) {
      ++refused;
    }
    put(place, bytes[place]);
  }
  // Others lie in unused room of HDF5's blocks.
  EXPECT_GT(refused, places.size() / 2);
}

TEST(BasisStructure, OfTheFormatWithoutChecksumsIsRefused) {
  const TemporaryFolder folder;
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18);
  H5Fclose(H5Fcreate((folder / "a.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access));
  H5Pclose(access);
  EXPECT_THAT(
      refusal(folder / "a.h5"),
      AllOf(HasSubstr("superblock: found version 0 without checksums"), HasSubstr("train again")));
}

/// An empty file of the format with checksums, changed before it is closed.
std::string refusal_of_file_with(const std::function<void(hid_t file)>& change,
                                 const std::function<void(hid_t creation)>& create = {}) {
  const TemporaryFolder folder;
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V110);
  const hid_t creation = H5Pcreate(H5P_FILE_CREATE);
  if (create) create(creation);
  const hid_t file = H5Fcreate((folder / "a.h5").c_str(), H5F_ACC_TRUNC, creation, access);
  change(file);
  H5Fclose(file);
  H5Pclose(creation);
  H5Pclose(access);
  return refusal(folder / "a.h5");
}

void add_sets(hid_t file, int count, hid_t type, hid_t creation) {
  const hsize_t shape = 4;
  const hid_t space = H5Screate_simple(1, &shape, nullptr);
  for (int i = 0; i < count; ++i) {
    const std::string name = "set-" + std::to_string(i);
    H5Dclose(H5Dcreate2(file, name.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT));
  }
  H5Sclose(space);
}

TEST(BasisStructure, WithLinksOrAttributesInAHeapIsRefused) {  // where damage can crash libhdf5
  EXPECT_THAT(refusal_of_file_with([](hid_t f) { add_sets(f, 9, H5T_STD_I32LE, H5P_DEFAULT); }),
              AllOf(HasSubstr("root group: found links in a heap"), HasSubstr("train again")));
  EXPECT_THAT(
      refusal_of_file_with([](hid_t f) {
        const hid_t space = H5Screate(H5S_SCALAR);
        for (int i = 0; i < 9; ++i) {
          const std::string name = "number-" + std::to_string(i);
          H5Aclose(H5Acreate2(f, name.c_str(), H5T_STD_I32LE, space, H5P_DEFAULT, H5P_DEFAULT));
        }
        H5Sclose(space);
      }),
      HasSubstr("attributes in a heap"));
}

TEST(BasisStructure, WithASharedTypeIsRefused) {
  const auto commit = [](hid_t f) {
    const hid_t type = H5Tcopy(H5T_STD_I32LE);
    H5Tcommit_anon(f, type, H5P_DEFAULT, H5P_DEFAULT);
    return type;
  };
  EXPECT_THAT(refusal_of_file_with([&](hid_t f) {
                const hid_t type = commit(f);
                add_sets(f, 1, type, H5P_DEFAULT);
                H5Tclose(type);
              }),
              HasSubstr("a shared message"));
  EXPECT_THAT(refusal_of_file_with([&](hid_t f) {
                const hid_t type = commit(f);
                const hid_t space = H5Screate(H5S_SCALAR);
                H5Aclose(H5Acreate2(f, "number", type, space, H5P_DEFAULT, H5P_DEFAULT));
                H5Sclose(space);
                H5Tclose(type);
              }),
              HasSubstr("an attribute of a shared type"));
}

TEST(BasisStructure, WithATypeOfSeveralPartsIsRefused) {
  const hsize_t two = 2;
  const hid_t type = H5Tarray_create2(H5T_STD_I32LE, 1, &two);
  EXPECT_THAT(refusal_of_file_with([&](hid_t f) { add_sets(f, 1, type, H5P_DEFAULT); }),
              HasSubstr("set-0: found a type of class 10"));
  H5Tclose(type);
}

TEST(BasisStructure, WithValuesInChunksOrOtherFilesIsRefused) {
  const auto with = [](const std::function<void(hid_t creation)>& set) {
    return refusal_of_file_with([&](hid_t f) {
      const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
      set(creation);
      add_sets(f, 1, H5T_STD_I32LE, creation);
      H5Pclose(creation);
    });
  };
  const hsize_t two = 2;
  EXPECT_THAT(with([&](hid_t creation) { H5Pset_chunk(creation, 1, &two); }),
              HasSubstr("set-0: is not stored contiguously"));
  EXPECT_THAT(with([](hid_t creation) { H5Pset_external(creation, "other", 0, 16); }),
              HasSubstr("set-0: found a message of type 7"));
}

TEST(BasisStructure, WithASuperblockExtensionIsRefused) {
  EXPECT_THAT(refusal_of_file_with([](hid_t) {},
                                   [](hid_t creation) {
                                     H5Pset_shared_mesg_nindexes(creation, 1);
                                     H5Pset_shared_mesg_index(creation, 0, H5O_SHMESG_ALL_FLAG, 1);
                                   }),
              HasSubstr("superblock: found an extension"));
}

TEST(BasisStructure, BehindABlockOfAnotherProgramIsRefused) {  // it could be of either format
  const TemporaryFolder folder;
  write_basis(folder / "a.h5", small_basis());
  write_bytes(folder / "b.h5", std::string(512, 'x') + read_bytes(folder / "a.h5"));
  EXPECT_THAT(refusal(folder / "b.h5"), HasSubstr("not a readable HDF5 file"));
}

}  // namespace
}  // namespace gonio::basis
