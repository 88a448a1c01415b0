#include "keep_out_keys.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

#include "config_ranges.h"
#include "config_writer.h"
#include "gonio/errors/errors.h"
#include "gonio/rig/paths.h"

namespace gonio::cli {
namespace {

/// A range of a keep-out before its keys are read, which have no defaults.
constexpr rig::KeepOut::Range kUnsaid{
    std::numeric_limits<std::size_t>::max(),
    Angle::from_radians(std::numeric_limits<double>::quiet_NaN()),
    Angle::from_radians(std::numeric_limits<double>::quiet_NaN())};
constexpr std::string_view kKeepOuts =
    "Boxes of joint angles that no pose and no path may touch; axes left out are free";

}  // namespace

void visit_keep_outs(ConfigVisitor& v, rig::RigDescription& rig) {
  std::vector<std::string> names;
  for (const rig::Axis& axis : rig.axes) names.push_back(axis.name);
  v.array(
      "keep_out", kKeepOuts, rig.keep_outs.size(),
      [&](std::size_t count) { rig.keep_outs.assign(count, {}); },
      [&](std::size_t i) {
        rig::KeepOut& keep_out = rig.keep_outs[i];
        v.text("name", keep_out.name, "said when it refuses a pose");
        v.array(
            "range", "", keep_out.ranges.size(),
            [&](std::size_t count) { keep_out.ranges.assign(count, kUnsaid); },
            [&](std::size_t k) {
              rig::KeepOut::Range& range = keep_out.ranges[k];
              v.choice("axis", range.axis, names, "");
              v.angle("min_deg", range.min, kAnyDegrees, "");
              v.angle("max_deg", range.max, kAnyDegrees, "");
            });
      });
}

void check_keep_outs(const rig::RigDescription& rig, const ConfigReader& reader,
                     const std::filesystem::path& place) {
  // A key that is not there is reported at its table.
  const auto refuse = [&](const std::string& table, const std::string& key,
                          const std::string& why) {
    const int line = reader.line_of(table + "." + key);
    throw ConfigError(place, line > 0 ? line : reader.line_of(table), table + "." + key, why);
  };
  for (std::size_t i = 0; i < rig.keep_outs.size(); ++i) {
    const rig::KeepOut& keep_out = rig.keep_outs[i];
    const std::string table = fmt::format("keep_out[{}]", i);
    if (keep_out.name.empty()) refuse(table, "name", "found none, expected a name");
    if (keep_out.ranges.empty()) refuse(table, "range", "found none, expected at least one");
    for (std::size_t k = 0; k < keep_out.ranges.size(); ++k) {
      const rig::KeepOut::Range& range = keep_out.ranges[k];
      const std::string part = fmt::format("{}.range[{}]", table, k);
      if (range.axis == kUnsaid.axis) refuse(part, "axis", "found none, expected an axis");
      if (std::isnan(range.min.radians())) refuse(part, "min_deg", "found none, expected a number");
      if (std::isnan(range.max.radians())) refuse(part, "max_deg", "found none, expected a number");
      if (range.min > range.max) {
        refuse(part, "min_deg",
               fmt::format("found {:g}, expected at most max_deg = {:g}", range.min.degrees(),
                           range.max.degrees()));
      }
      const rig::Axis& axis = rig.axes[range.axis];
      if (range.max < axis.min || range.min > axis.max) {
        refuse(part, range.max < axis.min ? "max_deg" : "min_deg",
               fmt::format("found {:g} to {:g}, expected some of the travel of {}, {:g} to {:g}",
                           range.min.degrees(), range.max.degrees(), axis.name, axis.min.degrees(),
                           axis.max.degrees()));
      }
    }
  }
  for (std::size_t i = 0; i < rig.keep_outs.size(); ++i) {
    rig::RigDescription only = rig;
    only.keep_outs = {rig.keep_outs[i]};
    if (rig::keep_out_at(only, rig.home(), rig::kPlanningMargin)) {
      refuse(fmt::format("keep_out[{}]", i), "range",
             fmt::format("holds the axes' home or comes within {:g} deg of it",
                         rig::kPlanningMargin.degrees()));
    }
  }
}

std::string keep_out_example(const rig::RigDescription& rig) {
  rig::RigDescription with_one = rig;
  with_one.keep_outs = {
      {"lamp behind the raised sample",
       {{0, Angle::from_degrees(150.0), Angle::from_degrees(165.0)},
        {rig.axes.size() - 1, Angle::from_degrees(60.0), Angle::from_degrees(70.0)}}}};
  ConfigWriter writer(true);
  visit_keep_outs(writer, with_one);
  std::string text;
  std::istringstream lines(writer.text_so_far());
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.front() != '#') text += "# ";
    text += line + "\n";
  }
  return text;
}

}  // namespace gonio::cli
