#pragma once

#include <string>
#include <vector>

#include "gonio/acquisition/reduction.h"

namespace gonio::acquisition {

/// Every later point with the first of its direction, by the rows of the archive: on branches with
/// light and camera exchanged a reciprocal pair, whose middle spots are compared (the others see
/// other directions), else a repeat, spot by spot. `samples` are those of `grid` x `grid` spots.
/// Pairs without a spot that both measured are left out. `u_monitor`: of one reading, relative.
std::vector<PairAgreement> pair_agreements(const SessionReader& archive,
                                           const samples::SampleSet& samples, int grid,
                                           double u_monitor);

/// One line for people.
std::string disagreement_text(const PairAgreement& pair);

}  // namespace gonio::acquisition
