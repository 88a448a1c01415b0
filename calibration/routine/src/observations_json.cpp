#include <algorithm>
#include <cmath>
#include <cstdint>

#include "gonio/calibration/routine/observations.h"
#include "gonio/json/json_document.h"
#include "gonio/json/json_fields.h"

namespace gonio::calibration::routine {
namespace {

using Json = nlohmann::ordered_json;
using json::JsonFields;

constexpr const char* kFormat = "gonio-calibration-observations";
constexpr int kVersion = 3;
constexpr std::int64_t kMaxHomings = 1'000'000'000;
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 31;

/// Of DN/s times mm2, and of seconds since whenever: what lies beyond was measured by nobody, and
/// its powers are none of a double.
constexpr double kLargestNumber = 1e18;

void require_measurable(const nlohmann::json& value, const std::string& key,
                        const std::filesystem::path& place) {
  if (value.is_number() && !(std::abs(value.get<double>()) <= kLargestNumber)) {
    throw DataFormatError(place, key,
                          fmt::format("found {}, expected a number of at most {:g} either way",
                                      value.dump(), kLargestNumber));
  }
  if (!value.is_structured()) return;
  for (const auto& item : value.items()) {
    const std::string& name = item.key();
    require_measurable(item.value(),
                       value.is_array() ? fmt::format("{}[{}]", key, name)
                       : key.empty()    ? name
                                        : key + "." + name,
                       place);
  }
}

// Angles are kept in radians, as they are in memory, so that they read back exactly.

Json joints_json(const rig::Joints& joints) {
  Json array = Json::array();
  for (const Angle joint : joints) array.push_back(joint.radians());
  return array;
}

rig::Joints joints_of(JsonFields& fields) {
  const auto count = static_cast<std::size_t>(fields.whole("axes", 1, 32));
  rig::Joints joints;
  for (const double value : fields.numbers("joints_rad", count)) {
    joints.push_back(Angle::from_radians(value));
  }
  return joints;
}

void put_joints(Json& json, const rig::Joints& joints) {
  json["axes"] = joints.size();
  json["joints_rad"] = joints_json(joints);
}

/// Numbers of one kind, many in a row: a count and the flat list.
template <class Item, class Put>
Json flat(const std::vector<Item>& items, const Put& put) {
  Json values = Json::array();
  for (const Item& item : items) put(item, values);
  return {{"count", items.size()}, {"values", values}};
}

template <std::size_t N, class Take>
void each_flat(JsonFields& fields, const char* key, const Take& take) {
  JsonFields list = fields.object(key);
  const auto count = static_cast<std::size_t>(list.whole("count", 0, 50'000'000));
  const std::vector<double> values = list.numbers("values", count * N);
  list.finish();
  for (std::size_t i = 0; i < count; ++i) take(values.data() + i * N);
}

Json estimate_json(const Estimate& estimate) {
  return {{"value", estimate.value}, {"sigma", estimate.sigma}};
}

Estimate estimate_of(JsonFields& fields, const char* key) {
  JsonFields each = fields.object(key);
  const Estimate estimate{each.number("value"), each.number("sigma")};
  each.finish();
  return estimate;
}

Json axis_json(const AxisRecord& record) {
  return {{"axis", record.axis},
          {"homings_rad", flat(record.homings, [](Angle a, Json& v) { v.push_back(a.radians()); })},
          {"approaches", flat(record.approaches,
                              [](const sensor::Approach& a, Json& v) {
                                v.push_back(a.target.radians());
                                v.push_back(a.rising ? 1 : 0);
                                v.push_back(a.reading.radians());
                                v.push_back(a.observed.radians());
                              })},
          {"settling", flat(record.settling, [](const sensor::AngleReading& r, Json& v) {
             v.push_back(r.time_s);
             v.push_back(r.angle.radians());
           })}};
}

AxisRecord axis_of(JsonFields& fields) {
  AxisRecord record;
  record.axis = fields.text("axis");
  each_flat<1>(fields, "homings_rad",
               [&](const double* v) { record.homings.push_back(Angle::from_radians(v[0])); });
  each_flat<4>(fields, "approaches", [&](const double* v) {
    record.approaches.push_back({Angle::from_radians(v[0]), v[1] != 0.0, Angle::from_radians(v[2]),
                                 Angle::from_radians(v[3])});
  });
  each_flat<2>(fields, "settling", [&](const double* v) {
    record.settling.push_back({v[0], Angle::from_radians(v[1])});
  });
  return record;
}

Json level_json(const sensor::LevelStatistics& level) {
  return {{"exposure_s", level.exposure_s},
          {"mean_dn", estimate_json(level.mean_dn)},
          {"variance_dn2", estimate_json(level.variance_dn2)},
          {"mean_difference_dn", level.mean_difference_dn},
          {"saturated_fraction", level.saturated_fraction},
          {"black_fraction", level.black_fraction},
          {"pixels", level.pixels}};
}

sensor::LevelStatistics level_of(JsonFields& fields) {
  sensor::LevelStatistics level;
  level.exposure_s = fields.number("exposure_s");
  level.mean_dn = estimate_of(fields, "mean_dn");
  level.variance_dn2 = estimate_of(fields, "variance_dn2");
  level.mean_difference_dn = fields.number("mean_difference_dn");
  level.saturated_fraction = fields.number("saturated_fraction");
  level.black_fraction = fields.number("black_fraction");
  level.pixels = static_cast<std::size_t>(fields.whole("pixels", 0, kMaxPixels));
  return level;
}

Json board_json(const geometry::StageView& view) {
  Json json = {{"corners", flat(view.board.corners, [](const geometry::BoardCorner& c, Json& v) {
                  v.push_back(c.id);
                  for (const double x : {c.pixel.x(), c.pixel.y(), c.point_mm.x(), c.point_mm.y()})
                    v.push_back(x);
                })}};
  put_joints(json, view.joints);
  return json;
}

geometry::StageView board_of(JsonFields& fields) {
  geometry::StageView view;
  view.joints = joints_of(fields);
  each_flat<5>(fields, "corners", [&](const double* v) {
    view.board.corners.push_back(
        {static_cast<int>(std::clamp(v[0], -1e6, 1e6)), {v[1], v[2]}, {v[3], v[4]}});
  });
  return view;
}

Json white_json(const WhiteView& view) {
  Json json = {{"channel", view.channel},
               {"monitor", view.monitor},
               {"exposure_s", view.exposure_s},
               {"pixels", flat(view.pixels, [](const PixelSignal& p, Json& v) {
                  for (const double x : {p.column, p.row, p.dn_per_s, p.sigma_dn_per_s})
                    v.push_back(x);
                })}};
  put_joints(json, view.joints);
  return json;
}

WhiteView white_of(JsonFields& fields) {
  WhiteView view;
  view.joints = joints_of(fields);
  view.channel = static_cast<int>(fields.whole("channel", 0, 2));
  view.monitor = fields.number("monitor");
  view.exposure_s = fields.number("exposure_s");
  each_flat<4>(fields, "pixels", [&](const double* v) {
    view.pixels.push_back({v[0], v[1], v[2], v[3]});
  });
  return view;
}

Json scan_json(const PeakScan& scan) {
  Json samples = Json::array();
  for (const geometry::PeakSample& sample : scan.samples) {
    Json json = {{"signal", sample.signal}, {"sigma", sample.sigma}};
    put_joints(json, sample.joints);
    samples.push_back(std::move(json));
  }
  return {{"turned", scan.turned}, {"samples", samples}};
}

PeakScan scan_of(JsonFields& fields) {
  PeakScan scan;
  scan.turned = fields.boolean("turned");
  fields.each_object("samples", [&](JsonFields& each) {
    geometry::PeakSample sample;
    sample.joints = joints_of(each);
    sample.signal = each.number("signal");
    sample.sigma = each.number("sigma");
    scan.samples.push_back(std::move(sample));
  });
  return scan;
}

template <class Item, class ToJson>
Json list(const std::vector<Item>& items, const ToJson& to_json_of) {
  Json array = Json::array();
  for (const Item& item : items) array.push_back(to_json_of(item));
  return array;
}

}  // namespace

std::string to_json(const std::string& step, const Observations& seen) {
  Json document = {
      {"format", kFormat},
      {"version", kVersion},
      {"step", step},
      {"homing", seen.homing},
      {"axes", list(seen.axes, axis_json)},
      {"lamp", flat(seen.lamp,
                    [](const sensor::LampReading& r, Json& v) {
                      v.push_back(r.time_s);
                      v.push_back(r.value);
                    })},
      {"darks", nullptr},
      {"defects", flat(seen.defects,
                       [](const DefectivePixel& d, Json& v) {
                         v.push_back(d.index);
                         v.push_back(d.bits);
                       })},
      {"dark_levels", list(seen.dark_levels, level_json)},
      {"levels", list(seen.levels, level_json)},
      {"non_uniformity", nullptr},
      {"boards", list(seen.boards, board_json)},
      {"boards_turned", list(seen.boards_turned, board_json)},
      {"mirrors", list(seen.mirrors,
                       [](const geometry::MirrorView& m) {
                         Json json = {{"pixel", {m.pixel.x(), m.pixel.y()}}, {"turned", m.turned}};
                         put_joints(json, m.joints);
                         return json;
                       })},
      {"scans", list(seen.scans, scan_json)},
      {"whites", list(seen.whites, white_json)},
      {"glasses", list(seen.glasses, [](const GlassView& g) {
         Json json = {{"pixel", {g.pixel.x(), g.pixel.y()}}, {"light", g.light}};
         put_joints(json, g.joints);
         return json;
       })}};
  if (!seen.chart.empty()) {
    document["chart"] = flat(seen.chart, [](const Eigen::Vector3d& patch, Json& v) {
      for (const double x : {patch.x(), patch.y(), patch.z()}) v.push_back(x);
    });
  }
  document["constant"] = nullptr;
  if (seen.constant) document["constant"] = *seen.constant;
  if (seen.darks) {
    document["darks"] = {
        {"black_level_dn", estimate_json(seen.darks->black_level_dn)},
        {"dark_current_dn_per_s", estimate_json(seen.darks->dark_current_dn_per_s)},
        {"temporal_noise_dn", estimate_json(seen.darks->temporal_noise_dn)},
        {"black_change_dn", seen.darks->black_change_dn},
        {"bad_fraction", seen.darks->bad_fraction}};
  }
  if (seen.non_uniformity) {
    document["non_uniformity"] = {{"dsnu_dn", estimate_json(seen.non_uniformity->dsnu_dn)},
                                  {"prnu", estimate_json(seen.non_uniformity->prnu)},
                                  {"bright_signal_dn", seen.non_uniformity->bright_signal_dn},
                                  {"pixels", seen.non_uniformity->pixels}};
  }
  return document.dump() + "\n";
}

Observations observations_from_json(const std::string& text, const std::string& step,
                                    const std::filesystem::path& place) {
  const nlohmann::json document = json::parse_document(text, place, kFormat, kVersion);
  JsonFields fields(document, "", place);
  if (const std::string found = fields.text("step"); found != step) {
    throw DataFormatError(place, "step", fmt::format("found {:?}, expected {:?}", found, step));
  }
  require_measurable(document, "", place);
  Observations seen;
  seen.homing = static_cast<int>(fields.whole("homing", 0, kMaxHomings));
  fields.each_object("axes", [&](JsonFields& each) { seen.axes.push_back(axis_of(each)); });
  each_flat<2>(fields, "lamp", [&](const double* v) { seen.lamp.push_back({v[0], v[1]}); });
  if (!fields.is_null("darks")) {
    JsonFields each = fields.object("darks");
    seen.darks =
        DarkSummary{estimate_of(each, "black_level_dn"), estimate_of(each, "dark_current_dn_per_s"),
                    estimate_of(each, "temporal_noise_dn"), each.number("black_change_dn"),
                    each.number("bad_fraction")};
    each.finish();
  }
  each_flat<2>(fields, "defects", [&](const double* v) {
    seen.defects.push_back({static_cast<std::uint32_t>(std::clamp(v[0], 0.0, 4e9)),
                            static_cast<std::uint8_t>(std::clamp(v[1], 0.0, 255.0))});
  });
  fields.each_object("dark_levels",
                     [&](JsonFields& each) { seen.dark_levels.push_back(level_of(each)); });
  fields.each_object("levels", [&](JsonFields& each) { seen.levels.push_back(level_of(each)); });
  if (!fields.is_null("non_uniformity")) {
    JsonFields each = fields.object("non_uniformity");
    seen.non_uniformity = sensor::NonUniformity{
        estimate_of(each, "dsnu_dn"), estimate_of(each, "prnu"), each.number("bright_signal_dn"),
        static_cast<std::size_t>(each.whole("pixels", 0, kMaxPixels))};
    each.finish();
  }
  fields.each_object("boards", [&](JsonFields& each) { seen.boards.push_back(board_of(each)); });
  fields.each_object("boards_turned",
                     [&](JsonFields& each) { seen.boards_turned.push_back(board_of(each)); });
  fields.each_object("mirrors", [&](JsonFields& each) {
    const rig::Joints joints = joints_of(each);
    seen.mirrors.push_back({joints, each.vector<2>("pixel"), each.boolean("turned")});
  });
  fields.each_object("scans", [&](JsonFields& each) { seen.scans.push_back(scan_of(each)); });
  fields.each_object("whites", [&](JsonFields& each) { seen.whites.push_back(white_of(each)); });
  fields.each_object("glasses", [&](JsonFields& each) {
    const rig::Joints joints = joints_of(each);
    seen.glasses.push_back({joints, each.vector<2>("pixel"), each.number("light")});
  });
  if (fields.has("chart")) {
    each_flat<3>(fields, "chart",
                 [&](const double* v) { seen.chart.emplace_back(v[0], v[1], v[2]); });
  }
  if (!fields.is_null("constant")) {
    const auto constant = fields.vector<3>("constant");
    seen.constant = {constant[0], constant[1], constant[2]};
  }
  fields.finish();
  return seen;
}

}  // namespace gonio::calibration::routine
