#include "config_writer.h"

#include <fmt/format.h>

#include "gonio/samples/csv.h"

namespace gonio::cli {
namespace {

std::string toml_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

}  // namespace

void ConfigWriter::line(const std::string& key, const std::string& value,
                        std::string_view comment) {
  std::string text = key + " = " + value;
  if (comments_ && !comment.empty()) text = fmt::format("{:<38} # {}", text, comment);
  out_ += text + "\n";
}

void ConfigWriter::table(const std::string& name, std::string_view comment,
                         const std::function<void()>& keys) {
  const std::string before = prefix_;
  prefix_ += name;
  const std::size_t start = out_.size();
  std::string header = out_.empty() ? "" : "\n";
  if (comments_ && !comment.empty()) header += fmt::format("# {}\n", comment);
  header += "[" + prefix_ + "]\n";
  prefix_ += ".";
  keys();
  // A table that holds nothing but tables needs no header.
  const bool only_tables = out_.compare(start, 2, "\n[") == 0 || out_.compare(start, 2, "\n#") == 0;
  if (out_.size() > start && !only_tables) out_.insert(start, header);
  prefix_ = before;
}

void ConfigWriter::array(const std::string& name, std::string_view comment, std::size_t count,
                         const std::function<void(std::size_t)>&,
                         const std::function<void(std::size_t)>& element) {
  const std::string before = prefix_;
  for (std::size_t i = 0; i < count; ++i) {
    out_ += "\n";
    if (comments_ && i == 0 && !comment.empty()) out_ += fmt::format("# {}\n", comment);
    out_ += "[[" + before + name + "]]\n";
    prefix_ = before + name + ".";
    element(i);
  }
  prefix_ = before;
}

void ConfigWriter::number(const std::string& key, double& value, Range, std::string_view comment) {
  line(key, samples::csv_number(value), comment);
}

void ConfigWriter::numbers(const std::string& key, std::span<double> values, Range,
                           std::string_view comment) {
  std::string list;
  for (const double value : values) {
    list += (list.empty() ? "" : ", ") + samples::csv_number(value);
  }
  line(key, "[" + list + "]", comment);
}

void ConfigWriter::integer(const std::string& key, int& value, Range, std::string_view comment) {
  line(key, std::to_string(value), comment);
}

void ConfigWriter::flag(const std::string& key, bool& value, std::string_view comment) {
  line(key, value ? "true" : "false", comment);
}

void ConfigWriter::text(const std::string& key, std::string& value, std::string_view comment) {
  line(key, toml_text(value), comment);
}

void ConfigWriter::texts(const std::string& key, std::vector<std::string>& values,
                         std::string_view comment) {
  std::string list;
  for (const std::string& value : values) list += (list.empty() ? "" : ", ") + toml_text(value);
  line(key, "[" + list + "]", comment);
}

void ConfigWriter::choice(const std::string& key, std::size_t& index,
                          const std::vector<std::string>& words, std::string_view comment) {
  std::string note(comment);
  if (words.size() > 1)
    note += fmt::format("{}{}", note.empty() ? "" : ": ", fmt::join(words, ", "));
  line(key, toml_text(words[index]), note);
}

void ConfigWriter::angle(const std::string& key, Angle& value, Range, std::string_view comment) {
  line(key, samples::csv_degrees(value), comment);
}

}  // namespace gonio::cli
