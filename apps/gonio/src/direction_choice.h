#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/console/console.h"
#include "gonio/design/coverage.h"
#include "gonio/design/criteria.h"
#include "gonio/design/image_importance.h"
#include "gonio/quality/forecast.h"
#include "gonio/rig/kinematics.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio::cli {

/// How directions are searched for.
///   exchange  over all cells, to a fixpoint of the objective
///   nielsen   Nielsen et al. 2015 as published: condition number
///   xu        Xu et al. 2016: their metric in the same search
enum class DesignMethod { exchange, nielsen, xu };

/// What the exchange lowers: expected error (a), volume of what stays open (d), Xu's metric squared
/// (xu), or the error of materials left out (loo). `automatic` is a, and loo after it for so few
/// points that it helps (design::kLeaveOneOutPoints).
enum class DesignObjective { automatic, a, d, xu, loo };

/// Throw UsageError naming the words that exist.
DesignMethod design_method(const std::string& word);
DesignObjective design_objective(const std::string& word);

/// Importance of errors from words: "uniform", "solid-angle", "image", or shares of several:
/// "solid-angle=0.9,uniform=0.1" (they are brought to a sum of 1). Empty for "auto": what serves
/// best for points or for patches. Throws UsageError.
std::optional<design::ImportanceBlend> importance_blend(const std::string& text);
/// The same words for a blend.
std::string to_text(const design::ImportanceBlend& blend);

/// m sigma^2 that the point search and its figures allow every sample besides its noise. Smaller
/// than what the solve allows (ReconstructOptions::model_eta, 1): the held-out figures of
/// docs/results.md were made with it.
inline constexpr double kPointSearchEta = 0.3;

struct DesignRequest {
  int sample_count = 10;
  DesignMethod method = DesignMethod::exchange;
  DesignObjective objective = DesignObjective::automatic;
  std::optional<design::ImportanceBlend> weights;  ///< empty: for_points()
  std::optional<double> relative_noise;  ///< of a value; empty: what the rig's constants say
  double percent_per_second = 0.0;       ///< of the error, that a second of exposure is worth
  std::uint64_t seed = 1;
};

/// Whether leave_one_out_exchange() follows the exchange.
bool refined_by_leave_one_out(const DesignRequest& request);

/// Chooses directions for a basis; with a rig only such as it reaches, and by what it measures well
/// and soon. A stop ends the search with the best so far and a warning. Throws UsageError when
/// fewer are reachable than asked for.
std::vector<brdf::HalfDiff> choose_directions(const Console& console, const basis::Basis& basis,
                                              const KnownRig* rig, const rig::Inverse* inverse,
                                              const DesignRequest& request,
                                              const std::stop_token& stop = {});

/// Everything that is known about directions as points before they are measured, at
/// kPointSearchEta.
struct DirectionFigures {
  design::DesignFigures design;
  quality::Forecast forecast;
  design::UncoveredRegion uncovered;
};
DirectionFigures assess_directions(const basis::Basis& basis,
                                   const std::vector<brdf::HalfDiff>& directions,
                                   const design::ImportanceBlend& weights);

}  // namespace gonio::cli
