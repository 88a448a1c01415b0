#include "plan_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gonio/console/printable.h"
#include "gonio/errors/errors.h"
#include "gonio/rig/travel.h"
#include "gonio/samples/csv.h"
#include "gonio/samples/samples.h"

namespace gonio::cli {
namespace {

std::string joint_column(const rig::Axis& axis) { return axis.name + "_deg"; }

std::string direction_cells(const brdf::HalfDiff& direction) {
  return samples::csv_degrees(direction.theta_h) + "," + samples::csv_degrees(direction.theta_d) +
         "," + samples::csv_degrees(direction.phi_d);
}

std::string comment_lines(const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) text += "# " + printable_line(comment) + "\n";
  return text;
}

/// What an isotropic BRDF sees of a pair of directions: no turn about the normal changes it, and
/// unlike the half/difference angles it has no poles.
Eigen::Vector4d invariants(const brdf::DirectionPair& pair) {
  return {pair.wi.z(), pair.wo.z(), pair.wi.dot(pair.wo), pair.wi.cross(pair.wo).z()};
}

/// Directions at the sample's origin, exchanged and mirrored as the branch says.
bool realises(const rig::RigDescription& rig, const rig::PoseSolution& pose,
              const brdf::HalfDiff& wanted) {
  brdf::DirectionPair pair = rig::forward(rig, pose.joints).directions_at(Eigen::Vector3d::Zero());
  if (pose.branch == rig::Branch::C || pose.branch == rig::Branch::D) std::swap(pair.wi, pair.wo);
  brdf::HalfDiff asked = wanted;
  if (pose.mirrored) asked.phi_d = -asked.phi_d;
  constexpr double kTolerance = 1e-6;  // joints are written to the last bit; people round
  return (invariants(pair) - invariants(brdf::directions_from_half_diff(asked))).norm() <
         kTolerance;
}

void require_realised(const samples::CsvReader& reader, const samples::CsvRow& row,
                      std::size_t branch_column, const rig::RigDescription& rig,
                      const rig::Inverse& inverse, const acquisition::PlannedPoint& point) {
  if (!realises(rig, point.pose, point.direction)) {
    throw DataFormatError(reader.path(), fmt::format("line {}", row.line),
                          fmt::format("the joints do not realise this direction, branch {}, on "
                                      "rig {}: plan again with its calibration; for an aligned "
                                      "sample leave the joints' columns out",
                                      row.cells[branch_column], rig.name));
  }
  if (!inverse.on_named_side(point.direction, point.pose)) {
    throw DataFormatError(reader.path(), reader.place(row, branch_column),
                          fmt::format("found {:?}, but the joints stand on the other lamp side",
                                      row.cells[branch_column]));
  }
}

std::size_t required_column(const samples::CsvReader& reader, const std::string& name) {
  if (const auto column = reader.column(name)) return *column;
  throw DataFormatError(reader.path(), fmt::format("line {}", reader.header_line()),
                        "found no column " + name);
}

enum class Realised { required, known };

/// Points of a file with the columns of plan_text().
acquisition::MeasurementPlan poses_of(samples::CsvReader reader, const rig::RigDescription& rig,
                                      Realised realised) {
  const rig::TravelModel travel(rig);
  const rig::Inverse inverse(rig);
  const std::size_t theta_h_column = required_column(reader, "theta_h_deg");
  const std::size_t theta_d_column = required_column(reader, "theta_d_deg");
  const std::size_t phi_d_column = required_column(reader, "phi_d_deg");
  const std::size_t branch_column = required_column(reader, "branch");
  const auto predicted_column = reader.column("predicted_s");
  const auto again_column = reader.column("again");
  acquisition::MeasurementPlan plan;
  rig::Joints before = acquisition::tour_ends(rig);
  while (const auto row = reader.next()) {
    acquisition::PlannedPoint point;
    const auto angle = [&](std::size_t column, double min, double max) {
      return Angle::from_degrees(reader.number_within(*row, column, min, max));
    };
    point.direction.theta_h = angle(theta_h_column, 0.0, 90.0);
    point.direction.theta_d = angle(theta_d_column, 0.0, 90.0);
    point.direction.phi_d = angle(phi_d_column, -180.0, 180.0);
    for (const rig::Axis& axis : rig.axes) {
      point.pose.joints.push_back(angle(required_column(reader, joint_column(axis)),
                                        axis.min.degrees() - 1e-6, axis.max.degrees() + 1e-6));
    }
    const std::string& branch = row->cells[branch_column];
    point.pose.mirrored = branch.size() == 2 && branch[1] == '\'';
    if (branch.empty() || branch[0] < 'A' || branch[0] > 'D' ||
        branch.size() != (point.pose.mirrored ? 2U : 1U)) {
      throw DataFormatError(reader.path(), reader.place(*row, branch_column),
                            fmt::format("found {:?}, expected A, B, C or D", branch));
    }
    point.pose.branch = static_cast<rig::Branch>(branch[0] - 'A');
    if (realised == Realised::required) {
      require_realised(reader, *row, branch_column, rig, inverse, point);
    }
    point.travel_s = travel.seconds(before, point.pose.joints);
    point.predicted_s = point.travel_s;
    if (predicted_column) point.predicted_s = reader.number_within(*row, *predicted_column, 0, 1e6);
    if (again_column) point.again = reader.number_within(*row, *again_column, 0, 1) > 0.5;
    before = point.pose.joints;
    plan.travel_s += point.travel_s;
    plan.duration_s += point.predicted_s;
    plan.points.push_back(std::move(point));
  }
  return plan;
}

}  // namespace

std::string plan_text(const rig::RigDescription& rig, const acquisition::MeasurementPlan& plan,
                      const std::vector<double>& exposures_us,
                      const std::vector<std::string>& comments) {
  std::string text = comment_lines(comments) + "theta_h_deg,theta_d_deg,phi_d_deg,order";
  for (const rig::Axis& axis : rig.axes) text += "," + samples::csv_cell(joint_column(axis));
  text += ",branch";
  if (!exposures_us.empty()) text += ",exposure_us";
  const bool pairs = std::any_of(plan.points.begin(), plan.points.end(),
                                 [](const auto& point) { return point.again; });
  if (pairs) text += ",again";
  text += ",predicted_s\n";
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const acquisition::PlannedPoint& point = plan.points[i];
    text += direction_cells(point.direction) + fmt::format(",{}", i + 1);
    for (const Angle joint : point.pose.joints) text += "," + samples::csv_degrees(joint);
    text += "," + rig::branch_name(point.pose);
    if (!exposures_us.empty()) text += "," + samples::csv_number(exposures_us[i]);
    if (pairs) text += point.again ? ",1" : ",0";
    text += fmt::format(",{:.2f}\n", point.predicted_s);
  }
  return text;
}

std::string directions_text(const std::vector<brdf::HalfDiff>& directions,
                            const std::vector<std::string>& comments) {
  std::string text = comment_lines(comments) + "theta_h_deg,theta_d_deg,phi_d_deg\n";
  for (const brdf::HalfDiff& direction : directions) text += direction_cells(direction) + "\n";
  return text;
}

bool has_poses(const std::filesystem::path& path, const rig::RigDescription& rig) {
  const samples::CsvReader reader(path);
  for (const rig::Axis& axis : rig.axes) {
    if (!reader.column(joint_column(axis))) return false;
  }
  return reader.column("branch").has_value();
}

acquisition::MeasurementPlan read_poses(const std::filesystem::path& path,
                                        const rig::RigDescription& rig) {
  // Checks ranges, the horizon and duplicates.
  samples::read_directions(path);
  return poses_of(samples::CsvReader(path), rig, Realised::required);
}

std::vector<double> planned_exposures_us(const std::filesystem::path& path) {
  samples::CsvReader reader(path);
  std::vector<double> exposures;
  const auto column = reader.column("exposure_us");
  if (!column) return exposures;
  constexpr double kLongest_us = 1e9;
  while (const auto row = reader.next()) {
    exposures.push_back(reader.number_within(*row, *column, 1e-3, kLongest_us));
  }
  return exposures;
}

acquisition::MeasurementPlan realised_poses(const std::string& text,
                                            const std::filesystem::path& place,
                                            const rig::RigDescription& rig) {
  return poses_of(samples::CsvReader(place, text), rig, Realised::required);
}

acquisition::MeasurementPlan stored_poses(const std::string& text,
                                          const std::filesystem::path& place,
                                          const rig::RigDescription& rig) {
  return poses_of(samples::CsvReader(place, text), rig, Realised::known);
}

}  // namespace gonio::cli
