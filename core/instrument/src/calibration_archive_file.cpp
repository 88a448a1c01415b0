#include <limits>
#include <stdexcept>

#include "gonio/files/atomic_file.h"
#include "gonio/files/text_file.h"
#include "gonio/instrument/calibration_archive.h"
#include "gonio/json/json_document.h"
#include "result_json.h"

namespace gonio::instrument {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kArchiveFormat = "gonio-calibration-archive";
constexpr int kArchiveVersion = 2;
constexpr std::size_t kMaxArchiveBytes = std::size_t{64} << 20U;
constexpr std::int64_t kLastSecond = 253402300799;  // of the year 9999
constexpr std::size_t kMaxParameters = 500;

Json seconds(UtcSeconds time) { return time.time_since_epoch().count(); }

UtcSeconds time_of(JsonFields& fields, const char* key) {
  return UtcSeconds(std::chrono::seconds(fields.whole(key, 0, kLastSecond)));
}

Json text_map(const std::map<std::string, std::string>& map) {
  Json json = Json::object();
  for (const auto& [key, value] : map) json[key] = value;
  return json;
}

Eigen::MatrixXd covariance_of(JsonFields& fields, std::size_t parameters) {
  const std::vector<double> values = fields.numbers("covariance", parameters * parameters);
  const auto count = static_cast<Eigen::Index>(parameters);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(values.data(), count, count);
}

}  // namespace

Json result_to_json(const StepResult& result) {
  Json parameters = Json::array();
  for (const CalibrationParameter& each : result.parameters) {
    parameters.push_back({{"name", each.name}, {"unit", each.unit}, {"value", each.value}});
  }
  Json covariance = Json::array();
  for (Eigen::Index row = 0; row < result.covariance.rows(); ++row) {
    for (Eigen::Index column = 0; column < result.covariance.cols(); ++column) {
      covariance.push_back(result.covariance(row, column));
    }
  }
  Json residuals = Json::object();
  for (const auto& [name, value] : result.residuals) residuals[name] = value;
  Json checks = Json::array();
  for (const AcceptanceCheck& check : result.checks) {
    checks.push_back({{"name", check.name}, {"found", check.found}, {"limit", check.limit}});
  }
  Json raw_data = Json::array();
  for (const RawData& raw : result.raw_data) {
    raw_data.push_back({{"file", raw.file}, {"sha256", raw.sha256}});
  }
  Json document = {{"step", result.step},
                   {"finished_utc_s", seconds(result.finished)},
                   {"valid_until_utc_s", seconds(result.valid_until)},
                   {"inputs", text_map(result.inputs)},
                   {"told", text_map(result.told)},
                   {"parameters", parameters},
                   {"covariance", covariance},
                   {"residuals", residuals},
                   {"checks", checks},
                   {"raw_data", raw_data},
                   {"notes", result.notes}};
  if (result.temperature_deg_c) document["temperature_deg_c"] = *result.temperature_deg_c;
  return document;
}

StepResult result_from_json(JsonFields& fields) {
  StepResult result;
  result.step = fields.text("step");
  result.finished = time_of(fields, "finished_utc_s");
  result.valid_until = time_of(fields, "valid_until_utc_s");
  if (fields.has("temperature_deg_c")) {
    result.temperature_deg_c = fields.number("temperature_deg_c");
  }
  result.inputs = fields.texts_by_name("inputs");
  // Younger than the format: nothing is known of the targets then.
  if (fields.has("told")) result.told = fields.texts_by_name("told");
  fields.each_object("parameters", [&](JsonFields& each) {
    result.parameters.push_back({each.text("name"), each.text("unit"), each.number("value")});
  });
  if (result.parameters.size() > kMaxParameters) {
    throw std::invalid_argument("parameters: found more than a step has");
  }
  result.covariance = covariance_of(fields, result.parameters.size());
  result.residuals = fields.numbers_by_name("residuals");
  fields.each_object("checks", [&](JsonFields& each) {
    result.checks.push_back({each.text("name"), each.number("limit"), each.number("found")});
  });
  fields.each_object("raw_data", [&](JsonFields& each) {
    result.raw_data.push_back({each.text("file"), each.text("sha256")});
  });
  result.notes = fields.texts("notes");
  return result;
}

std::string to_json(const CalibrationArchive& archive) {
  Json results = Json::array();
  for (const StepResult& result : archive.results) results.push_back(result_to_json(result));
  Json document = {{"format", kArchiveFormat},
                   {"version", kArchiveVersion},
                   {"rig_sha256", archive.rig_sha256},
                   {"white_sha256", archive.white_sha256},
                   {"instrument_sha256", archive.instrument_sha256},
                   {"serials", text_map(archive.serials)},
                   {"results", results}};
  if (!archive.redo.empty()) document["redo"] = archive.redo;
  return document.dump(2) + "\n";
}

CalibrationArchive calibration_archive_from_json(const std::string& text,
                                                 const std::filesystem::path& place) {
  const nlohmann::json document =
      json::parse_document(text, place, kArchiveFormat, kArchiveVersion);
  JsonFields fields(document, "", place);
  CalibrationArchive archive;
  try {
    archive.rig_sha256 = fields.text("rig_sha256");
    archive.white_sha256 = fields.text("white_sha256");
    archive.instrument_sha256 = fields.text("instrument_sha256");
    archive.serials = fields.texts_by_name("serials");
    // Earlier versions had one for all.
    std::optional<double> temperature_deg_c;
    if (fields.has("temperature_deg_c")) {
      temperature_deg_c = fields.number_or_null("temperature_deg_c");
    }
    if (fields.has("redo")) {
      const std::vector<std::string> redo = fields.texts("redo");
      archive.redo = {redo.begin(), redo.end()};
    }
    fields.each_object(
        "results", [&](JsonFields& each) { archive.results.push_back(result_from_json(each)); });
    for (StepResult& result : archive.results) {
      if (!result.temperature_deg_c) result.temperature_deg_c = temperature_deg_c;
    }
    fields.finish();
    archive.validate();
  } catch (const std::invalid_argument& error) {
    throw DataFormatError(place, "contents", error.what());
  }
  return archive;
}

CalibrationArchive read_calibration_archive(const std::filesystem::path& path) {
  return calibration_archive_from_json(files::read_text_file(path, kMaxArchiveBytes), path);
}

void write_calibration_archive(const std::filesystem::path& path,
                               const CalibrationArchive& archive) {
  archive.validate();
  files::write_text_file(path, to_json(archive), files::Overwrite::Yes);
}

}  // namespace gonio::instrument
