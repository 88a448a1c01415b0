#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "gonio/basis/siblings.h"
#include "gonio/parallel/parallel.h"
#include "gonio/quality/verdict.h"
#include "gonio/render/metric_sphere.h"

namespace gonio::quality {
namespace {

/// One pixel in so many is enough to score a picture to a few tenths of a decibel; prime.
constexpr std::size_t kOutlookStride = 89;
/// Materials whose errors are tried on a prediction.
constexpr std::size_t kTried = 6;
/// Mean square difference (nepers^2) below which two sets of samples are equal for all purposes.
constexpr double kDistanceFloor = 1e-3;
/// A picture no worse than this is not told from the true one.
constexpr double kBestPsnr_db = 55.0;
/// Directions are chosen for the training materials and their samples carry no noise when they are
/// left out: a new material scores this much less than they do (held-out MERL materials, folds of
/// the design too, 3 % noise).
constexpr double kOptimism_db = 2.5;
/// Share of the features' own variance that keeps the regression's coefficients small.
constexpr double kShrinkage = 0.05;

using Picture = Eigen::Array3Xd;

/// The metric sphere thinned out, seen from the coefficients.
class ThinSphere {
 public:
  explicit ThinSphere(const basis::Basis& basis) : mapping_(basis.mapping) {
    const auto& sphere =
        render::MetricSphere::shared(render::MetricLighting::a, brdf::IndexConvention::bin_centre);
    const std::vector<std::uint32_t>& cells = brdf::lattice::cells_above_horizon();
    std::unordered_map<std::uint32_t, Eigen::Index> place;
    std::vector<Eigen::Index> rows;
    first_.push_back(0);
    for (std::size_t pixel = 0; pixel < sphere.pixel_count(); pixel += kOutlookStride) {
      for (const render::MetricSphere::Term& term : sphere.terms(pixel)) {
        const auto found = std::lower_bound(cells.begin(), cells.end(), term.cell);
        if (found == cells.end() || *found != term.cell) continue;
        const auto [at, is_new] =
            place.try_emplace(term.cell, static_cast<Eigen::Index>(rows.size()));
        if (is_new) {
          rows.push_back(found - cells.begin());
          const brdf::HalfDiff angles =
              brdf::lattice::angles_of(brdf::lattice::index_from_cell(term.cell));
          weights_.push_back(
              mapping_.weight(brdf::polar_cosines(angles.theta_h, angles.theta_d, angles.phi_d)));
        }
        terms_.push_back({at->second, static_cast<double>(term.factor)});
      }
      first_.push_back(terms_.size());
    }
    components_.resize(static_cast<Eigen::Index>(rows.size()), basis.components.cols());
    mean_.resize(components_.rows());
    for (Eigen::Index i = 0; i < components_.rows(); ++i) {
      components_.row(i) = basis.components.row(rows[static_cast<std::size_t>(i)]);
      mean_[i] = basis.mean[rows[static_cast<std::size_t>(i)]];
    }
  }

  /// Deviations from the mean at the sphere's cells, a column for each column of coefficients.
  Eigen::MatrixXf field(const Eigen::MatrixXd& coefficients) const {
    const Eigen::MatrixXf narrow = coefficients.cast<float>();
    Eigen::MatrixXf values(components_.rows(), narrow.cols());
    parallel::for_each_block(
        0, static_cast<std::size_t>(values.cols()), 16, [&](std::size_t begin, std::size_t end) {
          const auto from = static_cast<Eigen::Index>(begin);
          const auto count = static_cast<Eigen::Index>(end - begin);
          values.middleCols(from, count).noalias() = components_ * narrow.middleCols(from, count);
        });
    return values;
  }

  /// Radiance of three columns of such deviations.
  Picture render(const Eigen::Ref<const Eigen::MatrixXf>& deviations) const {
    Picture picture(3, static_cast<Eigen::Index>(first_.size() - 1));
    for (Eigen::Index c = 0; c < 3; ++c) {
      const Eigen::ArrayXf f = ((mean_ + deviations.col(c)).array().min(80.0F).exp() -
                                static_cast<float>(mapping_.epsilon))
                                   .max(0.0F);
      for (std::size_t pixel = 0; pixel + 1 < first_.size(); ++pixel) {
        double sum = 0.0;
        for (std::size_t i = first_[pixel]; i < first_[pixel + 1]; ++i) {
          const auto [cell, factor] = terms_[i];
          sum += static_cast<double>(f[cell]) / weights_[static_cast<std::size_t>(cell)] * factor;
        }
        picture(c, static_cast<Eigen::Index>(pixel)) = sum;
      }
    }
    return picture;
  }

 private:
  struct Term {
    Eigen::Index cell;
    double factor;
  };

  basis::LogMapping mapping_;
  std::vector<std::size_t> first_;
  std::vector<Term> terms_;
  std::vector<double> weights_;
  Eigen::MatrixXf components_;
  Eigen::VectorXf mean_;
};

double mean_square_error(const Picture& truth, const Picture& found) {
  const double exposure = render::metric_exposure(truth);
  return (render::metric_display(truth, exposure) - render::metric_display(found, exposure))
      .square()
      .mean();
}

double decibels(double mean_square) {
  return std::min(-10.0 * std::log10(std::max(mean_square, 1e-30)), kBestPsnr_db);
}

/// Mean square distance of three channels' samples to each material's nearest rows.
Eigen::VectorXd material_distances(const Eigen::MatrixXd& distance_by_row) {
  const Eigen::Index materials = distance_by_row.rows() / 3;
  Eigen::VectorXd distance(materials);
  for (Eigen::Index t = 0; t < materials; ++t) {
    distance[t] = distance_by_row.middleRows(3 * t, 3).colwise().minCoeff().mean();
  }
  return distance;
}

/// The features a score is explained by, all such that more is better.
constexpr int kFeatures = 4;
using Features = Eigen::Matrix<double, kFeatures, 1>;

/// What an error like those of the nearest materials would do to a picture of this prediction.
/// Materials at an infinite distance are left out.
double imagined_score(const ThinSphere& sphere, const Eigen::MatrixXf& prediction,
                      const Eigen::MatrixXf& errors, const Eigen::VectorXd& distance) {
  std::vector<Eigen::Index> order;
  for (Eigen::Index t = 0; t < distance.size(); ++t) {
    if (std::isfinite(distance[t])) order.push_back(t);
  }
  const auto nearest = order.begin() + static_cast<std::ptrdiff_t>(std::min(kTried, order.size()));
  std::partial_sort(order.begin(), nearest, order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return distance[a] < distance[b] || (distance[a] == distance[b] && a < b);
  });
  const Picture picture = sphere.render(prediction);
  double sum = 0.0;
  double total = 0.0;
  for (auto t = order.begin(); t != nearest; ++t) {
    const double weight = 1.0 / (distance[*t] + distance[order.front()] + kDistanceFloor);
    const double square =
        mean_square_error(picture, sphere.render(prediction + errors.middleCols(3 * *t, 3)));
    sum += weight * std::log(std::max(square, 1e-30));
    total += weight;
  }
  return decibels(std::exp(sum / total));
}

Features features_of(double imagined, double innovation, double chi2, double nearest) {
  return {imagined, -10.0 * std::log10(innovation + 1e-3), -10.0 * std::log10(chi2 + 1e-3),
          -10.0 * std::log10(nearest + kDistanceFloor)};
}

/// Scores as a mean plus non-negative multiples of standardised features, ridge-shrunk: a feature
/// never counts the wrong way round, however few the materials.
class Explanation {
 public:
  Explanation(const Eigen::Matrix<double, kFeatures, Eigen::Dynamic>& features,
              const Eigen::VectorXd& scores)
      : mean_(features.rowwise().mean()), score_mean_(scores.mean()) {
    const Eigen::Index count = scores.size();
    Eigen::MatrixXd centred = features.colwise() - mean_;
    scale_ =
        (centred.rowwise().squaredNorm() / static_cast<double>(count)).cwiseSqrt().cwiseMax(1e-6);
    centred.array().colwise() /= scale_.array();
    const Eigen::VectorXd target = scores.array() - score_mean_;
    const Eigen::MatrixXd gram = centred * centred.transpose() / static_cast<double>(count);
    const Eigen::VectorXd right = centred * target / static_cast<double>(count);
    slopes_.setZero();
    for (int round = 0; round < 200; ++round) {
      for (int i = 0; i < kFeatures; ++i) {
        const double rest = right[i] - gram.row(i).dot(slopes_) + gram(i, i) * slopes_[i];
        slopes_[i] = std::max(rest / (gram(i, i) + kShrinkage), 0.0);
      }
    }
    const Eigen::VectorXd left = target - centred.transpose() * slopes_;
    sd_ = std::sqrt(left.squaredNorm() /
                    static_cast<double>(std::max<Eigen::Index>(count - kFeatures - 1, 1)));
  }

  double at(const Features& features) const {
    return score_mean_ + slopes_.dot((features - mean_).cwiseQuotient(scale_));
  }
  double sd() const { return sd_; }

 private:
  Features mean_;
  Features scale_;
  Features slopes_;
  double score_mean_;
  double sd_ = 0.0;
};

std::vector<double> sorted(const Eigen::VectorXd& values) {
  std::vector<double> copy(values.begin(), values.end());
  std::sort(copy.begin(), copy.end());
  return copy;
}

}  // namespace

std::optional<Outlook> outlook(const basis::Basis& basis, const basis::Fit& fit) {
  const Eigen::Index m = basis.row_count();
  const Eigen::Index materials = m / 3;
  if (fit.left_out_residuals.rows() != m || fit.likeness.row_distance.rows() != m ||
      basis::count_groups(basis.materials) < basis::kFewestGroups) {
    return std::nullopt;
  }
  const std::vector<std::size_t> group = basis::sibling_groups(basis.materials);
  const ThinSphere sphere(basis);
  const Eigen::MatrixXf errors = sphere.field(fit.left_out_residuals.transpose());
  const Eigen::MatrixXf truths = sphere.field(basis.left_vectors.transpose());

  Eigen::Matrix<double, kFeatures, Eigen::Dynamic> features(kFeatures, materials);
  Eigen::VectorXd scores(materials);
  Eigen::VectorXd nearest(materials);
  parallel::for_each_block(
      0, static_cast<std::size_t>(materials), 1, [&](std::size_t block, std::size_t) {
        const auto t = static_cast<Eigen::Index>(block);
        const Eigen::MatrixXf truth = truths.middleCols(3 * t, 3);
        const Eigen::MatrixXf prediction = truth - errors.middleCols(3 * t, 3);
        scores[t] = decibels(mean_square_error(sphere.render(truth), sphere.render(prediction)));
        Eigen::VectorXd distance =
            material_distances(fit.likeness.row_distance.middleCols(3 * t, 3));
        for (Eigen::Index other = 0; other < materials; ++other) {
          if (group[static_cast<std::size_t>(other)] == group[block]) {
            distance[other] = std::numeric_limits<double>::infinity();
          }
        }
        nearest[t] = distance.minCoeff();
        features.col(t) = features_of(imagined_score(sphere, prediction, errors, distance),
                                      fit.likeness.left_out_innovation[t],
                                      fit.likeness.left_out_chi2[t], nearest[t]);
      });
  const Explanation explanation(features, scores);

  const Eigen::VectorXd distance = material_distances(fit.likeness.distance);
  const Features own =
      features_of(imagined_score(sphere, sphere.field(fit.coefficients), errors, distance),
                  fit.likeness.innovation, fit.chi2_per_sample, distance.minCoeff());
  Outlook found;
  found.expected_psnr_db = explanation.at(own) - kOptimism_db;
  found.sd_db = explanation.sd();
  found.innovation = fit.likeness.innovation;
  found.left_out_innovations = sorted(fit.likeness.left_out_innovation);
  found.nearest = std::sqrt(distance.minCoeff());
  found.left_out_nearest = sorted(nearest.cwiseSqrt());
  return found;
}

}  // namespace gonio::quality
