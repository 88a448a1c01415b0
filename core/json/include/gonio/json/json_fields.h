#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gonio/errors/errors.h"

namespace gonio::json {

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
  /// A whole number within limits, both inclusive.
  std::int64_t whole(const char* key, std::int64_t min, std::int64_t max) {
    const nlohmann::json& value = at(key);
    const bool fits = value.is_number_integer() &&
                      !(value.is_number_unsigned() &&
                        value.get<std::uint64_t>() >
                            static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()));
    if (!fits || value.get<std::int64_t>() < min || value.get<std::int64_t>() > max) {
      fail(key, fmt::format("a whole number from {} to {}", min, max));
    }
    return value.get<std::int64_t>();
  }
  /// Of a key that a file may leave out.
  bool has(const char* key) const { return object_.contains(key); }
  bool is_null(const char* key) { return at(key).is_null(); }
  std::optional<double> number_or_null(const char* key) {
    if (is_null(key)) return std::nullopt;
    return number(key);
  }
  /// Exactly `count` finite numbers; for matrices, so more than other arrays may be.
  std::vector<double> numbers(const char* key, std::size_t count) {
    const nlohmann::json& array = at(key);
    if (!array.is_array() || array.size() != count) fail(key, fmt::format("{} numbers", count));
    std::vector<double> values;
    for (const nlohmann::json& value : array) {
      if (!value.is_number() || !std::isfinite(value.get<double>())) {
        fail(key, fmt::format("{} finite numbers", count));
      }
      values.push_back(value.get<double>());
    }
    return values;
  }
  /// Finite numbers, as many as there are.
  std::vector<double> numbers(const char* key) {
    const std::size_t count = array(key).size();
    return numbers(key, count);
  }
  /// At most `max_count` pairs of whole numbers from 0 to `max`; may be more than other arrays.
  std::vector<std::array<int, 2>> pairs(const char* key, std::size_t max_count, int max) {
    const nlohmann::json& array = at(key);
    if (!array.is_array()) fail(key, "a list of pairs");
    if (array.size() > max_count) fail(key, fmt::format("at most {} pairs", max_count));
    std::vector<std::array<int, 2>> values;
    for (std::size_t i = 0; i < array.size(); ++i) {
      const nlohmann::json& pair = array[i];
      const auto whole = [max](const nlohmann::json& number) {
        return number.is_number_integer() && number.get<double>() >= 0.0 &&
               number.get<double>() <= max;
      };
      if (!pair.is_array() || pair.size() != 2 || !whole(pair[0]) || !whole(pair[1])) {
        fail_at(fmt::format("{}[{}]", where(key), i), pair,
                fmt::format("two whole numbers from 0 to {}", max));
      }
      values.push_back({pair[0].get<int>(), pair[1].get<int>()});
    }
    return values;
  }
  bool is_array(const char* key) { return at(key).is_array(); }
  std::vector<std::string> texts(const char* key) {
    std::vector<std::string> values;
    for (const nlohmann::json& value : array(key)) {
      if (!value.is_string()) fail(key, "an array of strings");
      values.push_back(value.get<std::string>());
    }
    return values;
  }
  /// An object whose keys are names and whose values are all strings, or all numbers.
  std::map<std::string, std::string> texts_by_name(const char* key) {
    std::map<std::string, std::string> values;
    JsonFields named = object(key);
    for (const auto& item : at(key).items()) values[item.key()] = named.text(item.key().c_str());
    return values;
  }
  std::map<std::string, double> numbers_by_name(const char* key) {
    std::map<std::string, double> values;
    JsonFields named = object(key);
    for (const auto& item : at(key).items()) values[item.key()] = named.number(item.key().c_str());
    return values;
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
    fail_at(where(key), key.empty() ? object_ : object_.at(key), expected);
  }
  [[noreturn]] void fail_at(const std::string& place, const nlohmann::json& found,
                            const std::string& expected) const {
    std::string shown = found.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    constexpr std::size_t kShown = 40;
    if (shown.size() > kShown) shown = shown.substr(0, kShown) + "...";
    throw DataFormatError(file_, place, fmt::format("found {}, expected {}", shown, expected));
  }

  const nlohmann::json& object_;
  std::string place_;
  std::filesystem::path file_;
  std::set<std::string> asked_;
};

}  // namespace gonio::json
