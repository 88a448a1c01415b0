#include "gonio/quality/physics_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "gonio/brdf/directions.h"
#include "gonio/brdf/shading_geometry.h"
#include "gonio/parallel/parallel.h"

namespace gonio::quality {
namespace {

constexpr int kThetaSteps = 360;  // of theta_h, square-root spaced: four per lattice cell
constexpr int kPhiSteps = 128;
constexpr std::array kThetaIDeg = {0.0, 15.0, 30.0, 45.0, 60.0, 75.0};

/// Light and detector exchanged; phi_h does not matter.
brdf::DirectionPair exchanged(const brdf::HalfDiff& direction) {
  const brdf::DirectionPair pair = brdf::directions_from_half_diff(
      {direction.theta_h, direction.theta_d, direction.phi_d, Angle()});
  return {pair.wo, pair.wi};
}

/// How far two directions lie apart: the larger of the turns that take wi to wi and wo to wo, after
/// turning one about the normal so that the half vectors' azimuths agree.
Angle apart(const brdf::DirectionPair& a, const brdf::DirectionPair& b) {
  const auto between = [](const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    return 2.0 * std::asin(std::min(1.0, 0.5 * (u - v).norm()));
  };
  return Angle::from_radians(std::max(between(a.wi, b.wi), between(a.wo, b.wo)));
}

brdf::Rgb total_sigma(const samples::Sample& sample) {
  return (sample.sigma_per_sr.square() + sample.u_common_per_sr.square()).sqrt();
}

/// How far `b`, light and detector exchanged, lies from `a` along one angle.
Angle along(Angle brdf::HalfDiff::*angle, const brdf::HalfDiff& a, const brdf::HalfDiff& b) {
  const double degrees = (a.*angle - b.*angle).degrees();
  return Angle::from_degrees(angle == &brdf::HalfDiff::phi_d ? std::remainder(degrees, 180.0)
                                                             : degrees);
}

/// Variance of the difference of a pair that the model gives its angles' uncertainty and distance.
brdf::Rgb angle_variance(const brdf::BrdfModel& model, const samples::Sample& a,
                         const samples::Sample& b) {
  using samples::Sample;
  constexpr std::array<std::pair<Angle brdf::HalfDiff::*, Angle Sample::*>, 3> kAngles = {
      {{&brdf::HalfDiff::theta_h, &Sample::u_theta_h},
       {&brdf::HalfDiff::theta_d, &Sample::u_theta_d},
       {&brdf::HalfDiff::phi_d, &Sample::u_phi_d}}};
  brdf::Rgb variance = brdf::Rgb::Zero();
  for (const auto& [angle, uncertainty] : kAngles) {
    const Angle reach =
        Angle::from_radians(std::hypot((a.*uncertainty).radians(), (b.*uncertainty).radians(),
                                       along(angle, a.direction, b.direction).radians()));
    const brdf::HalfDiff plus = moved(a.direction, angle, reach);
    const brdf::HalfDiff minus = moved(a.direction, angle, -reach);
    const double distance_rad = (plus.*angle - minus.*angle).radians();
    if (!(distance_rad > 0.0)) continue;
    const brdf::Rgb change = model.evaluate(brdf::shading_geometry(plus)) -
                             model.evaluate(brdf::shading_geometry(minus));
    variance += (change * (reach.radians() / distance_rad)).square();
  }
  for (const samples::Sample* sample : {&a, &b}) {
    if (sample->u_tilt <= Angle()) continue;
    const brdf::DirectionPair pair = brdf::directions_from_half_diff(sample->direction);
    const brdf::Rgb middle = model.evaluate(pair);
    for (const bool about_x : {true, false}) {
      const brdf::TiltedEnds ends = brdf::tilted_ends(pair, sample->u_tilt, about_x);
      if (ends.steps == 0) continue;
      const brdf::Rgb plus = model.evaluate(ends.plus);
      const brdf::Rgb minus = model.evaluate(ends.minus);
      variance += ((plus - minus) / ends.steps).square();
      // On top of a peak a tilt to either side does the same: no slope, but a loss.
      if (ends.steps == 2) variance += 0.75 * (plus + minus - 2.0 * middle).square();
    }
  }
  return variance;
}

ReciprocalPair compared(const samples::SampleSet& set, std::size_t first, std::size_t second,
                        const brdf::BrdfModel* model) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const samples::Sample& a = set.samples[first];
  const samples::Sample& b = set.samples[second];
  ReciprocalPair pair{first, second, brdf::Rgb::Constant(kNan), brdf::Rgb::Constant(kNan)};
  brdf::Rgb variance = total_sigma(a).square() + total_sigma(b).square();
  if (model != nullptr) variance += angle_variance(*model, a, b);
  const brdf::Rgb sigma = variance.sqrt();
  for (int c = 0; c < 3; ++c) {
    if (a.value_per_sr[c] > 0.0 && b.value_per_sr[c] > 0.0) {
      pair.ratio[c] = a.value_per_sr[c] / b.value_per_sr[c];
    }
    if (sigma[c] > 0.0) pair.z[c] = (a.value_per_sr[c] - b.value_per_sr[c]) / sigma[c];
  }
  return pair;
}

struct Candidate {
  double distance_rad;
  std::size_t first;
  std::size_t second;
};

std::vector<Candidate> candidates(const samples::SampleSet& set, Angle tolerance) {
  std::vector<Candidate> found;
  for (std::size_t j = 0; j < set.samples.size(); ++j) {
    const samples::Sample& second = set.samples[j];
    // Exchanged, then back to half and difference angles with phi_h = 0: comparable as vectors.
    brdf::HalfDiff mirror = brdf::half_diff_from_directions(exchanged(second.direction));
    mirror.phi_h = Angle();
    const brdf::DirectionPair wanted = brdf::directions_from_half_diff(mirror);
    for (std::size_t i = 0; i < j; ++i) {
      const samples::Sample& first = set.samples[i];
      if (first.pose >= 0 && first.pose == second.pose) continue;
      if (abs(first.direction.theta_d - second.direction.theta_d) > tolerance) continue;
      brdf::HalfDiff own = first.direction;
      own.phi_h = Angle();
      const Angle distance = apart(brdf::directions_from_half_diff(own), wanted);
      if (distance <= tolerance) found.push_back({distance.radians(), i, j});
    }
  }
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    if (a.distance_rad != b.distance_rad) return a.distance_rad < b.distance_rad;
    return a.first != b.first ? a.first < b.first : a.second < b.second;
  });
  return found;
}

}  // namespace

brdf::Rgb directional_albedo(const brdf::BrdfModel& model, Angle theta_i) {
  if (!(theta_i.radians() >= 0.0 && theta_i.degrees() < 90.0)) {
    throw std::invalid_argument("directional albedo: theta_i must be in [0, 90) deg");
  }
  const Eigen::Vector3d wi = brdf::direction(theta_i, Angle());
  // Over half vectors and not over wo: the lobe then lies where theta_h is small, whatever theta_i.
  // d wo = 4 (wi.h) d wh.
  return parallel::reduce_blocks(
      0, kThetaSteps, 20, brdf::Rgb(brdf::Rgb::Zero()),
      [&](std::size_t from, std::size_t to) {
        brdf::Rgb sum = brdf::Rgb::Zero();
        for (std::size_t i = from; i < to; ++i) {
          const double u = (static_cast<double>(i) + 0.5) / kThetaSteps;
          const double theta_h = u * u * std::numbers::pi / 2.0;
          const double cell = std::sin(theta_h) * std::numbers::pi * u / kThetaSteps *
                              (2.0 * std::numbers::pi / kPhiSteps);
          for (int j = 0; j < kPhiSteps; ++j) {
            const Eigen::Vector3d h = brdf::direction(
                Angle::from_radians(theta_h),
                Angle::from_radians(2.0 * std::numbers::pi * (j + 0.5) / kPhiSteps));
            const double cosine = wi.dot(h);
            if (cosine <= 0.0) continue;
            const Eigen::Vector3d wo = (2.0 * cosine * h - wi).normalized();
            if (wo.z() <= 0.0) continue;
            sum += model.evaluate(brdf::DirectionPair{wi, wo}) * (wo.z() * 4.0 * cosine * cell);
          }
        }
        return sum;
      },
      [](brdf::Rgb& total, brdf::Rgb&& part) { total += part; });
}

EnergyCheck check_energy(const brdf::BrdfModel& model, brdf::RadiometricScale scale,
                         double tolerance) {
  EnergyCheck check;
  check.applicable = scale == brdf::RadiometricScale::si;
  if (!check.applicable) return check;
  for (const double degrees : kThetaIDeg) {
    const Angle theta_i = Angle::from_degrees(degrees);
    check.albedos.push_back({theta_i, directional_albedo(model, theta_i)});
    check.largest = std::max(check.largest, check.albedos.back().albedo.maxCoeff());
  }
  check.passed = check.largest <= 1.0 + tolerance;
  return check;
}

ReciprocityCheck check_reciprocity(const samples::SampleSet& set, Angle tolerance, double limit,
                                   const brdf::BrdfModel* model) {
  ReciprocityCheck check;
  std::vector<bool> used(set.samples.size(), false);
  for (const Candidate& candidate : candidates(set, tolerance)) {
    if (used[candidate.first] || used[candidate.second]) continue;
    used[candidate.first] = used[candidate.second] = true;
    check.pairs.push_back(compared(set, candidate.first, candidate.second, model));
  }
  double log_sum = 0.0;
  double z_sum = 0.0;
  int ratios = 0;
  int scores = 0;
  for (const ReciprocalPair& pair : check.pairs) {
    for (int c = 0; c < 3; ++c) {
      if (std::isfinite(pair.ratio[c])) {
        log_sum += std::log(pair.ratio[c]);
        ++ratios;
      }
      if (std::isfinite(pair.z[c])) {
        z_sum += pair.z[c] * pair.z[c];
        check.largest_z = std::max(check.largest_z, std::abs(pair.z[c]));
        ++scores;
      }
    }
  }
  if (ratios > 0) check.mean_log_ratio = log_sum / ratios;
  check.rms_z = scores > 0 ? std::sqrt(z_sum / scores) : std::numeric_limits<double>::quiet_NaN();
  check.passed = scores == 0 || check.rms_z <= limit;
  return check;
}

std::size_t clamped_cells(const brdf::BrdfTable& table) {
  std::size_t count = 0;
  for (const std::uint32_t cell : brdf::lattice::cells_above_horizon(table.convention())) {
    if (table.valid(cell) && (table.value(cell) == 0.0).any()) ++count;
  }
  return count;
}

}  // namespace gonio::quality
