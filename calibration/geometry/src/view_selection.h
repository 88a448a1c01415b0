#pragma once

#include <string>
#include <vector>

#include "gonio/calibration/geometry/intrinsics.h"

namespace gonio::calibration::geometry {

/// Angle between the board's normal and the line of sight to its middle.
Angle slant_of(const BoardView& view, const Eigen::Isometry3d& camera_from_board);

std::size_t used_count(const std::vector<FittedView>& views);

/// Throws StepRefused, beginning with `step`, when fewer than `min_views` are used.
void require_views(const std::string& step, const std::vector<FittedView>& views,
                   std::size_t min_views);

/// Leaves out views that are slanted more or whose rms is above `factor` times the median; whether
/// there were any.
bool leave_out_slanted(std::vector<FittedView>& views, Angle max_slant);
bool leave_out_bad(std::vector<FittedView>& views, double factor);

/// Throws StepRefused, beginning with `step`, when more than a fraction of the views was left out
/// as fitting badly: then they may be right and the rest wrong. `advice` says what may have
/// happened.
void require_agreement(const std::string& step, const std::vector<FittedView>& views,
                       double max_bad_fraction, const std::string& advice);

}  // namespace gonio::calibration::geometry
