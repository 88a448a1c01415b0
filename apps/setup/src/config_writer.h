#pragma once

#include <string>

#include "config_visitor.h"

namespace gonio::cli {

/// Prints values as TOML, with or without their comments.
class ConfigWriter final : public ConfigVisitor {
 public:
  explicit ConfigWriter(bool comments) : comments_(comments) {}

  const std::string& text_so_far() const { return out_; }

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

 private:
  void line(const std::string& key, const std::string& value, std::string_view comment);

  bool comments_;
  std::string prefix_;
  std::string out_;
};

}  // namespace gonio::cli
