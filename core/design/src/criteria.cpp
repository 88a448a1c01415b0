#include "gonio/design/criteria.h"

#include <cblas.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/basis/reconstruct.h"
#include "gonio/errors/errors.h"

namespace gonio::design {
namespace {

void require_positive(double eta) {
  if (!(eta > 0.0) || !std::isfinite(eta)) {
    throw std::invalid_argument("design: eta is " + std::to_string(eta) +
                                ", expected above 0 and finite");
  }
}

/// Through BLAS: Eigen's own product is built for the least processor.
Eigen::MatrixXd product(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd result(a.rows(), b.cols());
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(a.rows()),
              static_cast<int>(b.cols()), static_cast<int>(a.cols()), 1.0, a.data(),
              static_cast<int>(a.outerStride()), b.data(), static_cast<int>(b.rows()), 0.0,
              result.data(), static_cast<int>(result.rows()));
  return result;
}

void require_columns(const Eigen::MatrixXd& rows, Eigen::Index k, const char* what) {
  if (k < rows.cols()) {
    throw std::invalid_argument("design: the rows have " + std::to_string(rows.cols()) +
                                " components, " + what + " " + std::to_string(k));
  }
}

}  // namespace

Eigen::MatrixXd open_share(const Eigen::MatrixXd& rows, double eta) {
  require_positive(eta);
  const Eigen::Index k = rows.cols();
  if (rows.rows() == 0) return Eigen::MatrixXd::Identity(k, k);
  if (rows.rows() < k) {
    // Woodbury: one system of the number of samples instead of the number of components.
    Eigen::MatrixXd gram = rows * rows.transpose();
    gram.diagonal().array() += eta;
    const Eigen::LLT<Eigen::MatrixXd> solver(gram);
    const Eigen::MatrixXd known = solver.matrixL().solve(rows);
    return Eigen::MatrixXd::Identity(k, k) - known.transpose() * known;
  }
  Eigen::MatrixXd information = rows.transpose() * rows;
  information.diagonal().array() += eta;
  return eta * information.llt().solve(Eigen::MatrixXd::Identity(k, k));
}

double criterion_value(Criterion criterion, const Eigen::MatrixXd& rows,
                       const Eigen::MatrixXd& importance, double eta) {
  const Eigen::MatrixXd open = open_share(rows, eta);
  switch (criterion) {
    case Criterion::bayes_a:
      return importance.cwiseProduct(open).sum();
    case Criterion::xu_squared:
      return importance.cwiseProduct(open * open).sum();
    case Criterion::bayes_d: {
      if (rows.rows() == 0) return 0.0;
      // det(I + A^T A / eta) = det(I + A A^T / eta): the smaller of the two.
      Eigen::MatrixXd gram = rows.rows() < rows.cols()
                                 ? Eigen::MatrixXd(rows * rows.transpose() / eta)
                                 : Eigen::MatrixXd(rows.transpose() * rows / eta);
      gram.diagonal().array() += 1.0;
      const Eigen::LLT<Eigen::MatrixXd> factor(gram);
      return -2.0 * factor.matrixLLT().diagonal().array().log().sum();
    }
  }
  throw std::invalid_argument("design: unknown criterion");
}

double condition_number(const Eigen::MatrixXd& rows) {
  const Eigen::Index used = std::min(rows.rows(), rows.cols());
  if (used == 0) return std::numeric_limits<double>::infinity();
  const Eigen::VectorXd singular =
      Eigen::JacobiSVD<Eigen::MatrixXd>(rows.leftCols(used)).singularValues();
  const double least = singular[singular.size() - 1];
  if (!(least > std::numeric_limits<double>::epsilon() * singular[0])) {
    return std::numeric_limits<double>::infinity();
  }
  return singular[0] / least;
}

double xu_metric(const Eigen::MatrixXd& rows, const Eigen::VectorXd& singular_values,
                 const Eigen::MatrixXd& left_vectors, double eta) {
  const Eigen::Index k = rows.cols();
  require_columns(rows, singular_values.size(), "singular values");
  require_columns(rows, left_vectors.cols(), "left vectors");
  const double m = static_cast<double>(left_vectors.rows());
  const double left_out = singular_values.tail(singular_values.size() - k).squaredNorm() / m;
  const auto left = left_vectors.leftCols(k);
  const Eigen::VectorXd squares = singular_values.head(k).array().square();
  if (rows.rows() >= k || rows.rows() == 0) {
    const Eigen::MatrixXd scaled_open =
        singular_values.head(k).asDiagonal() * open_share(rows, eta);
    const Eigen::MatrixXd errors = left * scaled_open.transpose();
    return (errors.rowwise().squaredNorm().array() + left_out).sqrt().mean();
  }
  // M = I - C^T C with C of n rows: what n samples take off every row's square, n products each.
  require_positive(eta);
  Eigen::MatrixXd gram = rows * rows.transpose();
  gram.diagonal().array() += eta;
  const Eigen::MatrixXd known = gram.llt().matrixL().solve(rows);
  const Eigen::Index n = rows.rows();
  Eigen::MatrixXd sides(k, 2 * n);
  sides.leftCols(n) = known.transpose();
  sides.rightCols(n) = squares.asDiagonal() * known.transpose();
  const Eigen::MatrixXd shares = product(left, sides);
  const Eigen::MatrixXd bend = known * sides.rightCols(n);
  const Eigen::VectorXd whole = left.cwiseAbs2() * squares;
  const Eigen::MatrixXd bent = 2.0 * shares.rightCols(n) - shares.leftCols(n) * bend;
  const Eigen::VectorXd taken = shares.leftCols(n).cwiseProduct(bent).rowwise().sum();
  return ((whole - taken).array() + left_out).max(0.0).sqrt().mean();
}

DesignFigures assess(const basis::Basis& basis, const Eigen::MatrixXd& rows,
                     const Eigen::MatrixXd& importance, double eta) {
  DesignFigures figures;
  figures.condition_number = condition_number(rows);
  figures.xu_metric =
      xu_metric(rows, basis.singular_values, basis.left_vectors, basis::kPublishedEta);
  figures.bayes_a = criterion_value(Criterion::bayes_a, rows, importance, eta) / basis.row_count();
  figures.bayes_d = criterion_value(Criterion::bayes_d, rows, importance, eta);
  return figures;
}

Eigen::MatrixXd rows_at(const basis::BasisRows& rows, std::span<const brdf::HalfDiff> directions) {
  Eigen::MatrixXd result;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const basis::BasisRow row = rows.at(directions[i]);
    if (i == 0) result.resize(static_cast<Eigen::Index>(directions.size()), row.q.size());
    result.row(static_cast<Eigen::Index>(i)) = row.q.transpose();
  }
  return result;
}

}  // namespace gonio::design
