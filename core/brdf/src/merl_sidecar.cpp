#include "merl_sidecar.h"

#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "gonio/errors/errors.h"
#include "gonio/files/input_file.h"

namespace gonio::brdf {
namespace {

using Json = nlohmann::ordered_json;  // keeps the order the provenance was written in

constexpr std::string_view kFormat = "gonio-merl-sidecar";
constexpr int kFormatVersion = 1;
/// Far above any real one; what we hold of a hostile one.
constexpr std::uintmax_t kMaxBytes = std::uintmax_t{1} << 20U;
/// Writing JSON out again recurses once per level.
constexpr int kMaxDepth = 64;

struct TooDeep : std::runtime_error {
  TooDeep() : std::runtime_error("nested deeper than 64 levels") {}
};

/// Throws nlohmann's exceptions or TooDeep.
Json parse(std::string_view text) {
  return Json::parse(text, [](int depth, Json::parse_event_t, Json&) {
    if (depth > kMaxDepth) throw TooDeep();
    return true;
  });
}

Json parse_provenance(std::string_view text) {
  Json provenance;
  try {
    provenance = parse(text);
  } catch (const std::exception& error) {
    throw std::invalid_argument(std::string("provenance is not JSON: ") + error.what());
  }
  if (!provenance.is_object()) {
    throw std::invalid_argument(std::string("provenance is a JSON ") + provenance.type_name() +
                                ", expected an object");
  }
  return provenance;
}

/// Access to a sidecar's keys with errors that name them.
class Keys {
 public:
  Keys(const std::filesystem::path& path, const Json& document)
      : path_(path), document_(document) {}

  const Json& at(const char* key) const {
    const auto found = document_.find(key);
    if (found == document_.end()) fail(key, "missing");
    return *found;
  }

  std::string string(const char* key) const {
    const Json& value = at(key);
    if (!value.is_string())
      fail(key, std::string("found a ") + value.type_name() + ", expected a string");
    return value.get<std::string>();
  }

  [[noreturn]] void fail(const char* key, const std::string& why) const {
    throw DataFormatError(path_, std::string("key \"") + key + "\"", why);
  }

 private:
  const std::filesystem::path& path_;
  const Json& document_;
};

MerlSidecar sidecar_from(const std::filesystem::path& path, const Json& document) {
  if (!document.is_object()) {
    throw DataFormatError(path, "byte 0",
                          std::string("found a JSON ") + document.type_name() +
                              ", expected an object (the sidecar of a MERL file)");
  }
  const Keys keys(path, document);
  if (const std::string format = keys.string("format"); format != kFormat) {
    keys.fail("format",
              "found \"" + format.substr(0, 80) + "\", expected \"" + std::string(kFormat) + "\"");
  }
  if (const Json& version = keys.at("format_version"); version != kFormatVersion) {
    keys.fail("format_version", "found " + version.dump().substr(0, 80) + ", expected 1");
  }
  MerlSidecar sidecar;
  try {
    sidecar.convention = index_convention_from_string(keys.string("lattice_convention"));
  } catch (const std::invalid_argument& error) {
    keys.fail("lattice_convention", error.what());
  }
  try {
    sidecar.scale = radiometric_scale_from_string(keys.string("radiometric_scale"));
  } catch (const std::invalid_argument& error) {
    keys.fail("radiometric_scale", error.what());
  }
  sidecar.binary_sha256 = keys.string("binary_sha256");
  if (sidecar.binary_sha256.size() != 64 ||
      sidecar.binary_sha256.find_first_not_of("0123456789abcdef") != std::string::npos) {
    keys.fail("binary_sha256", "expected 64 lower-case hexadecimal digits");
  }
  const Json& provenance = keys.at("provenance");
  if (!provenance.is_object()) {
    keys.fail("provenance",
              std::string("found a ") + provenance.type_name() + ", expected an object");
  }
  sidecar.provenance_json = provenance.dump();
  return sidecar;
}

}  // namespace

std::string sidecar_text(const MerlSidecar& sidecar) {
  Json document;
  document["format"] = kFormat;
  document["format_version"] = kFormatVersion;
  document["lattice_convention"] = to_string(sidecar.convention);
  document["radiometric_scale"] = to_string(sidecar.scale);
  document["binary_sha256"] = sidecar.binary_sha256;
  document["provenance"] = parse_provenance(sidecar.provenance_json);
  return document.dump(2) + "\n";
}

std::filesystem::path merl_sidecar_path(const std::filesystem::path& binary) {
  std::filesystem::path sidecar = binary;
  if (sidecar.extension() == ".binary") return sidecar.replace_extension(".json");
  sidecar += ".json";
  return sidecar;
}

std::optional<MerlSidecar> read_merl_sidecar(const std::filesystem::path& binary) {
  const std::filesystem::path path = merl_sidecar_path(binary);
  std::optional<files::InputFile> file = files::InputFile::open_if_exists(path);
  if (!file) return std::nullopt;
  if (file->size() > kMaxBytes) {
    throw DataFormatError(
        path, "byte " + std::to_string(kMaxBytes),
        "found " + std::to_string(file->size()) + " bytes, expected a sidecar of at most 1 MiB");
  }
  std::string text(static_cast<std::size_t>(file->size()), '\0');
  file->read(std::as_writable_bytes(std::span(text)));
  Json document;
  try {
    document = parse(text);
  } catch (const Json::parse_error& error) {
    throw DataFormatError(path, "byte " + std::to_string(error.byte),
                          "not valid JSON, expected the sidecar of a MERL file");
  } catch (const std::exception& error) {  // a number beyond double, or too deep
    throw DataFormatError(path, "byte 0", std::string("not usable JSON: ") + error.what());
  }
  return sidecar_from(path, document);
}

}  // namespace gonio::brdf
