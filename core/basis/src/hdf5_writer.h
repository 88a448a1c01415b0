#pragma once

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "hdf5_handles.h"

namespace gonio::basis::detail {

/// Data sets and attributes of a file that is being made. All calls under schema::library_mutex().
///
/// Errors   FileError with the target, what was written and HDF5's reason.
class Hdf5Writer {
 public:
  explicit Hdf5Writer(files::AtomicFile& file) : target_(file.target()), file_(create(file)) {}

  /// Not of variable length: those lie in a heap that carries no checksum.
  void attribute(const char* name, const std::string& text) {
    write_attribute(name, fixed_text_type(std::max<std::size_t>(text.size(), 1)), text.c_str());
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
    // No time stamps: the same data give the same bytes.
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
    data_set<1>(name, fixed_text_type(width).get(), {texts.size()}, padded.data());
  }

  void close() {
    if (!file_.close()) fail("the end of the file");
  }

 private:
  H5Handle create(files::AtomicFile& file) {
    const H5Handle access(check(H5Pcreate(H5P_FILE_ACCESS), "access"), H5Pclose);
    // Large data sets start on a page, so that they can be mapped or read around the cache.
    check(H5Pset_alignment(access.get(), 1 << 20, 4096), "alignment");
    // The format of 1.8 has a checksum on every block of metadata; damage to that of 1.6, which is
    // the default, can send the library into a loop without end.
    check(H5Pset_libver_bounds(access.get(), H5F_LIBVER_V18, H5F_LIBVER_V110), "format");
    const H5Handle creation(check(H5Pcreate(H5P_FILE_CREATE), "creation"), H5Pclose);
    check(H5Pset_obj_track_times(creation.get(), false), "times");  // of the root group
    // All in the header of the root group, where Hdf5Reader wants them: no heaps, no B-trees.
    constexpr unsigned kMost = 1000;
    check(H5Pset_attr_phase_change(creation.get(), kMost, 0), "attributes");
    check(H5Pset_link_phase_change(creation.get(), kMost, 0), "links");
    return {
        check(H5Fcreate(file.temporary_path().c_str(), H5F_ACC_TRUNC, creation.get(), access.get()),
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
    const std::string reason = last_h5_message();
    throw FileError(target_, std::string("write ") + what,
                    reason.empty() ? std::string("HDF5 failed") : reason);
  }

  std::filesystem::path target_;
  H5Handle file_;
};

}  // namespace gonio::basis::detail
