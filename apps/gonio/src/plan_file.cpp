#include "plan_file.h"

#include <fmt/format.h>

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

}  // namespace

std::string plan_text(const rig::RigDescription& rig, const acquisition::MeasurementPlan& plan,
                      const std::vector<double>& exposures_us,
                      const std::vector<std::string>& comments) {
  std::string text = comment_lines(comments) + "theta_h_deg,theta_d_deg,phi_d_deg,order";
  for (const rig::Axis& axis : rig.axes) text += "," + samples::csv_cell(joint_column(axis));
  text += ",branch";
  if (!exposures_us.empty()) text += ",exposure_us";
  text += ",predicted_s\n";
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const acquisition::PlannedPoint& point = plan.points[i];
    text += direction_cells(point.direction) + fmt::format(",{}", i + 1);
    for (const Angle joint : point.pose.joints) text += "," + samples::csv_degrees(joint);
    text += "," + rig::branch_name(point.pose);
    if (!exposures_us.empty()) text += "," + samples::csv_number(exposures_us[i]);
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
  const std::vector<samples::Direction> directions = samples::read_directions(path);
  samples::CsvReader reader(path);
  const rig::TravelModel travel(rig);
  const rig::Inverse inverse(rig);
  const std::size_t branch_column = *reader.column("branch");
  const auto predicted_column = reader.column("predicted_s");
  acquisition::MeasurementPlan plan;
  rig::Joints before = rig.home();
  for (const samples::Direction& direction : directions) {
    const auto row = reader.next();
    if (!row) break;
    acquisition::PlannedPoint point;
    point.direction = direction.angles;
    for (const rig::Axis& axis : rig.axes) {
      const std::size_t column = *reader.column(joint_column(axis));
      point.pose.joints.push_back(Angle::from_degrees(reader.number_within(
          *row, column, axis.min.degrees() - 1e-6, axis.max.degrees() + 1e-6)));
    }
    const std::string& branch = row->cells[branch_column];
    point.pose.mirrored = branch.size() == 2 && branch[1] == '\'';
    if (branch.empty() || branch[0] < 'A' || branch[0] > 'D' ||
        branch.size() != (point.pose.mirrored ? 2U : 1U)) {
      throw DataFormatError(path, reader.place(*row, branch_column),
                            fmt::format("found {:?}, expected A, B, C or D", branch));
    }
    point.pose.branch = static_cast<rig::Branch>(branch[0] - 'A');
    if (!realises(rig, point.pose, point.direction)) {
      throw DataFormatError(path, fmt::format("line {}", row->line),
                            fmt::format("the joints do not realise this direction, branch {}, on "
                                        "rig {}: plan again with its calibration; for an aligned "
                                        "sample leave the joints' columns out",
                                        branch, rig.name));
    }
    if (!inverse.on_named_side(point.direction, point.pose)) {
      throw DataFormatError(
          path, reader.place(*row, branch_column),
          fmt::format("found {:?}, but the joints stand on the other lamp side", branch));
    }
    point.travel_s = travel.seconds(before, point.pose.joints);
    point.predicted_s = point.travel_s;
    if (predicted_column) point.predicted_s = reader.number_within(*row, *predicted_column, 0, 1e6);
    before = point.pose.joints;
    plan.travel_s += point.travel_s;
    plan.duration_s += point.predicted_s;
    plan.points.push_back(std::move(point));
  }
  return plan;
}

}  // namespace gonio::cli
