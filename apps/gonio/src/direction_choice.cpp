#include "direction_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "gonio/console/failures.h"
#include "gonio/design/condition_search.h"
#include "gonio/design/exchange.h"
#include "gonio/design/expected_noise.h"
#include "gonio/design/importance.h"
#include "gonio/design/leave_one_out.h"
#include "gonio/design/xu_search.h"
#include "gonio/instrument/measurement_equation.h"
#include "gonio/rig/reach.h"
#include "planning.h"

namespace gonio::cli {
namespace {

design::Candidates reachable_candidates(const rig::Inverse* inverse) {
  design::Candidates candidates;
  if (inverse == nullptr) {
    candidates.allowed = design::cells_within({});
    return candidates;
  }
  candidates.allowed = design::basis_mask(rig::reach_statistics(*inverse).reachable);
  if (!inverse->closed_form()) {
    candidates.accept = [inverse](std::uint32_t cell) {
      return !inverse->solve(design::direction_of_basis_cell(cell)).poses.empty();
    };
  }
  return candidates;
}

design::ExpectedNoise noise_of(const KnownRig* rig, const std::optional<double>& relative) {
  design::ExpectedNoise noise;
  if (rig != nullptr) {
    const instrument::Instrument& known = rig->constants;
    noise.relative = std::hypot(known.u_lamp_relative, known.u_linearity_relative);
    // One for all directions: of those in the middle of the table.
    noise.direction = instrument::half_vector_sigma(known, Angle::from_degrees(45.0));
  }
  noise.relative = relative.value_or(noise.relative);
  return noise;
}

std::vector<float> exposure_penalties(const RigFile& rig, const basis::Basis& basis,
                                      const std::vector<std::uint8_t>& allowed,
                                      double percent_per_second) {
  const basis::BasisRows rows(basis);
  std::vector<float> penalties(allowed.size(), 0.0F);
  for (std::size_t i = 0; i < allowed.size(); ++i) {
    if (allowed[i] == 0) continue;
    const double exposure_us = expected_exposure_us(
        rig, rows, design::direction_of_basis_cell(static_cast<std::uint32_t>(i)));
    penalties[i] =
        static_cast<float>(0.01 * percent_per_second * point_seconds(rig, 1e-6 * exposure_us));
  }
  return penalties;
}

design::Criterion criterion_of(DesignObjective objective) {
  switch (objective) {
    case DesignObjective::d:
      return design::Criterion::bayes_d;
    case DesignObjective::xu:
      return design::Criterion::xu_squared;
    default:
      return design::Criterion::bayes_a;
  }
}

design::Design search(const basis::Basis& basis, const design::Candidates& candidates,
                      const DesignRequest& request, const design::ProgressCallback& show,
                      const std::stop_token& stop) {
  if (request.method != DesignMethod::exchange) {
    design::ConditionSearchOptions options;
    options.sample_count = request.sample_count;
    options.seed = request.seed;
    return request.method == DesignMethod::nielsen
               ? design::condition_search(basis.components, candidates, options, show, stop)
               : design::xu_search(basis.components, basis.singular_values, basis.left_vectors,
                                   candidates, options, show, stop);
  }
  const Eigen::MatrixXd importance = design::blended_importance(
      basis, basis.left_vectors, request.weights.value_or(design::ImportanceBlend::for_points()));
  design::ExchangeOptions options;
  options.sample_count = request.sample_count;
  options.criterion = criterion_of(request.objective);
  options.eta = kPointSearchEta;
  options.seed = request.seed;
  design::Design found =
      design::exchange(basis.components, importance, candidates, options, show, stop);
  if (!refined_by_leave_one_out(request) || stop.stop_requested()) return found;
  design::LeaveOneOutOptions refine;
  refine.eta = kPointSearchEta;
  refine.seed = request.seed;
  return design::leave_one_out_exchange(basis.components, basis.left_vectors, importance,
                                        candidates, found.cells, refine, show, stop);
}

}  // namespace

bool refined_by_leave_one_out(const DesignRequest& request) {
  return request.objective == DesignObjective::loo ||
         (request.objective == DesignObjective::automatic &&
          request.sample_count <= design::kLeaveOneOutPoints);
}

DesignMethod design_method(const std::string& word) {
  if (word == "exchange") return DesignMethod::exchange;
  if (word == "nielsen") return DesignMethod::nielsen;
  if (word == "xu") return DesignMethod::xu;
  throw UsageError("--method: found " + word + ", expected exchange, nielsen or xu");
}

DesignObjective design_objective(const std::string& word) {
  if (word == "auto") return DesignObjective::automatic;
  if (word == "a") return DesignObjective::a;
  if (word == "d") return DesignObjective::d;
  if (word == "xu") return DesignObjective::xu;
  if (word == "loo") return DesignObjective::loo;
  throw UsageError("--objective: found " + word + ", expected auto, a, d, xu or loo");
}

std::optional<design::ImportanceBlend> importance_blend(const std::string& text) {
  if (text == "auto") return std::nullopt;
  const auto refuse = [&](const std::string& part) {
    throw UsageError("--weights: found '" + part +
                     "', expected auto, uniform, solid-angle, image, or shares of them such as "
                     "solid-angle=0.9,uniform=0.1");
  };
  double uniform = 0.0;
  double solid_angle = 0.0;
  double image = 0.0;
  std::set<std::string> seen;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    const std::size_t equals = part.find('=');
    const std::string name = part.substr(0, equals);
    if (!seen.insert(name).second) throw UsageError("--weights: found '" + name + "' twice");
    double share = 1.0;
    if (equals != std::string::npos) {
      const std::string number = part.substr(equals + 1);
      std::size_t used = 0;
      try {
        share = std::stod(number, &used);
      } catch (const std::exception&) {
        refuse(part);
      }
      if (used != number.size() || !(share >= 0.0) || share > 1e6) refuse(part);
    }
    if (name == "uniform") {
      uniform += share;
    } else if (name == "solid-angle") {
      solid_angle += share;
    } else if (name == "image") {
      image += share;
    } else {
      refuse(part);
    }
    begin = end + 1;
  }
  const double sum = uniform + solid_angle + image;
  if (!(sum > 0.0)) refuse(text);
  // 0.9 and 0.1 must give back exactly 0.1.
  const double scale = std::abs(sum - 1.0) < 1e-9 ? 1.0 : sum;
  return design::ImportanceBlend{std::min(uniform / scale, 1.0),
                                 std::min(image / scale, 1.0 - uniform / scale)};
}

std::string to_text(const design::ImportanceBlend& blend) {
  return fmt::format("solid-angle={:.6g},image={:.6g},uniform={:.6g}",
                     1.0 - blend.image - blend.uniform, blend.image, blend.uniform);
}

std::vector<brdf::HalfDiff> choose_directions(const Console& console, const basis::Basis& basis,
                                              const KnownRig* rig, const rig::Inverse* inverse,
                                              const DesignRequest& request,
                                              const std::stop_token& stop) {
  design::Candidates candidates;
  {
    const PhaseTimer timer(console, "reachable directions");
    candidates = reachable_candidates(inverse);
  }
  const auto reachable = std::count(candidates.allowed.begin(), candidates.allowed.end(), 1);
  if (reachable < request.sample_count) {
    throw UsageError(
        fmt::format("found {} reachable directions, expected at least the {} asked for", reachable,
                    request.sample_count));
  }
  if (request.method == DesignMethod::exchange) {
    const PhaseTimer timer(console, "expected noise");
    const design::ExpectedNoise noise = noise_of(rig, request.relative_noise);
    if (noise.relative > 0.0 || noise.direction.radians() > 0.0) {
      candidates.noise = design::expected_noise(basis, noise);
    }
    if (rig != nullptr && request.percent_per_second > 0.0) {
      candidates.penalty =
          exposure_penalties(rig->file, basis, candidates.allowed, request.percent_per_second);
    }
  }
  const PhaseTimer timer(console, "choosing directions");
  Progress progress(console, "choosing directions");
  const design::Design found = search(
      basis, candidates, request,
      [&](const design::SearchProgress& now) { progress.update(now.fraction); }, stop);
  std::vector<brdf::HalfDiff> directions;
  for (const std::uint32_t cell : found.cells) {
    directions.push_back(design::direction_of_basis_cell(cell));
  }
  return directions;
}

DirectionFigures assess_directions(const basis::Basis& basis,
                                   const std::vector<brdf::HalfDiff>& directions,
                                   const design::ImportanceBlend& weights) {
  const Eigen::MatrixXd importance = design::blended_importance(basis, basis.left_vectors, weights);
  const Eigen::MatrixXd rows = design::rows_at(basis::BasisRows(basis), directions);
  const design::LeaveOneOut left_out =
      design::leave_one_out(rows, basis.left_vectors, importance, kPointSearchEta);
  // An image has no weight per cell: where it counts most is near enough where solid angle does.
  return {design::assess(basis, rows, importance, kPointSearchEta),
          quality::forecast(basis, left_out.residuals),
          design::largest_uncovered_region(
              basis, rows, design::importance_weights({weights.uniform}), kPointSearchEta)};
}

}  // namespace gonio::cli
