#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "block_best.h"
#include "gonio/basis/basis.h"
#include "gonio/design/criteria.h"

namespace gonio::design {

/// A change M' = M + beta h h^T: adding (beta < 0) or dropping (beta > 0) the sample with row a,
/// where h = M a. Holds the vectors whose products with a candidate's row update its figures.
struct Change {
  double beta;
  Eigen::MatrixXd vectors;  ///< k x 1 (bayes_d), 2 (bayes_a) or 5 (xu_squared)
  double h_h;
  double h_importance_h;
  double h_open_importance_h;
};

Change adding(Criterion criterion, const Eigen::VectorXd& row, const Eigen::MatrixXd& open,
              const Eigen::MatrixXd& importance, double eta);
Change dropping(Criterion criterion, const Eigen::VectorXd& row, const Eigen::MatrixXd& open,
                const Eigen::MatrixXd& importance, double eta);

/// What every candidate would bring, kept up to date while samples come and go.
///
/// With b = M q for a candidate's row q: v = q.b, w = b.K b, and for xu_squared also
/// s = b.b, z = b.M K b. A rank-one change of M updates them from a few products of q with fixed
/// vectors, so a trial costs one pass over the rows: memory bandwidth, not arithmetic. Changes that
/// are kept use double products, because they add up; a trial needs none of that.
///
/// State    Made without figures; reset() before the first scan().
/// Threads  Uses all inside; calls come from one.
class CandidateField {
 public:
  /// `rows` must outlive the field. `noise` and `penalty` as in Candidates, one per row or empty.
  CandidateField(const basis::RowMajorMatrixXf& rows, const Eigen::MatrixXd& importance,
                 Criterion criterion, double eta, std::vector<float> noise,
                 const std::vector<float>& penalty);

  std::size_t size() const { return static_cast<std::size_t>(rows_.rows()); }

  /// Works everything out from scratch for an M: two products of k x k per candidate.
  void reset(const Eigen::MatrixXd& open);

  /// Takes over `changes` in order, then works out every allowed candidate's gain under M and, if
  /// given, one further change that is not kept. `allowed`: one byte per candidate. `value` is the
  /// criterion before a candidate is added; it matters only where there are penalties.
  void scan(const std::vector<Change>& changes, const Change* trial,
            const std::vector<std::uint8_t>& allowed, double value);

  /// The candidate with the largest gain in the last scan, the lowest of equals; size() when none
  /// is left.
  std::size_t best() const { return gains_.best(size()); }
  /// Takes a candidate out of the last scan.
  void dismiss(std::size_t candidate) { gains_.dismiss(candidate); }

 private:
  struct Figures {
    double v;
    double w;
    double s;
    double z;
  };
  template <typename Number>
  Figures after(const Figures& at, const Change& change, const Number* products) const;
  double gain(const Figures& at, std::size_t candidate) const;

  const basis::RowMajorMatrixXf& rows_;
  basis::RowMajorMatrixXf importance_;
  Criterion criterion_;
  double eta_;
  std::vector<float> noise_;
  std::vector<float> price_;     ///< exp(penalty)
  bool second_order_;            ///< s and z are kept
  std::vector<double> figures_;  ///< v, w (, s, z) per candidate
  BlockBest gains_;
};

}  // namespace gonio::design
