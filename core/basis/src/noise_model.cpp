#include "noise_model.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>

namespace gonio::basis::detail {
namespace {

using samples::Sample;

/// No sample is believed better than this (nepers): keeps R regular when a set states no noise.
constexpr double kLeastSigma = 1e-6;
/// Below this many sigmas above zero a logarithm is mostly noise.
constexpr double kDarkSigmas = 3.0;

constexpr std::array<Angle brdf::HalfDiff::*, 3> kAngles = {
    &brdf::HalfDiff::theta_h, &brdf::HalfDiff::theta_d, &brdf::HalfDiff::phi_d};
constexpr std::array<Angle Sample::*, 3> kAngleUncertainties = {
    &Sample::u_theta_h, &Sample::u_theta_d, &Sample::u_phi_d};

void set_row(const BasisRow& row, Eigen::Index i, Eigen::MatrixXd& a, Eigen::VectorXd& mean,
             Eigen::VectorXd& weight) {
  a.row(i) = row.q.head(a.cols()).transpose();
  mean[i] = row.mean;
  weight[i] = row.weight;
}

/// A direction moved by a standard uncertainty to either side: `ends[0]` and `ends[1]` lie
/// `distance` standard uncertainties apart, fewer than 2 where the horizon or a pole is in the way.
struct Move {
  std::array<brdf::HalfDiff, 2> ends;
  double distance = 0.0;
  bool by_tilt = false;
};

/// Along one of the three angles.
Move move_along(const Sample& sample, std::size_t which) {
  const auto angle = kAngles[which];
  const Angle u = sample.*kAngleUncertainties[which];
  Move move{{moved(sample.direction, angle, u), moved(sample.direction, angle, -u)}, 0.0, false};
  if (u > Angle()) move.distance = (move.ends[0].*angle - move.ends[1].*angle) / u;
  return move;
}

/// Tilt of the normal about one of two axes in the surface, the same for all samples of a pose.
Move move_by_tilt(const Sample& sample, bool about_x) {
  if (sample.u_tilt <= Angle()) return {};
  const brdf::TiltedEnds ends =
      brdf::tilted_ends(brdf::directions_from_half_diff(sample.direction), sample.u_tilt, about_x);
  // Rounding may put an end that grazes the surface on the other side of the lattice's horizon.
  const auto end_of = [&](const brdf::DirectionPair& pair) {
    const brdf::HalfDiff end = brdf::half_diff_from_directions(pair);
    const bool above = brdf::above_horizon(end.theta_h, end.theta_d, end.phi_d);
    return above ? end : sample.direction;
  };
  return {{end_of(ends.plus), end_of(ends.minus)}, static_cast<double>(ends.steps), true};
}

SampleRows::Shifted look_up_shifted(const BasisRows& rows, const samples::SampleSet& set,
                                    Eigen::Index components,
                                    const std::function<Move(const Sample&)>& move_of) {
  const Eigen::Index n = static_cast<Eigen::Index>(set.samples.size());
  SampleRows::Shifted shifted;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Move move = move_of(set.samples[static_cast<std::size_t>(i)]);
    if (!(move.distance > 0.0)) continue;
    if (!shifted.used) {
      shifted.used = true;
      shifted.a_plus.setZero(n, components);
      shifted.a_minus.setZero(n, components);
      for (Eigen::VectorXd* const vector :
           {&shifted.mean_plus, &shifted.mean_minus, &shifted.factor, &shifted.both_sides}) {
        vector->setZero(n);
      }
      shifted.weight_plus.setOnes(n);
      shifted.weight_minus.setOnes(n);
    }
    set_row(rows.at(move.ends[0]), i, shifted.a_plus, shifted.mean_plus, shifted.weight_plus);
    set_row(rows.at(move.ends[1]), i, shifted.a_minus, shifted.mean_minus, shifted.weight_minus);
    shifted.factor[i] = 1.0 / move.distance;
    shifted.both_sides[i] = move.by_tilt && move.distance == 2.0 ? 1.0 : 0.0;
  }
  return shifted;
}

/// What one standard uncertainty of an angle or tilt does to x = g(f).
struct AngleError {
  Eigen::VectorXd slope;  ///< to first order, signed
  /// Variance to second order, on top of a peak all there is: the error is half the second
  /// difference times the square of a standard normal, whose mean square is 3.
  Eigen::VectorXd curvature;
};

/// f moves along the fit while the weight stays the one of the nominal direction, as it does for
/// the measured value.
AngleError angle_errors(const LogMapping& mapping, const SampleRows::Shifted& shifted,
                        const SampleRows& rows, const Eigen::VectorXd& coefficients) {
  const Eigen::VectorXd middle = rows.mean + rows.a * coefficients;
  const Eigen::VectorXd plus = shifted.mean_plus + shifted.a_plus * coefficients;
  const Eigen::VectorXd minus = shifted.mean_minus + shifted.a_minus * coefficients;
  const Eigen::Index n = rows.weight.size();
  AngleError error{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    if (shifted.factor[i] == 0.0) continue;
    const double w = rows.weight[i];
    const double x_plus = mapping.forward(mapping.inverse(plus[i], shifted.weight_plus[i]), w);
    const double x_minus = mapping.forward(mapping.inverse(minus[i], shifted.weight_minus[i]), w);
    error.slope[i] = shifted.factor[i] * (x_plus - x_minus);
    if (shifted.both_sides[i] == 0.0) continue;
    const double x = mapping.forward(mapping.inverse(middle[i], w), w);
    error.curvature[i] = 0.75 * (x_plus + x_minus - 2.0 * x) * (x_plus + x_minus - 2.0 * x);
  }
  return error;
}

}  // namespace

double model_variance(const Basis& basis, double model_eta) {
  return model_eta / static_cast<double>(basis.row_count()) + kLeastSigma * kLeastSigma;
}

SampleRows look_up(const BasisRows& rows, const samples::SampleSet& set, Eigen::Index components) {
  const Eigen::Index n = static_cast<Eigen::Index>(set.samples.size());
  SampleRows found;
  found.a.resize(n, components);
  found.mean.resize(n);
  found.weight.resize(n);
  std::map<int, std::vector<Eigen::Index>> by_pose;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sample& sample = set.samples[static_cast<std::size_t>(i)];
    try {
      set_row(rows.at(sample.direction), i, found.a, found.mean, found.weight);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("sample " + std::to_string(i + 1) + ": " + error.what());
    }
    if (sample.pose >= 0) by_pose[sample.pose].push_back(i);
  }
  for (std::size_t which = 0; which < kAngles.size(); ++which) {
    found.shifted[which] = look_up_shifted(
        rows, set, components, [&](const Sample& sample) { return move_along(sample, which); });
  }
  for (const bool about_x : {true, false}) {
    found.shifted[kAngles.size() + (about_x ? 0 : 1)] = look_up_shifted(
        rows, set, components, [&](const Sample& sample) { return move_by_tilt(sample, about_x); });
  }
  for (auto& [pose, members] : by_pose) {
    if (members.size() > 1) found.poses.push_back(std::move(members));
  }
  return found;
}

MappedSamples map_samples(const Basis& basis, const SampleRows& rows, const samples::SampleSet& set,
                          int channel, const ReconstructOptions& options,
                          const Eigen::VectorXd& coefficients, const Eigen::VectorXd& fitted) {
  const LogMapping& mapping = basis.mapping;
  const Eigen::Index n = rows.mean.size();
  MappedSamples mapped;
  mapped.x.resize(n);
  mapped.variance.resize(n);
  mapped.common.setZero(n, 1 + static_cast<Eigen::Index>(rows.shifted.size()));

  const bool own_noise = !options.eta.has_value();
  const double model_variance =
      detail::model_variance(basis, own_noise ? options.model_eta : *options.eta);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sample& sample = set.samples[static_cast<std::size_t>(i)];
    const double w = rows.weight[i];
    const double f = sample.value_per_sr[channel];
    const double sigma = sample.sigma_per_sr[channel];
    const double u_common = sample.u_common_per_sr[channel];
    const double spread = kDarkSigmas * std::hypot(sigma, u_common);
    const bool dark = f * w + mapping.epsilon < std::max(w * spread, 0.5 * mapping.epsilon);

    if (dark && spread > 0.0 && options.relinearisations > 0) {
      // Before the first fit the point of linearisation is a third of what the sample allows.
      const double guess = fitted.size() > 0 ? fitted[i] : std::max(f, 0.0) + spread / 3.0;
      const double at = std::clamp(guess, 0.0, std::max(f, 0.0) + spread);
      const double slope = mapping.derivative(at, w);
      mapped.x[i] = mapping.forward(at, w) + slope * (f - at);
      // A sample that is all noise says nothing through eta: its own sigma always counts.
      mapped.variance[i] = model_variance + slope * slope * sigma * sigma;
      mapped.common(i, 0) = slope * u_common;
      mapped.depends_on_fit = true;
    } else {
      const double value = std::max(f, 0.0);
      const double slope = own_noise ? mapping.derivative(value, w) : 0.0;
      mapped.x[i] = mapping.forward(value, w);
      mapped.variance[i] = model_variance + slope * slope * sigma * sigma;
      mapped.common(i, 0) = slope * u_common;
    }
  }

  if (own_noise) {
    for (std::size_t which = 0; which < rows.shifted.size(); ++which) {
      if (!rows.shifted[which].used) continue;
      const AngleError error = angle_errors(mapping, rows.shifted[which], rows, coefficients);
      mapped.common.col(static_cast<Eigen::Index>(which) + 1) = error.slope;
      mapped.variance += error.curvature;
      mapped.depends_on_fit = true;
    }
  }

  // What no other sample shares is independent.
  std::vector<bool> shared(static_cast<std::size_t>(n), false);
  for (const auto& members : rows.poses) {
    for (const Eigen::Index i : members) shared[static_cast<std::size_t>(i)] = true;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (shared[static_cast<std::size_t>(i)]) continue;
    mapped.variance[i] += mapped.common.row(i).squaredNorm();
    mapped.common.row(i).setZero();
  }
  return mapped;
}

}  // namespace gonio::basis::detail
