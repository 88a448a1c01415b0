#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include "directions_deg.h"
#include "gonio/basis/reconstruct.h"
#include "noise_model.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

/// Box-Muller over a standardised engine: std::normal_distribution differs between libraries.
class Normal {
 public:
  explicit Normal(unsigned seed) : engine_(seed) {}
  double operator()() {
    return std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  double uniform() { return (static_cast<double>(engine_()) + 0.5) / 4294967296.0; }
  std::mt19937 engine_;
};

std::vector<brdf::HalfDiff> directions_over_the_lattice() {
  std::vector<brdf::HalfDiff> directions;
  for (const double theta_h : {1.0, 6.0, 14.0, 25.0, 40.0, 60.0}) {
    for (const double theta_d : {5.0, 25.0})
      directions.push_back(half_diff_deg(theta_h, theta_d, 80));
  }
  return directions;
}

/// Root mean square error of the mapped fit at cells all over the lattice, red channel.
double field_error(const Fit& fit, const brdf::BrdfModel& model) {
  const Basis& basis = test::full_basis();
  const Eigen::MatrixXf field = mapped_field(basis, fit.coefficients);
  const auto& cells = brdf::lattice::cells_above_horizon();
  double square = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < cells.size(); i += 499, ++count) {
    const brdf::HalfDiff at = brdf::lattice::angles_of(brdf::lattice::index_from_cell(cells[i]));
    const double truth = basis.mapping.forward(
        model.evaluate(brdf::shading_geometry(at))[0],
        basis.mapping.weight(brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d)));
    square += std::pow(static_cast<double>(field(static_cast<Eigen::Index>(i), 0)) - truth, 2);
  }
  return std::sqrt(square / count);
}

TEST(DarkSamples, RelinearisedBeatClippedAtZero) {
  // A black body with a weak lobe under noise of five times its diffuse level: half of the
  // samples come out negative.
  const test::Lobe model(brdf::Rgb::Constant(0.004), brdf::Rgb::Constant(6.0), 0.15);
  Normal normal(5);
  double relinearised = 0.0;
  double clipped = 0.0;
  int negatives = 0;
  for (int draw = 0; draw < 8; ++draw) {
    samples::SampleSet set = test::sample(model, directions_over_the_lattice());
    for (samples::Sample& sample : set.samples) {
      sample.sigma_per_sr = brdf::Rgb::Constant(0.02);
      sample.value_per_sr += 0.02 * normal();
      negatives += sample.value_per_sr[0] < 0.0;
    }
    relinearised += field_error(fit(test::full_basis(), set), model);
    for (samples::Sample& sample : set.samples) sample.value_per_sr = sample.value_per_sr.max(0.0);
    ReconstructOptions once;
    once.relinearisations = 0;
    clipped += field_error(fit(test::full_basis(), set, once), model);
  }
  EXPECT_GT(negatives, 10);
  EXPECT_LT(relinearised, 0.8 * clipped);
}

TEST(DarkSamples, FarBelowZeroGiveAFiniteFit) {
  samples::SampleSet set = test::sample(test::material(2), directions_over_the_lattice());
  for (samples::Sample& sample : set.samples) {
    sample.value_per_sr = brdf::Rgb::Constant(-0.1);
    sample.sigma_per_sr = brdf::Rgb::Constant(0.03);
  }
  EXPECT_TRUE(fit(test::full_basis(), set).coefficients.allFinite());
  for (samples::Sample& sample : set.samples) sample.sigma_per_sr.setZero();
  EXPECT_TRUE(fit(test::full_basis(), set).coefficients.allFinite());
}

TEST(DarkSamples, CountAsZeroInThePublishedMethod) {
  samples::SampleSet negative = test::sample(test::material(2), directions_over_the_lattice());
  samples::SampleSet zero = negative;
  negative.samples[4].value_per_sr = brdf::Rgb::Constant(-0.05);
  negative.samples[4].sigma_per_sr = brdf::Rgb::Constant(0.1);
  zero.samples[4].value_per_sr.setZero();
  ReconstructOptions published;
  published.method = Method::nielsen;
  EXPECT_EQ(fit(test::full_basis(), negative, published).coefficients,
            fit(test::full_basis(), zero, published).coefficients);
}

TEST(Noise, AVeryUncertainSampleIsIgnored) {
  samples::SampleSet set = test::sample(test::material(2), directions_over_the_lattice());
  for (samples::Sample& sample : set.samples) sample.sigma_per_sr = 0.01 * sample.value_per_sr;
  samples::SampleSet without = set;
  without.samples.erase(without.samples.begin() + 3);
  set.samples[3].sigma_per_sr = brdf::Rgb::Constant(1e4);
  set.samples[3].value_per_sr *= 3.0;
  const Fit ignored = fit(test::full_basis(), set);
  const Fit left_out = fit(test::full_basis(), without);
  EXPECT_LT((ignored.coefficients - left_out.coefficients).norm(),
            1e-3 * left_out.coefficients.norm());
}

/// Samples of which every second was taken at a theta_h that is off by `sigma`.
samples::SampleSet half_tilted(const brdf::BrdfModel& model, Angle sigma, unsigned seed,
                               bool told) {
  Normal normal(seed);
  samples::SampleSet set;
  for (int i = 0; i < 24; ++i) {
    const brdf::HalfDiff nominal = half_diff_deg(1.0 + i, 5.0 + 20.0 * (i % 3), 80);
    const bool off = i % 2 == 1;
    brdf::HalfDiff there = nominal;
    if (off) there.theta_h = abs(there.theta_h + sigma * normal());
    samples::Sample sample = test::sample(model, {there}).samples[0];
    sample.direction = nominal;
    if (off && told) sample.u_theta_h = sigma;
    set.samples.push_back(sample);
  }
  return set;
}

TEST(Noise, KnowingWhichAnglesAreUncertainImprovesTheFit) {
  double told = 0.0;
  double untold = 0.0;
  const Angle sigma = Angle::from_degrees(2.0);
  for (int index = 0; index < test::kMaterials; ++index) {
    const test::Lobe model = test::material(index);
    const auto seed = static_cast<unsigned>(index);
    told += field_error(fit(test::full_basis(), half_tilted(model, sigma, seed, true)), model);
    untold += field_error(fit(test::full_basis(), half_tilted(model, sigma, seed, false)), model);
  }
  EXPECT_LT(told, 0.7 * untold);
}

TEST(Noise, AnAngleUncertaintyDoesNotMatterWhereTheMaterialIsFlat) {
  // At theta_h = 60 deg all the lobes have died away.
  samples::SampleSet set =
      test::sample(test::material(1), {half_diff_deg(58, 5, 80), half_diff_deg(62, 10, 80)});
  const Fit without = fit(test::full_basis(), set);
  for (samples::Sample& sample : set.samples) sample.u_theta_h = Angle::from_degrees(0.05);
  const Fit with = fit(test::full_basis(), set);
  EXPECT_LT((with.coefficients - without.coefficients).norm(), 0.02 * without.coefficients.norm());
}

TEST(Noise, AnAngleErrorOfAPoseIsOneErrorScaledByTheSlopesAlongTheMean) {
  // Before the first fit the slopes are those of the mean material: the covariance written out.
  const Basis& basis = test::full_basis();
  const double u = Angle::from_degrees(0.1).radians();
  samples::SampleSet set;
  for (int i = 0; i < 5; ++i) {
    const double between_bins = std::pow((20.0 + 2.0 * i) / 90.0, 2) * 90.0;
    const brdf::HalfDiff at = half_diff_deg(between_bins, 30.2 + i, 80);
    samples::Sample sample = test::sample(test::material(3), {at}).samples[0];
    sample.u_theta_h = Angle::from_radians(u);
    sample.pose = i < 4 ? 1 : -1;
    set.samples.push_back(sample);
  }
  ReconstructOptions options;
  options.method = Method::ridge;
  options.model_eta = 1e-3;  // so small that the angle dominates
  options.relinearisations = 0;
  const Fit found = fit(basis, set, options);

  const double m = basis.row_count();
  const BasisRows rows(basis);
  Eigen::MatrixXd a(5, basis.component_count());
  Eigen::VectorXd y(5), g(5);
  for (Eigen::Index i = 0; i < 5; ++i) {
    const samples::Sample& sample = set.samples[static_cast<std::size_t>(i)];
    const BasisRow row = rows.at(sample.direction);
    a.row(i) = row.q.transpose();
    y[i] = basis.mapping.forward(sample.value_per_sr[0], row.weight) - row.mean;
    const double step = 1e-6;  // radians
    brdf::HalfDiff there = sample.direction;
    there.theta_h += Angle::from_radians(step);
    const BasisRow next = rows.at(there);
    const double f = basis.mapping.inverse(row.mean, row.weight);
    const double f_next = basis.mapping.inverse(next.mean, next.weight);
    g[i] = basis.mapping.derivative(f, row.weight) * (f_next - f) / step * u;
  }
  Eigen::MatrixXd r = 1e-3 / m * Eigen::MatrixXd::Identity(5, 5);
  r.topLeftCorner(4, 4) += g.head(4) * g.head(4).transpose();
  r(4, 4) += g[4] * g[4];
  const Eigen::VectorXd expected =
      a.transpose() * (a * a.transpose() / m + r).partialPivLu().solve(y) / m;
  // the slope over 0.2 deg against the one at a point
  EXPECT_LT((found.coefficients.col(0) - expected).norm(), 0.005 * expected.norm());
  const Eigen::MatrixXd independent = 1e-3 / m * Eigen::MatrixXd::Identity(5, 5) +
                                      Eigen::MatrixXd(g.array().square().matrix().asDiagonal());
  const Eigen::VectorXd other =
      a.transpose() * (a * a.transpose() / m + independent).partialPivLu().solve(y) / m;
  EXPECT_GT((other - expected).norm(), 0.03 * expected.norm()) << "the test cannot tell them apart";
}

TEST(Noise, ATiltOfAPoseMovesEachOfItsSamplesItsOwnWay) {
  // Samples around a peak: a tilt brings some nearer to it and the others away. The covariance
  // written out, with the slopes of the mean material.
  const Basis& basis = test::full_basis();
  const double u = Angle::from_degrees(0.1).radians();
  samples::SampleSet set;
  for (int i = 0; i < 5; ++i) {
    const double between_bins = std::pow((14.0 + 2.0 * i) / 90.0, 2) * 90.0;
    brdf::HalfDiff at = half_diff_deg(between_bins, 30.2 + i, 80);
    samples::Sample sample = test::sample(test::material(3), {at}).samples[0];
    at.phi_h = Angle::from_degrees(75.0 * i - 180.0);
    sample.direction = at;
    sample.u_tilt = Angle::from_radians(u);
    sample.pose = 1;
    set.samples.push_back(sample);
  }
  ReconstructOptions options;
  options.method = Method::ridge;
  options.model_eta = 1e-3;  // so small that the tilt dominates
  options.relinearisations = 0;
  const Fit found = fit(basis, set, options);

  const double m = basis.row_count();
  const BasisRows rows(basis);
  Eigen::MatrixXd a(5, basis.component_count());
  Eigen::VectorXd y(5);
  Eigen::MatrixXd g(5, 2);
  for (Eigen::Index i = 0; i < 5; ++i) {
    const samples::Sample& sample = set.samples[static_cast<std::size_t>(i)];
    const BasisRow row = rows.at(sample.direction);
    a.row(i) = row.q.transpose();
    y[i] = basis.mapping.forward(sample.value_per_sr[0], row.weight) - row.mean;
    const double f = basis.mapping.inverse(row.mean, row.weight);
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      const double step = 1e-6;  // radians, of a turn of both directions about x or y
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
      const brdf::DirectionPair pair = brdf::directions_from_half_diff(sample.direction);
      const BasisRow next =
          rows.at(brdf::half_diff_from_directions({turn * pair.wi, turn * pair.wo}));
      const double f_next = basis.mapping.inverse(next.mean, next.weight);
      g(i, axis) = basis.mapping.derivative(f, row.weight) * (f_next - f) / step * u;
    }
  }
  const auto solved = [&](const Eigen::MatrixXd& noise) -> Eigen::VectorXd {
    const Eigen::MatrixXd r = 1e-3 / m * Eigen::MatrixXd::Identity(5, 5) + noise;
    return a.transpose() * (a * a.transpose() / m + r).partialPivLu().solve(y) / m;
  };
  const Eigen::VectorXd expected = solved(g * g.transpose());
  EXPECT_LT((found.coefficients.col(0) - expected).norm(), 0.005 * expected.norm());
  // All to one side, as if theta_h were off.
  const Eigen::VectorXd size = g.rowwise().norm();
  EXPECT_GT((solved(size * size.transpose()) - expected).norm(), 0.03 * expected.norm())
      << "the test cannot tell them apart";
}

TEST(Noise, OnTopOfAPeakATiltToEitherSideIsALoss) {
  // No slope there, but a tilted peak is never brighter.
  const Basis& basis = test::full_basis();
  samples::SampleSet set = test::sample(test::material(2), {half_diff_deg(0, 30, 0)});
  const auto variance = [&](Angle tilt) {
    set.samples[0].u_tilt = tilt;
    const detail::SampleRows rows = detail::look_up(BasisRows(basis), set, basis.component_count());
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(basis.component_count());
    return detail::map_samples(basis, rows, set, 1, {}, none, {}).variance[0];
  };
  const Angle tilt = Angle::from_degrees(3.0);
  const BasisRows rows(basis);
  const BasisRow top = rows.at(set.samples[0].direction);
  double expected = 0.0;
  for (const bool about_x : {true, false}) {
    double change = 0.0;
    for (const Angle by : {tilt, -tilt}) {
      const brdf::DirectionPair pair =
          brdf::tilted(brdf::directions_from_half_diff(set.samples[0].direction),
                       about_x ? by : Angle(), about_x ? Angle() : by);
      const BasisRow beside = rows.at(brdf::half_diff_from_directions(pair));
      const double f = basis.mapping.inverse(beside.mean, beside.weight);
      change += basis.mapping.forward(f, top.weight) - top.mean;
    }
    // Half the second difference times the square of a standard normal, whose mean square is 3.
    expected += 3.0 * std::pow(0.5 * change, 2);
  }
  ASSERT_GT(expected, 1e-6);
  EXPECT_NEAR(variance(tilt) - variance(Angle()), expected, 1e-6 * expected);
}

TEST(Noise, NearThePoleAndTheHorizonAngleUncertaintiesStayFinite) {
  samples::SampleSet set =
      test::sample(test::material(2), {half_diff_deg(0, 30, 0), half_diff_deg(0.02, 30, 0),
                                       half_diff_deg(44.9, 45, 0), half_diff_deg(20, 0, 0)});
  for (samples::Sample& sample : set.samples) {
    sample.u_theta_h = Angle::from_degrees(0.5);
    sample.u_theta_d = Angle::from_degrees(0.5);
    sample.u_phi_d = Angle::from_degrees(180.0);
    sample.u_tilt = Angle::from_degrees(0.5);
  }
  EXPECT_TRUE(fit(test::full_basis(), set).coefficients.allFinite());
}

}  // namespace
}  // namespace gonio::basis
