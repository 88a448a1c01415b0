#pragma once

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "gonio/errors/errors.h"

namespace gonio::instrument {

/// One JSON object read key by key: every access is checked, and keys nobody asked for are errors.
class JsonFields {
 public:
  JsonFields(const nlohmann::json& object, std::string place, const std::filesystem::path& file)
      : object_(object), place_(std::move(place)), file_(file) {
    if (!object_.is_object()) fail("", "an object");
  }

  double number(const char* key) {
    const nlohmann::json& value = at(key);
    if (!value.is_number()) fail(key, "a number");
    const double number = value.get<double>();
    if (!std::isfinite(number)) fail(key, "a finite number");
    return number;
  }
  int integer(const char* key) {
    const nlohmann::json& value = at(key);
    if (!value.is_number_integer() || std::abs(value.get<double>()) > 1e9) {
      fail(key, "an integer of at most a thousand million");
    }
    return value.get<int>();
  }
  bool boolean(const char* key) {
    const nlohmann::json& value = at(key);
    if (!value.is_boolean()) fail(key, "true or false");
    return value.get<bool>();
  }
  std::string text(const char* key) {
    const nlohmann::json& value = at(key);
    if (!value.is_string()) fail(key, "a string");
    return value.get<std::string>();
  }
  JsonFields object(const char* key) { return JsonFields(at(key), where(key), file_); }

  /// Calls `read(JsonFields&)` for each object of an array.
  template <class Read>
  void each_object(const char* key, Read&& read) {
    const nlohmann::json& array = this->array(key);
    for (std::size_t i = 0; i < array.size(); ++i) {
      JsonFields element(array[i], fmt::format("{}[{}]", where(key), i), file_);
      read(element);
      element.finish();
    }
  }
  template <int N>
  Eigen::Matrix<double, N, 1> vector(const char* key) {
    const nlohmann::json& array = this->array(key);
    if (array.size() != N) fail(key, fmt::format("{} numbers", N));
    Eigen::Matrix<double, N, 1> result;
    for (int i = 0; i < N; ++i) {
      const nlohmann::json& value = array[static_cast<std::size_t>(i)];
      if (!value.is_number() || !std::isfinite(value.get<double>())) {
        fail(key, fmt::format("{} finite numbers", N));
      }
      result[i] = value.get<double>();
    }
    return result;
  }

  /// Throws for a key that was never asked for. Call when an object has been read.
  void finish() const {
    for (const auto& item : object_.items()) {
      if (!asked_.contains(item.key())) {
        throw DataFormatError(file_, where(item.key()), "unknown key");
      }
    }
  }

 private:
  const nlohmann::json& at(const char* key) {
    asked_.insert(key);
    const auto found = object_.find(key);
    if (found == object_.end()) throw DataFormatError(file_, where(key), "missing");
    return *found;
  }
  const nlohmann::json& array(const char* key) {
    const nlohmann::json& value = at(key);
    if (!value.is_array()) fail(key, "an array");
    constexpr std::size_t kMaxElements = 10000;
    if (value.size() > kMaxElements) fail(key, fmt::format("at most {} elements", kMaxElements));
    return value;
  }
  std::string where(const std::string& key) const {
    if (place_.empty()) return key.empty() ? "top level" : key;
    return key.empty() ? place_ : place_ + "." + key;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& expected) const {
    const nlohmann::json& found = key.empty() ? object_ : object_.at(key);
    std::string shown = found.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    constexpr std::size_t kShown = 40;
    if (shown.size() > kShown) shown = shown.substr(0, kShown) + "...";
    throw DataFormatError(file_, where(key), fmt::format("found {}, expected {}", shown, expected));
  }

  const nlohmann::json& object_;
  std::string place_;
  std::filesystem::path file_;
  std::set<std::string> asked_;
};

}  // namespace gonio::instrument
