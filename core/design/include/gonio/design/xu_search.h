#pragma once

#include <stop_token>

#include "gonio/basis/basis.h"
#include "gonio/design/candidates.h"
#include "gonio/design/condition_search.h"
#include "gonio/design/search.h"

namespace gonio::design {

/// Directions by the error metric of Xu, Nielsen et al. 2016 (xu_metric() at
/// basis::kPublishedEta), kept for comparison:
/// from the first on the best of random cells by the metric, moved over the lattice while it falls.
/// The paper gives the metric; for single directions the search around it is taken to be the one
/// its authors published the year before (condition_search()).
///
/// `rows`             p x k, p = basis_cell_count().
/// `singular_values`  At least k. `left_vectors` m x at least k.
/// Value              The metric, those left out of the basis included.
/// Errors             std::invalid_argument as exchange().
/// Source             ACM TOG 35(6), 2016.
Design xu_search(const basis::RowMajorMatrixXf& rows, const Eigen::VectorXd& singular_values,
                 const Eigen::MatrixXd& left_vectors, const Candidates& candidates,
                 const ConditionSearchOptions& options, const ProgressCallback& progress = {},
                 const std::stop_token& stop = {});

}  // namespace gonio::design
