#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/files/input_file.h"

namespace gonio::brdf {

/// Named arrays in one file: the container of RGL materials ("tensor file", little-endian).
///
/// Layout   "tensor_file\0", u8 major = 1, u8 minor = 0, u32 number of fields; per field u16 length
///          of the name, name, u16 number of dimensions, u8 type, u64 offset from the start of the
///          file, u64 extents. The data stand where the offsets say.
/// Hostile  Nothing in the file is trusted: the head is bounded (kMostFields, kLongestName,
///          kMostDimensions), every field must lie behind the head, inside the file and outside of
///          all others. A field is read only when it is asked for, so memory is bounded by the
///          file's own size.
/// Errors   DataFormatError with "byte N" or "field NAME", FileError.
class TensorFile {
 public:
  static constexpr std::uintmax_t kMostBytes = std::uintmax_t{512} << 20U;
  static constexpr std::uint32_t kMostFields = 64;
  static constexpr std::uint16_t kLongestName = 64;
  static constexpr std::uint16_t kMostDimensions = 8;

  enum class Type : std::uint8_t { uint8 = 1, uint32 = 5, float32 = 10, float64 = 11 };

  struct Field {
    std::string name;
    std::uint8_t type = 0;  ///< as in the file; only those of Type can be read
    std::uint64_t offset = 0;
    std::vector<std::uint64_t> shape;
    std::uint64_t elements = 0;
    std::uint64_t bytes = 0;
  };

  /// Reads and checks the head.
  explicit TensorFile(const std::filesystem::path& path);

  bool has(std::string_view name) const;
  /// Throws when it is missing.
  const Field& field(std::string_view name) const;

  /// The numbers of a float32 field, all of them finite. Throws when `name` is missing, of another
  /// type, or holds NaN or infinities.
  std::vector<float> floats(std::string_view name);
  /// The bytes of a uint8 field.
  std::vector<std::uint8_t> bytes(std::string_view name);

  /// "field ndf: found ..., expected ...".
  [[noreturn]] void fail(std::string_view name, const std::string& message) const;
  const std::filesystem::path& path() const { return path_; }

 private:
  void read_head();
  void check_places(std::uint64_t head_bytes) const;
  const Field& require_type(std::string_view name, Type type) const;

  std::filesystem::path path_;
  files::InputFile file_;
  std::vector<Field> fields_;
};

}  // namespace gonio::brdf
