#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace gonio::brdf::testing {

/// Builds the bytes of a tensor file by the description of the format in docs/formats.md, knowing
/// nothing of our reader or writer.
class TensorBytes {
 public:
  struct Field {
    std::string name;
    std::uint8_t type;
    std::vector<std::uint64_t> shape;
    std::string data;
    std::uint64_t offset = 0;  ///< 0: behind the fields before
  };

  template <class Number>
  TensorBytes& add(const std::string& name, std::uint8_t type, std::vector<std::uint64_t> shape,
                   const std::vector<Number>& values) {
    std::string data(values.size() * sizeof(Number), '\0');
    if (!values.empty()) std::memcpy(data.data(), values.data(), data.size());
    fields.push_back({name, type, std::move(shape), std::move(data)});
    return *this;
  }
  TensorBytes& floats(const std::string& name, std::vector<std::uint64_t> shape,
                      const std::vector<float>& values) {
    return add(name, 10, std::move(shape), values);
  }

  Field& field(const std::string& name) {
    for (Field& each : fields) {
      if (each.name == name) return each;
    }
    throw std::out_of_range(name);
  }
  void remove(const std::string& name) {
    std::erase_if(fields, [&](const Field& each) { return each.name == name; });
  }

  std::string str() const {
    std::string head("tensor_file\0\1\0", 14);
    put(head, static_cast<std::uint32_t>(fields.size()));
    std::uint64_t at = head.size();
    for (const Field& each : fields) at += 2 + each.name.size() + 2 + 1 + 8 + 8 * each.shape.size();
    std::string body;
    for (const Field& each : fields) {
      put(head, static_cast<std::uint16_t>(each.name.size()));
      head += each.name;
      put(head, static_cast<std::uint16_t>(each.shape.size()));
      put(head, each.type);
      put(head, each.offset != 0 ? each.offset : at + body.size());
      for (const std::uint64_t extent : each.shape) put(head, extent);
      body += each.data;
    }
    return head + body;
  }

  std::vector<Field> fields;

 private:
  template <class Number>
  static void put(std::string& out, Number value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out.append(bytes, sizeof value);
  }
};

}  // namespace gonio::brdf::testing
