#include <cmath>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "gonio/basis/basis_file.h"
#include "temporary_folder.h"
#include "trial.h"
#include "value_ranges.h"

namespace {

/// The smallest basis: one material, one component, 13 MB of values. Its left vectors do not sum to
/// 0, so that it is refused at the last: the sums over all values behind would take seconds here.
gonio::basis::Basis smallest_basis() {
  const auto p = static_cast<Eigen::Index>(gonio::brdf::lattice::cells_above_horizon().size());
  const double length = 2.0;
  gonio::basis::Basis basis;
  basis.materials = {{"a", "b", std::string(64, '0')}};
  basis.mean = Eigen::VectorXf::Zero(p);
  basis.components.setConstant(p, 1, static_cast<float>(length / std::sqrt(double(p))));
  basis.singular_values = Eigen::Vector2d(length, 0.0);
  basis.left_vectors = Eigen::Vector3d(1.0, 0.0, 0.0);
  return basis;
}

/// A whole file, kept between trials. HDF5 wants the real path of a file, which memory has not.
class WholeFile {
 public:
  WholeFile() {
    gonio::basis::write_basis(path(), smallest_basis());
    bytes_ = gonio::read_bytes(path());
    std::size_t at = 0;
    for (const auto& [begin, end] : gonio::basis::test::value_ranges(path())) {
      for (; at < begin; ++at) structure_.push_back(at);
      at = static_cast<std::size_t>(end);
    }
    for (; at < bytes_.size(); ++at) structure_.push_back(at);
    file_.open(path(), std::ios::in | std::ios::out | std::ios::binary);
  }

  /// Even numbers are bytes of HDF5's own, odd ones any.
  std::size_t place(std::uint32_t number) const {
    const std::size_t index = number / 2;
    return number % 2 == 0 ? structure_[index % structure_.size()] : index % bytes_.size();
  }
  void change(std::size_t place, char byte) {
    file_.seekp(static_cast<std::streamoff>(place)).put(byte).flush();
  }
  void restore(std::size_t place) { change(place, bytes_[place]); }
  std::filesystem::path path() const { return folder_ / "basis.h5"; }

 private:
  gonio::TemporaryFolder folder_;
  std::fstream file_;
  std::string bytes_;
  std::vector<std::size_t> structure_;
};

}  // namespace

/// First byte 0: the rest is all of a file. 1: changes to a whole one, a place of four bytes and a
/// byte each.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  if (data[0] != 1) {
    static const gonio::TemporaryFolder folder;
    folder.write("basis.h5", {reinterpret_cast<const char*>(data + 1), size - 1});
    return gonio::fuzz::trial(nullptr, 0, [](const std::filesystem::path&) {
      gonio::basis::read_basis(folder / "basis.h5");
    });
  }
  static WholeFile whole;
  constexpr std::size_t kChange = 5;
  std::vector<std::size_t> changed;
  for (std::size_t at = 1; at + kChange <= size; at += kChange) {
    std::uint32_t number = 0;
    std::memcpy(&number, data + at, sizeof number);
    changed.push_back(whole.place(number));
    whole.change(changed.back(), static_cast<char>(data[at + sizeof number]));
  }
  const int result = gonio::fuzz::trial(
      nullptr, 0, [](const std::filesystem::path&) { gonio::basis::read_basis(whole.path()); });
  for (const std::size_t place : changed) whole.restore(place);
  return result;
}
