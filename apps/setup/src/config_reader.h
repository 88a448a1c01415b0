#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "config_visitor.h"

namespace gonio::cli {

/// Fills values in from TOML text. Keys that are not in the text keep their values.
///
/// Errors   ConfigError ("FILE:LINE KEY: found, expected"): not TOML, a value of the wrong type or
///          out of range, and, from finish(), a key nobody asked for, with a suggestion.
class ConfigReader final : public ConfigVisitor {
 public:
  /// `file` names the text in errors.
  ConfigReader(const std::string& text, const std::filesystem::path& file);
  ~ConfigReader() override;

  void table(const std::string& name, std::string_view comment,
             const std::function<void()>& keys) override;
  void array(const std::string& name, std::string_view comment, std::size_t count,
             const std::function<void(std::size_t)>& resize,
             const std::function<void(std::size_t)>& element) override;
  void number(const std::string& key, double& value, Range range,
              std::string_view comment) override;
  void numbers(const std::string& key, std::span<double> values, Range range,
               std::string_view comment) override;
  void integer(const std::string& key, int& value, Range range, std::string_view comment) override;
  void flag(const std::string& key, bool& value, std::string_view comment) override;
  void text(const std::string& key, std::string& value, std::string_view comment) override;
  void texts(const std::string& key, std::vector<std::string>& values,
             std::string_view comment) override;
  void choice(const std::string& key, std::size_t& index, const std::vector<std::string>& words,
              std::string_view comment) override;
  void angle(const std::string& key, Angle& value, Range range_deg,
             std::string_view comment) override;

  /// Refuses top-level keys that were not visited.
  void finish();

  /// Where a dotted key stands in the text; 0 if it does not.
  int line_of(const std::string& dotted_key) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gonio::cli
