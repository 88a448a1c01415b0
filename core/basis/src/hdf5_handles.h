#pragma once

#include <hdf5.h>

#include <filesystem>
#include <string>
#include <utility>

namespace gonio::basis::detail {

/// Owns one HDF5 identifier.
class H5Handle {
 public:
  using Close = herr_t (*)(hid_t);

  /// A negative `id` is kept and owns nothing; test valid() or use one of the makers below.
  H5Handle(hid_t id, Close close_function) : id_(id), close_(close_function) {}
  H5Handle(H5Handle&& other) noexcept
      : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  H5Handle(const H5Handle&) = delete;
  H5Handle& operator=(const H5Handle&) = delete;
  H5Handle& operator=(H5Handle&&) = delete;
  ~H5Handle() {
    if (id_ >= 0) close_(id_);
  }

  bool valid() const { return id_ >= 0; }
  hid_t get() const { return id_; }
  /// Closes now and tells whether that worked: for files, whose last bytes are written then.
  bool close() { return close_(std::exchange(id_, H5I_INVALID_HID)) >= 0; }

 private:
  hid_t id_;
  Close close_;
};

/// Keeps HDF5 from printing its error stack while in scope; what went wrong is reported by
/// exceptions.
class SilentH5Errors {
 public:
  SilentH5Errors();
  ~SilentH5Errors();
  SilentH5Errors(const SilentH5Errors&) = delete;
  SilentH5Errors& operator=(const SilentH5Errors&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// The innermost message on HDF5's error stack of this thread, "" if there is none.
std::string last_h5_message();

/// UTF-8 of at most `size` bytes, padded with zeros; h5py reads it as bytes.
H5Handle fixed_text_type(std::size_t size);

}  // namespace gonio::basis::detail
