#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/units/angle.h"

namespace gonio::cli {

/// Allowed values of a number, inclusive.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

/// Walks over the keys of a configuration. One description of the keys (visit() in rig_file.cpp)
/// serves the reader, which fills them in, and the writer, which prints them with their comments:
/// so the example, the stored resolved configuration and the checks cannot disagree.
class ConfigVisitor {
 public:
  virtual ~ConfigVisitor() = default;
  ConfigVisitor(const ConfigVisitor&) = delete;
  ConfigVisitor& operator=(const ConfigVisitor&) = delete;

  virtual void table(const std::string& name, std::string_view comment,
                     const std::function<void()>& keys) = 0;
  /// An array of tables: `resize` is called with its length before the elements are visited.
  virtual void array(const std::string& name, std::string_view comment, std::size_t count,
                     const std::function<void(std::size_t)>& resize,
                     const std::function<void(std::size_t)>& element) = 0;

  virtual void number(const std::string& key, double& value, Range range,
                      std::string_view comment) = 0;
  virtual void numbers(const std::string& key, std::span<double> values, Range range,
                       std::string_view comment) = 0;
  virtual void integer(const std::string& key, int& value, Range range,
                       std::string_view comment) = 0;
  virtual void flag(const std::string& key, bool& value, std::string_view comment) = 0;
  virtual void text(const std::string& key, std::string& value, std::string_view comment) = 0;
  virtual void texts(const std::string& key, std::vector<std::string>& values,
                     std::string_view comment) = 0;
  /// One of some words; `index` into them.
  virtual void choice(const std::string& key, std::size_t& index,
                      const std::vector<std::string>& words, std::string_view comment) = 0;
  /// An angle, in degrees in the file.
  virtual void angle(const std::string& key, Angle& value, Range range_deg,
                     std::string_view comment) = 0;

  /// A duration, in the file as a number of `unit_s` seconds.
  template <class Duration>
  void duration(const std::string& key, Duration& value, double unit_s, Range range,
                std::string_view comment) {
    constexpr double kTick =
        static_cast<double>(Duration::period::num) / static_cast<double>(Duration::period::den);
    // A whole number, so that 50 us are not written as 50.00000000000001.
    const double ticks_per_unit = std::round(unit_s / kTick);
    double in_units = static_cast<double>(value.count()) / ticks_per_unit;
    const double before = in_units;
    number(key, in_units, range, comment);
    if (in_units != before) {
      value = Duration(static_cast<typename Duration::rep>(in_units * ticks_per_unit + 0.5));
    }
  }

  /// A choice that is an enumeration counting from 0.
  template <class Enum>
  void enumeration(const std::string& key, Enum& value, const std::vector<std::string>& words,
                   std::string_view comment) {
    auto index = static_cast<std::size_t>(value);
    choice(key, index, words, comment);
    value = static_cast<Enum>(index);
  }

 protected:
  ConfigVisitor() = default;
};

}  // namespace gonio::cli
