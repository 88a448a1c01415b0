#include "planning.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "failures.h"
#include "gonio/design/condition_search.h"
#include "gonio/design/exchange.h"
#include "gonio/design/importance.h"
#include "gonio/rig/reach.h"

namespace gonio::cli {
namespace {

/// m sigma^2 of a sample the solve will trust to its model error only.
constexpr double kDesignEta = 0.3;

design::Candidates candidates_for(const rig::Inverse* inverse) {
  design::Candidates candidates;
  if (inverse == nullptr) {
    candidates.allowed = design::cells_within({});
    return candidates;
  }
  candidates.allowed = design::basis_mask(rig::reach_statistics(*inverse).reachable);
  if (!inverse->closed_form()) {
    candidates.accept = [inverse](std::uint32_t cell) {
      return !inverse->solve(design::direction_of_basis_cell(cell)).poses.empty();
    };
  }
  return candidates;
}

}  // namespace

DesignedDirections choose_directions(const Console& console, const basis::Basis& basis,
                                     const rig::Inverse* inverse, const DesignRequest& request) {
  design::Candidates candidates;
  {
    const PhaseTimer timer(console, "reachable directions");
    candidates = candidates_for(inverse);
  }
  const auto reachable = std::count(candidates.allowed.begin(), candidates.allowed.end(), 1);
  if (reachable < request.sample_count) {
    throw UsageError(
        fmt::format("found {} reachable directions, expected at least the {} asked for", reachable,
                    request.sample_count));
  }
  const PhaseTimer timer(console, "choosing directions");
  const Eigen::MatrixXd importance =
      design::importance_matrix(basis.components, design::importance_weights());
  Progress progress(console, "choosing directions");
  const auto show = [&](const design::SearchProgress& now) { progress.update(now.fraction); };
  design::Design found;
  if (request.published_search) {
    design::ConditionSearchOptions options;
    options.sample_count = request.sample_count;
    options.seed = request.seed;
    found = design::condition_search(basis.components, candidates, options, show);
  } else {
    design::ExchangeOptions options;
    options.sample_count = request.sample_count;
    options.eta = kDesignEta;
    options.seed = request.seed;
    found = design::exchange(basis.components, importance, candidates, options, show);
  }
  DesignedDirections chosen;
  for (const std::uint32_t cell : found.cells) {
    chosen.directions.push_back(design::direction_of_basis_cell(cell));
  }
  chosen.figures = design::assess(
      basis, design::rows_at(basis::BasisRows(basis), chosen.directions), importance, kDesignEta);
  return chosen;
}

design::DesignFigures assess_directions(const basis::Basis& basis,
                                        const std::vector<brdf::HalfDiff>& directions) {
  const Eigen::MatrixXd importance =
      design::importance_matrix(basis.components, design::importance_weights());
  return design::assess(basis, design::rows_at(basis::BasisRows(basis), directions), importance,
                        kDesignEta);
}

namespace {

using Seconds = std::chrono::duration<double>;

/// A bracket takes a shortest exposure, one or two others, and the readouts; a still longer one for
/// the dimmest spot is the exception.
double bracket_seconds(const RigFile& rig, double shortest_s) {
  return shortest_s * (1.0 + rig.session.bracket_ratio) +
         3.0 * Seconds(rig.world.camera.readout).count();
}

double channel_count(const RigFile& rig) { return rig.white_light ? 1.0 : 3.0; }

/// The lamp-off frame at the end repeats the longest exposure.
double point_seconds(const RigFile& rig, double shortest_s) {
  return channel_count(rig) * bracket_seconds(rig, shortest_s) +
         shortest_s * rig.session.bracket_ratio + Seconds(rig.world.camera.readout).count();
}

}  // namespace

double overhead_seconds(const RigFile& rig) {
  const double frame = Seconds(rig.session.first_exposure + rig.world.camera.readout).count();
  const bool changed = rig.session.white != acquisition::WhitePlacement::in_frame;
  const double white =
      channel_count(rig) * (bracket_seconds(rig, Seconds(rig.session.first_exposure).count()) +
                            rig.session.white_frames * frame) +
      (changed ? 2.0 * Seconds(rig.world.change_time).count() : 0.0);
  double homing = 0.0;
  for (const rig::Axis& axis : rig.rig.axes) {
    homing = std::max(homing, (axis.max - axis.min).degrees() / axis.max_speed_deg_per_s);
  }
  return 2.0 * white + homing;
}

acquisition::MeasurementPlan plan_poses(const RigFile& rig, const rig::Inverse& inverse,
                                        const std::vector<samples::Direction>& directions,
                                        std::uint64_t seed) {
  return acquisition::make_plan(inverse, directions,
                                point_seconds(rig, Seconds(rig.session.first_exposure).count()),
                                overhead_seconds(rig), seed);
}

std::string to_text(const brdf::HalfDiff& direction) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f}) deg", direction.theta_h.degrees(),
                     direction.theta_d.degrees(), direction.phi_d.degrees());
}

double expected_exposure_us(const RigFile& rig, const basis::BasisRows& rows,
                            const brdf::HalfDiff& direction) {
  const basis::BasisRow row = rows.at(direction);
  const double brdf = rows.basis().mapping.inverse(row.mean, row.weight);
  const double cos_theta_i =
      brdf::polar_cosines(direction.theta_h, direction.theta_d, direction.phi_d).cos_theta_i;
  // The first exposure is set for a white under normal incidence.
  const double white = rig.white.reflectance.mean() / std::numbers::pi;
  const double relative = std::max(brdf * cos_theta_i / white, 1e-6);
  const double first_us = static_cast<double>(rig.session.first_exposure.count()) / 1e3;
  return std::clamp(std::round(first_us / relative),
                    static_cast<double>(rig.world.camera.min_exposure.count()) / 1e3,
                    static_cast<double>(rig.session.max_exposure.count()) / 1e3);
}

void predict_from_exposures(const RigFile& rig, const std::vector<double>& exposures_us,
                            acquisition::MeasurementPlan& plan) {
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    acquisition::PlannedPoint& point = plan.points[i];
    const double before = point.predicted_s;
    point.predicted_s = point.travel_s + point_seconds(rig, exposures_us[i] * 1e-6);
    plan.duration_s += point.predicted_s - before;
  }
}

}  // namespace gonio::cli
