#include "tensor_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include "gonio/errors/errors.h"

namespace gonio::brdf {
namespace {

static_assert(std::endian::native == std::endian::little, "tensor files are little-endian");

constexpr std::string_view kMagic("tensor_file\0", 12);

/// Bytes per element of the container's types, 0 for one that does not exist: 1..8 whole numbers of
/// growing size (unsigned odd), 9 half, 10 single, 11 double precision.
std::uint64_t size_of_type(std::uint8_t type) {
  constexpr std::array<std::uint64_t, 12> kSizes = {0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
  return type < kSizes.size() ? kSizes[type] : 0;
}

std::string printable(std::string_view text) {
  std::string out;
  for (const char c : text) out += c >= ' ' && c <= '~' ? c : '?';
  return out;
}

}  // namespace

TensorFile::TensorFile(const std::filesystem::path& path) : path_(path), file_(path) {
  if (file_.size() > kMostBytes) {
    throw DataFormatError(path_, "byte " + std::to_string(kMostBytes),
                          "found " + std::to_string(file_.size()) +
                              " bytes, expected a tensor file of at most 512 MiB");
  }
  read_head();
}

void TensorFile::read_head() {
  std::uint64_t at = 0;
  const auto take = [&]<typename Number>(Number& number) {
    file_.read(std::as_writable_bytes(std::span(&number, 1)));
    at += sizeof number;
  };
  std::array<char, kMagic.size()> magic{};
  take(magic);
  if (std::string_view(magic.data(), magic.size()) != kMagic) {
    throw DataFormatError(path_, "byte 0",
                          "found no tensor file, expected the first twelve bytes to spell "
                          "tensor_file");
  }
  std::uint8_t major = 0;
  std::uint8_t minor = 0;
  take(major);
  take(minor);
  if (major != 1 || minor != 0) {
    throw DataFormatError(
        path_, "byte 12",
        "found version " + std::to_string(major) + "." + std::to_string(minor) + ", expected 1.0");
  }
  std::uint32_t count = 0;
  take(count);
  if (count == 0 || count > kMostFields) {
    throw DataFormatError(
        path_, "byte 14",
        "found " + std::to_string(count) + " fields, expected 1 to " + std::to_string(kMostFields));
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string place = "byte " + std::to_string(at);
    const auto refuse = [&](const std::string& message) {
      throw DataFormatError(path_, place + ", field " + std::to_string(i), message);
    };
    std::uint16_t length = 0;
    take(length);
    if (length == 0 || length > kLongestName) {
      refuse("found a name of " + std::to_string(length) + " bytes, expected 1 to " +
             std::to_string(kLongestName));
    }
    Field field;
    field.name.resize(length);
    file_.read(std::as_writable_bytes(std::span(field.name)));
    at += length;
    if (has(field.name)) refuse("found the name " + printable(field.name) + " a second time");
    std::uint16_t dimensions = 0;
    take(dimensions);
    take(field.type);
    take(field.offset);
    if (dimensions > kMostDimensions) {
      refuse("found " + std::to_string(dimensions) + " dimensions, expected at most " +
             std::to_string(kMostDimensions));
    }
    const std::uint64_t size = size_of_type(field.type);
    if (size == 0) refuse("found the unknown type " + std::to_string(field.type));
    field.elements = 1;
    for (std::uint16_t d = 0; d < dimensions; ++d) {
      std::uint64_t extent = 0;
      take(extent);
      // Kept below the file's size at each step, so the product cannot overflow.
      if (extent == 0 || extent > file_.size() / size / field.elements) {
        refuse("found extent " + std::to_string(extent) + " of dimension " + std::to_string(d) +
               " of " + printable(field.name) + ", more than 0 and no more than the file holds " +
               "expected");
      }
      field.elements *= extent;
      field.shape.push_back(extent);
    }
    field.bytes = field.elements * size;
    fields_.push_back(std::move(field));
  }
  check_places(at);
}

void TensorFile::check_places(std::uint64_t head_bytes) const {
  std::vector<const Field*> order;
  for (const Field& field : fields_) order.push_back(&field);
  std::sort(order.begin(), order.end(),
            [](const Field* a, const Field* b) { return a->offset < b->offset; });
  std::uint64_t end = head_bytes;
  std::string before = "the head";
  for (const Field* field : order) {
    if (field->offset < end) {
      fail(field->name, "found at byte " + std::to_string(field->offset) + ", inside of " + before +
                            ", expected at byte " + std::to_string(end) + " or later");
    }
    // Both below the file's size limit: no overflow.
    if (field->offset > file_.size() || field->bytes > file_.size() - field->offset) {
      fail(field->name, "found " + std::to_string(field->bytes) + " bytes at byte " +
                            std::to_string(field->offset) + ", expected them inside of the " +
                            std::to_string(file_.size()) + " bytes of the file");
    }
    end = field->offset + field->bytes;
    before = "field " + printable(field->name);
  }
}

bool TensorFile::has(std::string_view name) const {
  return std::any_of(fields_.begin(), fields_.end(),
                     [&](const Field& field) { return field.name == name; });
}

const TensorFile::Field& TensorFile::field(std::string_view name) const {
  for (const Field& field : fields_) {
    if (field.name == name) return field;
  }
  fail(name, "missing");
}

const TensorFile::Field& TensorFile::require_type(std::string_view name, Type type) const {
  const Field& found = field(name);
  const auto expected = static_cast<std::uint8_t>(type);
  if (found.type != expected) {
    fail(name, "found type " + std::to_string(found.type) + ", expected " +
                   std::to_string(expected) + (type == Type::float32 ? " (single precision)" : ""));
  }
  return found;
}

std::vector<float> TensorFile::floats(std::string_view name) {
  const Field& wanted = require_type(name, Type::float32);
  std::vector<float> values(static_cast<std::size_t>(wanted.elements));
  file_.read_at(wanted.offset, std::as_writable_bytes(std::span(values)));
  const auto bad =
      std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  if (bad != values.end()) {
    const auto index = static_cast<std::uint64_t>(bad - values.begin());
    throw DataFormatError(path_, "byte " + std::to_string(wanted.offset + index * sizeof(float)),
                          std::string("found ") + (std::isnan(*bad) ? "NaN" : "an infinite value") +
                              " as element " + std::to_string(index) + " of field " +
                              std::string(name) + ", expected a finite number");
  }
  return values;
}

std::vector<std::uint8_t> TensorFile::bytes(std::string_view name) {
  const Field& wanted = require_type(name, Type::uint8);
  std::vector<std::uint8_t> values(static_cast<std::size_t>(wanted.elements));
  file_.read_at(wanted.offset, std::as_writable_bytes(std::span(values)));
  return values;
}

void TensorFile::fail(std::string_view name, const std::string& message) const {
  throw DataFormatError(path_, "field " + printable(name), message);
}

}  // namespace gonio::brdf
