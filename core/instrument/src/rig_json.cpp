#include "rig_json.h"

namespace gonio::instrument {
namespace {

using Json = nlohmann::ordered_json;

Json numbers(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

std::string axis_name(const rig::RigDescription& rig, std::size_t axis) {
  return rig.axes.at(axis).name;
}

Json chain_to_json(const rig::RigDescription& rig, const rig::Chain& chain) {
  Json links = Json::array();
  for (const rig::ChainLink& link : chain.links) {
    links.push_back({{"axis", axis_name(rig, link.axis)},
                     {"direction", numbers(link.direction)},
                     {"point_mm", numbers(link.point_mm)},
                     {"scale", link.scale},
                     {"offset_deg", link.offset.degrees()},
                     {"lead_mm_per_turn", link.lead_mm_per_turn}});
  }
  Json rotation = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      rotation.push_back(chain.home_pose.linear()(row, column));
    }
  }
  return {{"links", links},
          {"home_rotation", rotation},
          {"home_position_mm", numbers(chain.home_pose.translation())}};
}

std::size_t axis_index(const rig::RigDescription& rig, const std::string& name) {
  for (std::size_t i = 0; i < rig.axes.size(); ++i) {
    if (rig.axes[i].name == name) return i;
  }
  return rig.axes.size();  // RigDescription::validate() names the link
}

rig::Chain chain_from_json(const rig::RigDescription& rig, JsonFields fields) {
  rig::Chain chain;
  fields.each_object("links", [&](JsonFields& link) {
    rig::ChainLink parsed;
    parsed.axis = axis_index(rig, link.text("axis"));
    parsed.direction = link.vector<3>("direction");
    parsed.point_mm = link.vector<3>("point_mm");
    parsed.scale = link.number("scale");
    parsed.offset = Angle::from_degrees(link.number("offset_deg"));
    parsed.lead_mm_per_turn = link.number("lead_mm_per_turn");
    chain.links.push_back(parsed);
  });
  const Eigen::Matrix<double, 9, 1> rotation = fields.vector<9>("home_rotation");
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      chain.home_pose.linear()(row, column) = rotation[3 * row + column];
    }
  }
  chain.home_pose.translation() = fields.vector<3>("home_position_mm");
  fields.finish();
  return chain;
}

}  // namespace

Json rig_to_json(const rig::RigDescription& rig) {
  Json axes = Json::array();
  for (const rig::Axis& axis : rig.axes) {
    axes.push_back({{"name", axis.name},
                    {"min_deg", axis.min.degrees()},
                    {"max_deg", axis.max.degrees()},
                    {"max_speed_deg_per_s", axis.max_speed_deg_per_s},
                    {"acceleration_deg_per_s2", axis.acceleration_deg_per_s2},
                    {"settle_ms", axis.settle.count()},
                    {"approach_overshoot_deg", axis.approach_overshoot.degrees()},
                    {"home_deg", axis.home.degrees()}});
  }
  Json keep_outs = Json::array();
  for (const rig::KeepOut& keep_out : rig.keep_outs) {
    Json ranges = Json::array();
    for (const rig::KeepOut::Range& range : keep_out.ranges) {
      ranges.push_back({{"axis", axis_name(rig, range.axis)},
                        {"min_deg", range.min.degrees()},
                        {"max_deg", range.max.degrees()}});
    }
    keep_outs.push_back({{"name", keep_out.name}, {"ranges", ranges}});
  }
  return {{"name", rig.name},
          {"axes", axes},
          {"camera_chain", chain_to_json(rig, rig.camera)},
          {"lamp_chain", chain_to_json(rig, rig.lamp)},
          {"sample_chain", chain_to_json(rig, rig.sample)},
          {"collimated_lamp", rig.collimated_lamp},
          {"theta_i_max_deg", rig.limits.theta_i_max.degrees()},
          {"theta_o_max_deg", rig.limits.theta_o_max.degrees()},
          {"theta_d_min_deg", rig.limits.theta_d_min.degrees()},
          {"footprint",
           {{"sample_half_width_mm", rig.limits.footprint.sample_half_width_mm},
            {"edge_margin_mm", rig.limits.footprint.edge_margin_mm},
            {"spot_half_width_mm", rig.limits.footprint.spot_half_width_mm},
            {"min_projected_half_width_mm", rig.limits.footprint.min_projected_half_width_mm},
            {"camera_half_field_deg", rig.limits.footprint.camera_half_field.degrees()}}},
          {"keep_outs", keep_outs},
          {"simultaneous_axes", rig.simultaneous_axes}};
}

rig::RigDescription rig_from_json(JsonFields& fields) {
  rig::RigDescription rig;
  rig.name = fields.text("name");
  fields.each_object("axes", [&](JsonFields& axis) {
    rig::Axis parsed;
    parsed.name = axis.text("name");
    parsed.min = Angle::from_degrees(axis.number("min_deg"));
    parsed.max = Angle::from_degrees(axis.number("max_deg"));
    parsed.max_speed_deg_per_s = axis.number("max_speed_deg_per_s");
    parsed.acceleration_deg_per_s2 = axis.number("acceleration_deg_per_s2");
    parsed.settle = std::chrono::milliseconds(axis.integer("settle_ms"));
    parsed.approach_overshoot = Angle::from_degrees(axis.number("approach_overshoot_deg"));
    parsed.home = Angle::from_degrees(axis.number("home_deg"));
    rig.axes.push_back(parsed);
  });
  rig.camera = chain_from_json(rig, fields.object("camera_chain"));
  rig.lamp = chain_from_json(rig, fields.object("lamp_chain"));
  rig.sample = chain_from_json(rig, fields.object("sample_chain"));
  rig.collimated_lamp = fields.boolean("collimated_lamp");
  rig.limits.theta_i_max = Angle::from_degrees(fields.number("theta_i_max_deg"));
  rig.limits.theta_o_max = Angle::from_degrees(fields.number("theta_o_max_deg"));
  rig.limits.theta_d_min = Angle::from_degrees(fields.number("theta_d_min_deg"));
  JsonFields footprint = fields.object("footprint");
  rig.limits.footprint.sample_half_width_mm = footprint.number("sample_half_width_mm");
  rig.limits.footprint.edge_margin_mm = footprint.number("edge_margin_mm");
  rig.limits.footprint.spot_half_width_mm = footprint.number("spot_half_width_mm");
  rig.limits.footprint.min_projected_half_width_mm =
      footprint.number("min_projected_half_width_mm");
  rig.limits.footprint.camera_half_field =
      Angle::from_degrees(footprint.number("camera_half_field_deg"));
  footprint.finish();
  fields.each_object("keep_outs", [&](JsonFields& keep_out) {
    rig::KeepOut parsed{keep_out.text("name"), {}};
    keep_out.each_object("ranges", [&](JsonFields& range) {
      parsed.ranges.push_back({axis_index(rig, range.text("axis")),
                               Angle::from_degrees(range.number("min_deg")),
                               Angle::from_degrees(range.number("max_deg"))});
    });
    rig.keep_outs.push_back(parsed);
  });
  rig.simultaneous_axes = fields.boolean("simultaneous_axes");
  return rig;
}

}  // namespace gonio::instrument
