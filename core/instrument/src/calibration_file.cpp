#include "gonio/instrument/calibration_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "gonio/files/text_file.h"
#include "gonio/json/json_document.h"
#include "rig_json.h"

namespace gonio::instrument {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "gonio-calibration";
constexpr int kVersion = 1;
constexpr std::size_t kMaxBadPixels = 1000000;
constexpr int kLastPixel = 65535;  ///< of a row or column
constexpr std::size_t kMaxFileBytes = std::size_t{16} << 20U;
constexpr const char* kArchiveKey = "archive";
constexpr const char* kArchiveName = "calibration.json";
constexpr const char* kConstantsName = "instrument.json";

CameraModel camera_from_json(JsonFields fields) {
  CameraModel camera{.width_px = fields.integer("width_px"),
                     .height_px = fields.integer("height_px"),
                     .fx_px = fields.number("fx_px"),
                     .fy_px = fields.number("fy_px"),
                     .cx_px = fields.number("cx_px"),
                     .cy_px = fields.number("cy_px"),
                     .k1 = fields.number("k1"),
                     .k2 = fields.number("k2"),
                     .p1 = fields.number("p1"),
                     .p2 = fields.number("p2")};
  fields.finish();
  return camera;
}

ResponseCurve response_from_json(JsonFields fields) {
  ResponseCurve curve{fields.number("scale_dn"), fields.number("c1"), fields.number("c2")};
  fields.finish();
  return curve;
}

/// The last three are younger than the format: a file without them has a straight sensor without
/// bad pixels.
SensorModel sensor_from_json(JsonFields fields) {
  SensorModel sensor{.gain_dn_per_e = fields.number("gain_dn_per_e"),
                     .read_noise_e = fields.number("read_noise_e"),
                     .full_well_e = fields.number("full_well_e"),
                     .black_level_dn = fields.number("black_level_dn"),
                     .saturation_dn = fields.number("saturation_dn"),
                     .dark_current_e_per_s = fields.number("dark_current_e_per_s"),
                     .prnu = fields.number("prnu")};
  if (fields.has("response")) sensor.response = response_from_json(fields.object("response"));
  if (fields.has("shutter_offset_s")) sensor.shutter_offset_s = fields.number("shutter_offset_s");
  if (fields.has("bad_pixels")) {
    for (const auto& [column, row] : fields.pairs("bad_pixels", kMaxBadPixels, kLastPixel)) {
      sensor.bad_pixels.push_back({column, row});
    }
  }
  fields.finish();
  return sensor;
}

Json pixels_to_json(const std::vector<PixelPlace>& pixels) {
  Json list = Json::array();
  for (const PixelPlace& pixel : pixels) list.push_back(Json::array({pixel.column, pixel.row}));
  return list;
}

Vignetting vignetting_from_json(JsonFields fields) {
  Vignetting vignetting{fields.number("v1"), fields.number("v2"), fields.number("v3")};
  fields.finish();
  return vignetting;
}

LampField lamp_field_from_json(JsonFields fields) {
  LampField field{fields.number("c10"), fields.number("c01"), fields.number("c20"),
                  fields.number("c11"), fields.number("c02")};
  fields.finish();
  return field;
}

StrayLight stray_from_json(JsonFields fields) {
  StrayLight stray{fields.number("fraction"), fields.number("u_fraction")};
  fields.finish();
  return stray;
}

/// A list of {theta_i_deg, relative}, or an object with three lists of nodes and the factors.
AngularTable angular_from_json(JsonFields& white) {
  constexpr std::size_t kMaxNodes = 1000000;
  AngularTable table;
  if (white.is_array("angular")) {
    white.each_object("angular", [&](JsonFields& point) {
      table.theta_i_deg.push_back(point.number("theta_i_deg"));
      table.factor.push_back(point.number("relative"));
    });
    if (table.empty()) return table;
    return AngularTable::of_incidence(table.theta_i_deg, table.factor);
  }
  JsonFields fields = white.object("angular");
  table.theta_i_deg = fields.numbers("theta_i_deg");
  table.theta_o_deg = fields.numbers("theta_o_deg");
  table.delta_phi_deg = fields.numbers("delta_phi_deg");
  // Lists are short, so that the product fits.
  const std::size_t nodes =
      table.theta_i_deg.size() * table.theta_o_deg.size() * table.delta_phi_deg.size();
  table.factor = fields.numbers("factor", std::min(nodes, kMaxNodes));
  fields.finish();
  return table;
}

Json angular_to_json(const AngularTable& table) {
  if (table.theta_o_deg.size() > 1 || table.delta_phi_deg.size() > 1) {
    return {{"theta_i_deg", table.theta_i_deg},
            {"theta_o_deg", table.theta_o_deg},
            {"delta_phi_deg", table.delta_phi_deg},
            {"factor", table.factor}};
  }
  Json points = Json::array();
  for (std::size_t i = 0; i < table.factor.size(); ++i) {
    points.push_back({{"theta_i_deg", table.theta_i_deg[i]}, {"relative", table.factor[i]}});
  }
  return points;
}

WhiteReference white_from_json(JsonFields fields) {
  WhiteReference white;
  white.id = fields.text("id");
  white.reflectance = fields.vector<3>("reflectance").array();
  white.angular = angular_from_json(fields);
  white.u_relative = fields.number("u_relative");
  fields.finish();
  return white;
}

}  // namespace

namespace {

Json to_document(const Instrument& instrument) {
  const CameraModel& camera = instrument.camera;
  const SensorModel& sensor = instrument.sensor;
  const LampField& field = instrument.lamp_field;
  const brdf::Rgb& white = instrument.white.reflectance;
  return {{"format", kFormat},
          {"version", kVersion},
          {"id", instrument.id},
          {"rig", rig_to_json(instrument.rig)},
          {"camera",
           {{"width_px", camera.width_px},
            {"height_px", camera.height_px},
            {"fx_px", camera.fx_px},
            {"fy_px", camera.fy_px},
            {"cx_px", camera.cx_px},
            {"cy_px", camera.cy_px},
            {"k1", camera.k1},
            {"k2", camera.k2},
            {"p1", camera.p1},
            {"p2", camera.p2}}},
          {"sensor",
           {{"gain_dn_per_e", sensor.gain_dn_per_e},
            {"read_noise_e", sensor.read_noise_e},
            {"full_well_e", sensor.full_well_e},
            {"black_level_dn", sensor.black_level_dn},
            {"saturation_dn", sensor.saturation_dn},
            {"dark_current_e_per_s", sensor.dark_current_e_per_s},
            {"prnu", sensor.prnu},
            {"response",
             {{"scale_dn", sensor.response.scale_dn},
              {"c1", sensor.response.c1},
              {"c2", sensor.response.c2}}},
            {"shutter_offset_s", sensor.shutter_offset_s},
            {"bad_pixels", pixels_to_json(sensor.bad_pixels)}}},
          {"vignetting",
           {{"v1", instrument.vignetting.v1},
            {"v2", instrument.vignetting.v2},
            {"v3", instrument.vignetting.v3}}},
          {"lamp_field",
           {{"c10", field.c10},
            {"c01", field.c01},
            {"c20", field.c20},
            {"c11", field.c11},
            {"c02", field.c02}}},
          {"stray",
           {{"fraction", instrument.stray.fraction}, {"u_fraction", instrument.stray.u_fraction}}},
          {"white",
           {{"id", instrument.white.id},
            {"reflectance", Json::array({white[0], white[1], white[2]})},
            {"angular", angular_to_json(instrument.white.angular)},
            {"u_relative", instrument.white.u_relative}}},
          {"u_normal_deg", instrument.u_normal.degrees()},
          {"u_lamp_direction_deg", instrument.u_lamp_direction.degrees()},
          {"u_joint_deg", instrument.u_joint.degrees()},
          {"u_lamp_relative", instrument.u_lamp_relative},
          {"u_linearity_relative", instrument.u_linearity_relative}};
}

Instrument instrument_of_document(const nlohmann::json& document,
                                  const std::filesystem::path& place) {
  JsonFields fields(document, "", place);
  Instrument instrument;
  if (fields.has(kArchiveKey) && fields.text(kArchiveKey) != kArchiveName) {
    throw DataFormatError(
        place, kArchiveKey,
        fmt::format("found {:?}, expected {:?}", fields.text(kArchiveKey), kArchiveName));
  }
  instrument.id = fields.text("id");
  JsonFields rig = fields.object("rig");
  instrument.rig = rig_from_json(rig);
  rig.finish();
  instrument.camera = camera_from_json(fields.object("camera"));
  instrument.sensor = sensor_from_json(fields.object("sensor"));
  instrument.vignetting = vignetting_from_json(fields.object("vignetting"));
  instrument.lamp_field = lamp_field_from_json(fields.object("lamp_field"));
  // Younger than the format.
  if (fields.has("stray")) instrument.stray = stray_from_json(fields.object("stray"));
  instrument.white = white_from_json(fields.object("white"));
  instrument.u_normal = Angle::from_degrees(fields.number("u_normal_deg"));
  // Younger than the format: a file without them takes lamp and axes as certain.
  if (fields.has("u_lamp_direction_deg")) {
    instrument.u_lamp_direction = Angle::from_degrees(fields.number("u_lamp_direction_deg"));
  }
  if (fields.has("u_joint_deg")) {
    instrument.u_joint = Angle::from_degrees(fields.number("u_joint_deg"));
  }
  instrument.u_lamp_relative = fields.number("u_lamp_relative");
  instrument.u_linearity_relative = fields.number("u_linearity_relative");
  fields.finish();
  try {
    instrument.validate();
  } catch (const std::invalid_argument& error) {
    throw DataFormatError(place, "contents", error.what());
  }
  return instrument;
}

void require_beside_archive(const std::filesystem::path& path) {
  const std::filesystem::path real = std::filesystem::canonical(path);
  if (real.filename() == kConstantsName &&
      std::filesystem::exists(real.parent_path() / kArchiveName)) {
    return;
  }
  throw DataFormatError(path, kArchiveKey,
                        fmt::format("found the constants of a calibration away from its {}, which "
                                    "says how old they are; give the calibration's folder, or a "
                                    "copy of the whole of it",
                                    kArchiveName));
}

}  // namespace

std::string to_json(const Instrument& instrument) { return to_document(instrument).dump(2) + "\n"; }

std::string calibrated_to_json(const Instrument& instrument) {
  Json document = to_document(instrument);
  document[kArchiveKey] = kArchiveName;
  return document.dump(2) + "\n";
}

Instrument instrument_from_json(const std::string& text, const std::filesystem::path& place) {
  return instrument_of_document(json::parse_document(text, place, kFormat, kVersion), place);
}

Instrument read_calibration(const std::filesystem::path& path) {
  const nlohmann::json document =
      json::parse_document(files::read_text_file(path, kMaxFileBytes), path, kFormat, kVersion);
  if (document.contains(kArchiveKey)) require_beside_archive(path);
  return instrument_of_document(document, path);
}

void write_calibration(const std::filesystem::path& path, const Instrument& instrument,
                       files::Overwrite overwrite) {
  files::write_text_file(path, to_json(instrument), overwrite);
}

}  // namespace gonio::instrument
