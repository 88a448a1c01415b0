#include "plan_explanation.h"

#include <fmt/format.h>

#include <cmath>

#include "gonio/rig/kinematics.h"
#include "planning.h"

namespace gonio::cli {
namespace {

std::string range(Angle from, Angle to) {
  return fmt::format("{:g} to {:g}", from.degrees(), to.degrees());
}

nlohmann::ordered_json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace

std::string session_text(const acquisition::MeasurementPlan& plan, const std::string& duration) {
  std::string text;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const auto& point = plan.points[i];
    text += fmt::format("{:3}  {:<32} branch {}  travel {:5.1f} s  total {:5.1f} s\n", i + 1,
                        to_text(point.direction), rig::branch_name(point.pose), point.travel_s,
                        point.predicted_s);
  }
  text += fmt::format("travel {:.1f} s ({}), whole session {}\n", plan.travel_s,
                      plan.exact_order ? std::string("the shortest order")
                                       : fmt::format("at best {:.1f} s", plan.lower_bound_s),
                      duration);
  return text;
}

std::string figures_text(const DirectionFigures& figures) {
  const design::LatticeRegion& where = figures.uncovered.where;
  return fmt::format(
      "condition number {:.1f} (says little about the result), Xu metric {:.1f} (mean, eta 40)\n"
      "criteria of the point search (eta {:g}): root of A {:.4f}, D {:.1f}\n"
      "pictures: {:.1f} dB expected, {:.1f} dB for the worst tenth (an estimate from the training\n"
      "  materials, each left out, without noise; standard error {:.1f} dB)\n"
      "largest uncovered region: theta_h {}, theta_d {}, phi_d {} deg,\n"
      "  {:.1f} % of the expected error, {:.3f} nepers rms there\n",
      figures.design.condition_number, figures.design.xu_metric, kPointSearchEta,
      std::sqrt(figures.design.bayes_a), figures.design.bayes_d, figures.forecast.psnr_db,
      figures.forecast.tenth_percentile_db, figures.forecast.standard_error_db,
      range(where.theta_h_from, where.theta_h_to), range(where.theta_d_from, where.theta_d_to),
      range(where.phi_d_from, where.phi_d_to), 100.0 * figures.uncovered.share,
      figures.uncovered.rms);
}

nlohmann::ordered_json figures_json(const DirectionFigures& figures) {
  const design::LatticeRegion& where = figures.uncovered.where;
  const auto degrees = [](Angle from, Angle to) {
    return nlohmann::ordered_json{from.degrees(), to.degrees()};
  };
  return {{"condition_number", number_or_null(figures.design.condition_number)},
          {"xu_metric", figures.design.xu_metric},
          {"bayes_a", figures.design.bayes_a},
          {"bayes_d", figures.design.bayes_d},
          {"expected_psnr_db", figures.forecast.psnr_db},
          {"expected_psnr_standard_error_db", figures.forecast.standard_error_db},
          {"expected_psnr_p10_db", figures.forecast.tenth_percentile_db},
          {"uncovered",
           {{"theta_h_deg", degrees(where.theta_h_from, where.theta_h_to)},
            {"theta_d_deg", degrees(where.theta_d_from, where.theta_d_to)},
            {"phi_d_deg", degrees(where.phi_d_from, where.phi_d_to)},
            {"share_of_error", figures.uncovered.share},
            {"rms", figures.uncovered.rms}}}};
}

nlohmann::ordered_json session_json(const acquisition::MeasurementPlan& plan) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  for (const auto& point : plan.points) {
    points.push_back({{"theta_h_deg", point.direction.theta_h.degrees()},
                      {"theta_d_deg", point.direction.theta_d.degrees()},
                      {"phi_d_deg", point.direction.phi_d.degrees()},
                      {"branch", rig::branch_name(point.pose)},
                      {"travel_s", point.travel_s},
                      {"predicted_s", point.predicted_s}});
  }
  return {{"travel_s", plan.travel_s},
          {"shortest_order", plan.exact_order},
          {"duration_s", plan.duration_s},
          {"points", points}};
}

}  // namespace gonio::cli
