#include "config_reader.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <cmath>
#include <optional>

#include "gonio/console/printable.h"
#include "gonio/console/suggest.h"
#include "gonio/errors/errors.h"
#include "toml_limits.h"

namespace gonio::cli {
namespace {

int line_at(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

std::string type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    case toml::node_type::none:
      return "nothing";
    default:
      return "a date or time";
  }
}

std::string range_text(Range range) {
  if (std::isinf(range.min) && std::isinf(range.max)) return "a finite number";
  if (std::isinf(range.max)) return fmt::format("at least {:g}", range.min);
  if (std::isinf(range.min)) return fmt::format("at most {:g}", range.max);
  return fmt::format("{:g} to {:g}", range.min, range.max);
}

}  // namespace

struct ConfigReader::State {
  /// A table being visited; without a node where the text has none.
  struct Level {
    const toml::table* node;
    std::string name;  ///< dotted, with a dot at the end
    std::vector<std::string> asked;
  };

  std::filesystem::path file;
  toml::table root;
  std::vector<Level> levels;

  [[noreturn]] void refuse(int line, const std::string& key, const std::string& why) const {
    throw ConfigError(file, line, key, why);
  }

  const toml::node* find(const std::string& key) {
    Level& level = levels.back();
    level.asked.push_back(key);
    return level.node == nullptr ? nullptr : level.node->get(key);
  }

  std::string full(const std::string& key) const { return levels.back().name + key; }

  [[noreturn]] void wrong_type(const toml::node& node, const std::string& key,
                               const std::string& expected) const {
    refuse(line_at(node), full(key), "found " + type_name(node) + ", expected " + expected);
  }

  double number_in(const toml::node& node, const std::string& key, Range range) const {
    const std::optional<double> value = node.value<double>();
    if (!node.is_number() || !value) wrong_type(node, key, "a number");
    if (!std::isfinite(*value) || !(*value >= range.min) || !(*value <= range.max)) {
      refuse(line_at(node), full(key),
             fmt::format("found {:g}, expected {}", *value, range_text(range)));
    }
    return *value;
  }

  /// Names end up in journals, tables and CSV comments, where a line end would begin a new one.
  std::string text_in(const toml::node& node, const std::string& key) const {
    if (!node.is_string()) wrong_type(node, key, "text");
    std::string text = *node.value<std::string>();
    if (find_unprintable(text) != std::string::npos) {
      refuse(line_at(node), full(key),
             fmt::format("found \"{}\", expected no control characters", printable_line(text)));
    }
    return text;
  }

  void check_unknown() const {
    const Level& level = levels.back();
    if (level.node == nullptr) return;
    for (const auto& [key, node] : *level.node) {
      const std::string name(key.str());
      if (std::find(level.asked.begin(), level.asked.end(), name) != level.asked.end()) continue;
      refuse(static_cast<int>(key.source().begin.line), level.name + name,
             "unknown key" + did_you_mean(name, level.asked));
    }
  }

  void visit(const toml::table* node, std::string name, const std::function<void()>& keys) {
    levels.push_back({node, std::move(name), {}});
    keys();
    check_unknown();
    levels.pop_back();
  }
};

ConfigReader::ConfigReader(const std::string& text, const std::filesystem::path& file)
    : state_(std::make_unique<State>()) {
  state_->file = file;
  require_parsable(text, file);
  try {
    state_->root = toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw ConfigError(file, static_cast<int>(error.source().begin.line), "TOML",
                      std::string(error.description()));
  }
  state_->levels.push_back({&state_->root, "", {}});
}

ConfigReader::~ConfigReader() = default;

void ConfigReader::table(const std::string& name, std::string_view,
                         const std::function<void()>& keys) {
  const std::string full = state_->full(name);
  const toml::node* node = state_->find(name);
  if (node != nullptr && !node->is_table()) state_->wrong_type(*node, name, "a table");
  state_->visit(node == nullptr ? nullptr : node->as_table(), full + ".", keys);
}

void ConfigReader::array(const std::string& name, std::string_view, std::size_t,
                         const std::function<void(std::size_t)>& resize,
                         const std::function<void(std::size_t)>& element) {
  const std::string full = state_->full(name);
  const toml::node* node = state_->find(name);
  if (node == nullptr) return;
  const toml::array* list = node->as_array();
  if (list == nullptr || list->empty() || !list->is_homogeneous(toml::node_type::table)) {
    state_->wrong_type(*node, name, "an array of tables");
  }
  resize(list->size());
  for (std::size_t i = 0; i < list->size(); ++i) {
    state_->visit(list->get(i)->as_table(), fmt::format("{}[{}].", full, i), [&] { element(i); });
  }
}

void ConfigReader::number(const std::string& key, double& value, Range range, std::string_view) {
  if (const toml::node* node = state_->find(key)) value = state_->number_in(*node, key, range);
}

void ConfigReader::numbers(const std::string& key, std::span<double> values, Range range,
                           std::string_view) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  const toml::array* list = node->as_array();
  if (list == nullptr) {
    state_->wrong_type(*node, key, fmt::format("an array of {} numbers", values.size()));
  }
  if (list->size() != values.size()) {
    state_->refuse(line_at(*node), state_->full(key),
                   fmt::format("found {} values, expected {}", list->size(), values.size()));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = state_->number_in(*list->get(i), key, range);
  }
}

void ConfigReader::integer(const std::string& key, int& value, Range range, std::string_view) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  if (!node->is_integer()) state_->wrong_type(*node, key, "a whole number");
  value = static_cast<int>(state_->number_in(
      *node, key, {std::max(range.min, -2147483648.0), std::min(range.max, 2147483647.0)}));
}

void ConfigReader::flag(const std::string& key, bool& value, std::string_view) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  if (!node->is_boolean()) state_->wrong_type(*node, key, "true or false");
  value = *node->value<bool>();
}

void ConfigReader::text(const std::string& key, std::string& value, std::string_view) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  value = state_->text_in(*node, key);
}

void ConfigReader::texts(const std::string& key, std::vector<std::string>& values,
                         std::string_view) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  const toml::array* list = node->as_array();
  if (list == nullptr) state_->wrong_type(*node, key, "an array of texts");
  values.clear();
  for (const toml::node& each : *list) {
    values.push_back(state_->text_in(each, key));
  }
}

void ConfigReader::choice(const std::string& key, std::size_t& index,
                          const std::vector<std::string>& words, std::string_view) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  if (!node->is_string()) state_->wrong_type(*node, key, "text");
  const std::string found = *node->value<std::string>();
  for (index = 0; index < words.size(); ++index) {
    if (words[index] == found) return;
  }
  state_->refuse(line_at(*node), state_->full(key),
                 fmt::format("found \"{}\", expected \"{}\"", found, fmt::join(words, "\" or \"")));
}

void ConfigReader::angle(const std::string& key, Angle& value, Range range_deg, std::string_view) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  value = Angle::from_degrees(state_->number_in(*node, key, range_deg));
}

void ConfigReader::finish() { state_->check_unknown(); }

int ConfigReader::line_of(const std::string& dotted_key) const {
  const auto found = state_->root.at_path(dotted_key);
  return found.node() == nullptr ? 0 : line_at(*found.node());
}

}  // namespace gonio::cli
