#include "hdf5_reader.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <type_traits>

#include "basis_schema.h"
#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"
#include "hdf5_structure.h"

namespace gonio::basis::detail {
namespace {

static_assert(std::endian::native == std::endian::little,
              "values are read as they stand in the file");

H5Handle open_file(const std::filesystem::path& path) {
  require_plain_structure(path);
  H5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.valid()) {
    throw DataFormatError(path, "file", "damaged, the HDF5 library cannot open it");
  }
  return file;
}

}  // namespace

Hdf5Reader::Hdf5Reader(const std::filesystem::path& path) : path_(path), file_(open_file(path)) {
  file_bytes_ = std::filesystem::file_size(path);
}

std::string Hdf5Reader::text_attribute(const char* name) const {
  const H5Handle attribute = open_attribute(name);
  const H5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  if (H5Tget_class(type.get()) != H5T_STRING) fail(name, "attribute is not a text");
  return fixed_text(name, attribute, H5Tget_size(type.get()));
}

template <typename Number>
Number Hdf5Reader::number_attribute(const char* name) const {
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

int Hdf5Reader::int_attribute(const char* name) const { return number_attribute<int>(name); }

double Hdf5Reader::double_attribute(const char* name) const {
  return number_attribute<double>(name);
}

Hdf5Reader::DataSet Hdf5Reader::open_set(const char* name, hid_t type, int rank) const {
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

bool Hdf5Reader::has(const char* name) const {
  return H5Lexists(file_.get(), name, H5P_DEFAULT) > 0;
}

void Hdf5Reader::require_own_object(const char* name) const {
  H5L_info_t link{};
  if (H5Lexists(file_.get(), name, H5P_DEFAULT) <= 0 ||
      H5Lget_info(file_.get(), name, &link, H5P_DEFAULT) < 0) {
    fail(name, "data set is missing");
  }
  if (link.type != H5L_TYPE_HARD) fail(name, "is a link out of the file, expected a data set");
}

void Hdf5Reader::expect_length(const char* name, hsize_t found, std::size_t expected) const {
  if (found != expected) {
    fail(name, "found length " + std::to_string(found) + ", expected " + std::to_string(expected));
  }
}

void Hdf5Reader::expect_stored(const char* name, const DataSet& data, std::uintmax_t bytes) const {
  if (bytes > file_bytes_ || H5Dget_storage_size(data.set.get()) != bytes) {
    fail(name, "the file does not hold the values its shape promises");
  }
  const haddr_t offset = H5Dget_offset(data.set.get());
  if (offset == HADDR_UNDEF || offset > file_bytes_ - bytes) {
    fail(name, "the values lie beyond the end of the file");
  }
}

void Hdf5Reader::read(const char* name, const DataSet& data, hid_t type, void* out) const {
  if (H5Dread(data.set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out) < 0) {
    fail(name, "cannot be read: " + last_h5_message());
  }
}

void Hdf5Reader::read_finite(const char* name, const DataSet& data, float* out,
                             std::size_t count) const {
  constexpr std::size_t kBlock = 1 << 18;  // a megabyte: checked while it is in the cache
  void* handle = nullptr;
  if (H5Fget_vfd_handle(file_.get(), H5P_DEFAULT, &handle) < 0 || handle == nullptr) {
    fail(name, "cannot be read: " + last_h5_message());
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

void Hdf5Reader::fail(const std::string& place, const std::string& message) const {
  throw DataFormatError(path_, place, message);
}

std::string Hdf5Reader::fixed_text(const char* name, const H5Handle& attribute,
                                   std::size_t width) const {
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

H5Handle Hdf5Reader::open_attribute(const char* name) const {
  H5Handle attribute(H5Aopen(file_.get(), name, H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) fail(name, "attribute is missing");
  const H5Handle space(H5Aget_space(attribute.get()), H5Sclose);
  if (H5Sget_simple_extent_npoints(space.get()) != 1) fail(name, "attribute is not one value");
  return attribute;
}

std::vector<std::string> Hdf5Reader::texts(const char* name) const {
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
  const H5Handle type = fixed_text_type(width);
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

}  // namespace gonio::basis::detail
