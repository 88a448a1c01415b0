#include "gonio/json/json_document.h"

#include "gonio/json/json_fields.h"

namespace gonio::json {
namespace {

constexpr int kMaxDepth = 16;  // the formats need 7

}  // namespace

nlohmann::json parse_document(const std::string& text, const std::filesystem::path& place,
                              std::string_view format, int version) {
  nlohmann::json document;
  try {
    document =
        nlohmann::json::parse(text, [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
          if (depth > kMaxDepth) {
            throw DataFormatError(place, "structure",
                                  fmt::format("nested deeper than {} levels", kMaxDepth));
          }
          return true;
        });
  } catch (const nlohmann::json::parse_error& error) {
    throw DataFormatError(place, fmt::format("byte {}", error.byte), "not valid JSON");
  } catch (const nlohmann::json::exception&) {
    throw DataFormatError(place, "numbers", "a number is out of range");
  }
  JsonFields fields(document, "", place);
  const std::string found_format = fields.text("format");
  if (found_format != format) {
    throw DataFormatError(place, "format",
                          fmt::format("found {:?}, expected {:?}", found_format, format));
  }
  const int found_version = fields.integer("version");
  if (found_version != version) {
    throw DataFormatError(
        place, "version",
        fmt::format("found {}, expected {}: written by {} version of gonio", found_version, version,
                    found_version < version ? "an older" : "a newer"));
  }
  document.erase("format");
  document.erase("version");
  return document;
}

}  // namespace gonio::json
