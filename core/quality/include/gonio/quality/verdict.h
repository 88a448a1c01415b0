#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/basis/uncertainty.h"
#include "gonio/brdf/brdf_table.h"
#include "gonio/quality/physics_checks.h"
#include "gonio/samples/samples.h"

/// Whether a reconstruction may be used, judged without a truth to compare with.
namespace gonio::quality {

/// Below this a sphere rendered with the result looks like another material.
constexpr double kUsablePsnr_db = 28.0;
/// Reconstructed tables overshoot by a few per cent where a lobe is narrower than a cell.
inline constexpr double kEnergyTolerance = 0.1;
/// Exchanged directions may differ by this; what they differ by is counted.
inline constexpr Angle kReciprocityTolerance = Angle::from_degrees(0.25);
inline constexpr double kReciprocityLimit = 3.0;
/// More of the directions than this clamped at zero is no noise any more.
inline constexpr double kClampedLimit = 0.2;
/// Without enough training materials for an outlook: chi^2 per value of what no prior explains.
inline constexpr double kInnovationLimit = 10.0;

/// What a picture of the result would score against the true material, as foreseen from the
/// training materials: each is predicted from the same directions and noise without its own rows,
/// its picture compared with the true one, and the score explained by what a measurement shows as
/// well. So the rule follows the basis, the directions and the noise. One constant is MERL's: how
/// much less a new material scores than training materials, for which the directions were chosen.
struct Outlook {
  double expected_psnr_db = 0.0;
  double sd_db = 0.0;  ///< of the training materials' own scores about theirs
  /// The measurement and, in ascending order, the training materials left out.
  double innovation = 0.0;  ///< basis::Likeness::innovation
  std::vector<double> left_out_innovations;
  double nearest = 0.0;  ///< root mean square difference of the samples to the nearest material
  std::vector<double> left_out_nearest;
};

/// Empty for a fit by ridge or as published (they leave nothing out) and for fewer than
/// basis::kFewestGroups groups of training materials.
/// Threads  Uses all; the same figures with any number of them.
std::optional<Outlook> outlook(const basis::Basis& basis, const basis::Fit& fit);

/// Whether so little is foreseen that a result is not to be trusted: the score less half its
/// standard deviation below kUsablePsnr_db, or samples that fit twice as badly as those of any
/// training material.
bool is_doubtful(const Outlook& outlook);
/// Why, in the words of what shows it most.
std::string doubt_text(const Outlook& outlook);

struct Verdict {
  /// Nothing where no error can be foreseen (no outlook) and nothing speaks against the result.
  std::optional<bool> trusted;
  /// One plain line: "trust: ...", "do not trust: REASON; REASON; ADVICE" or "cannot tell: ...".
  std::string line;
  std::vector<std::string> reasons;  ///< against it; empty unless it is not to be trusted
  std::optional<Outlook> outlook;
  EnergyCheck energy;
  ReciprocityCheck reciprocity;
  double clamped_share = 0.0;  ///< of the cells above the horizon
  /// Half width of the 68 % band, root mean square over cells with max(theta_i, theta_o) in
  /// [65, 85] deg, nepers; empty without bands. No error of the whole grazing ring: two values in
  /// three are foreseen within it, the others may be far outside.
  std::optional<double> grazing_half_width;
};

/// `bands`  Null: no grazing confidence.
Verdict judge(const basis::Basis& basis, const samples::SampleSet& samples, const basis::Fit& fit,
              const brdf::BrdfTable& table, const basis::Uncertainty* bands);

}  // namespace gonio::quality
