#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hdf5_handles.h"

namespace gonio::basis::detail {

/// Attributes and data sets of an HDF5 file nobody vouches for. What a data set claims is checked
/// against the file's size before memory is allocated, links out of the file are refused, and
/// errors name file and place. What is not as plain as Hdf5Writer makes it is refused before the
/// library reads it (hdf5_structure.h). The names are those of basis_schema.h.
///
/// Errors   DataFormatError for anything the file does not hold as asked, FileError when it cannot
///          be read.
/// Threads  One at a time, under schema::library_mutex().
class Hdf5Reader {
 public:
  explicit Hdf5Reader(const std::filesystem::path& path);

  std::string text_attribute(const char* name) const;
  int int_attribute(const char* name) const;
  double double_attribute(const char* name) const;

  /// A contiguous data set whose bytes lie in this very file.
  struct DataSet {
    H5Handle set;
    std::vector<hsize_t> shape;
  };
  /// Opens one of this rank and stored type.
  DataSet open_set(const char* name, hid_t type, int rank) const;

  bool has(const char* name) const;

  void expect_length(const char* name, hsize_t found, std::size_t expected) const;

  /// Call before allocating: refuses a data set whose values the file does not hold.
  void expect_stored(const char* name, const DataSet& data, std::uintmax_t bytes) const;

  void read(const char* name, const DataSet& data, hid_t type, void* out) const;

  /// Many float32 values, refused unless finite. Around HDF5, which copies on one thread and would
  /// leave the check a second pass over memory: the data set is contiguous in the file that is
  /// open.
  void read_finite(const char* name, const DataSet& data, float* out, std::size_t count) const;

  /// A data set of texts of fixed width, at least one.
  std::vector<std::string> texts(const char* name) const;

  [[noreturn]] void fail(const std::string& place, const std::string& message) const;

 private:
  template <typename Number>
  Number number_attribute(const char* name) const;
  std::string fixed_text(const char* name, const H5Handle& attribute, std::size_t width) const;
  H5Handle open_attribute(const char* name) const;
  /// Refuses what is missing or a link, which could lead into any other file.
  void require_own_object(const char* name) const;

  std::filesystem::path path_;
  H5Handle file_;
  std::uintmax_t file_bytes_ = 0;
};

}  // namespace gonio::basis::detail
