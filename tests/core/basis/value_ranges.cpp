#include "value_ranges.h"

#include <hdf5.h>

#include <algorithm>

namespace gonio::basis::test {

std::vector<std::pair<std::uint64_t, std::uint64_t>> value_ranges(
    const std::filesystem::path& path) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const auto add = [](hid_t group, const char* name, const H5L_info_t*, void* to) -> herr_t {
    const hid_t set = H5Dopen2(group, name, H5P_DEFAULT);
    const haddr_t begin = H5Dget_offset(set);
    static_cast<decltype(ranges)*>(to)->emplace_back(begin, begin + H5Dget_storage_size(set));
    return H5Dclose(set);
  };
  H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &ranges);
  H5Fclose(file);
  std::sort(ranges.begin(), ranges.end());
  return ranges;
}

}  // namespace gonio::basis::test
