#include "gonio/quality/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>

#include "gonio/basis/siblings.h"
#include "gonio/brdf/shading_geometry.h"
#include "grazing_band.h"

namespace gonio::quality {
namespace {

/// A result that is not clearly usable is not trusted: the expected score less this many of its
/// standard deviations must reach kUsablePsnr_db. With it the failures among held-out MERL
/// materials are flagged.
constexpr double kCaution = 0.5;
/// Samples that fit this many times worse than any left-out training material's are of another
/// kind, whatever picture is expected: the outlook is learnt from that kind alone.
constexpr double kForeignInnovation = 2.0;

struct Suspects {
  std::size_t suspect = 0;
  std::size_t all = 0;
};

/// Poses whose samples have the flag that a session gives to what its checks did not trust.
Suspects suspect_poses(const samples::SampleSet& samples) {
  constexpr std::string_view kFlag = "suspect";
  std::set<int> suspect;
  std::set<int> all;
  for (const samples::Sample& sample : samples.samples) {
    all.insert(sample.pose);
    const std::string words = ";" + sample.flags + ";";
    if (words.find(fmt::format(";{};", kFlag)) != std::string::npos) suspect.insert(sample.pose);
  }
  return {suspect.size(), all.size()};
}

/// What all but one in twenty of the left-out materials stay below.
double usual_limit(const std::vector<double>& ascending) {
  if (ascending.empty()) return std::numeric_limits<double>::infinity();
  const auto rank = static_cast<std::size_t>(0.95 * static_cast<double>(ascending.size() - 1));
  return ascending[rank];
}

double grazing_half_width(const basis::Uncertainty& bands) {
  const std::vector<std::uint32_t>& cells = brdf::lattice::cells_above_horizon();
  const GrazingBand band;
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const brdf::HalfDiff at = brdf::lattice::angles_of(brdf::lattice::index_from_cell(cells[i]));
    const brdf::PolarCosines cosines = brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d);
    if (!band.holds(std::min(cosines.cos_theta_i, cosines.cos_theta_o))) continue;
    sum += bands.sigma.row(static_cast<Eigen::Index>(i)).squaredNorm() / 3.0;
    ++count;
  }
  return bands.factor_68 * std::sqrt(sum / static_cast<double>(std::max<std::size_t>(count, 1)));
}

}  // namespace

bool is_doubtful(const Outlook& outlook) {
  const bool foreign =
      !outlook.left_out_innovations.empty() &&
      outlook.innovation > kForeignInnovation * outlook.left_out_innovations.back();
  return foreign || outlook.expected_psnr_db - kCaution * outlook.sd_db < kUsablePsnr_db;
}

std::string doubt_text(const Outlook& outlook) {
  const double innovation_limit = usual_limit(outlook.left_out_innovations);
  const double nearest_limit = usual_limit(outlook.left_out_nearest);
  if (outlook.innovation > innovation_limit) {
    return fmt::format(
        "the samples do not fit the training materials (chi2 {:.2g} per value, theirs below "
        "{:.2g})",
        outlook.innovation, innovation_limit);
  }
  if (outlook.nearest > nearest_limit) {
    return fmt::format(
        "no training material is like it (nearest {:.2g} nepers away, theirs {:.2g})",
        outlook.nearest, nearest_limit);
  }
  return "materials like it are poorly predicted from these directions";
}

Verdict judge(const basis::Basis& basis, const samples::SampleSet& samples, const basis::Fit& fit,
              const brdf::BrdfTable& table, const basis::Uncertainty* bands) {
  Verdict verdict;
  verdict.outlook = outlook(basis, fit);
  const brdf::TableBrdf model(table);
  verdict.energy = check_energy(model, table.scale(), kEnergyTolerance);
  verdict.reciprocity =
      check_reciprocity(samples, kReciprocityTolerance, kReciprocityLimit, &model);
  verdict.clamped_share =
      static_cast<double>(clamped_cells(table)) /
      static_cast<double>(brdf::lattice::cells_above_horizon(table.convention()).size());
  if (bands != nullptr) verdict.grazing_half_width = grazing_half_width(*bands);

  std::vector<std::string>& reasons = verdict.reasons;
  std::string advice = "measure more directions";
  if (verdict.outlook) {
    const Outlook& seen = *verdict.outlook;
    if (is_doubtful(seen)) {
      reasons.push_back(doubt_text(seen) +
                        fmt::format("; a picture of it is expected at {:.0f} dB, "
                                    "usable ones reach {:.0f}",
                                    seen.expected_psnr_db, kUsablePsnr_db));
      if (seen.innovation > usual_limit(seen.left_out_innovations)) {
        advice = "measure it densely, or train with materials of its kind";
      }
    }
  } else if (fit.innovation_chi2_per_sample > kInnovationLimit) {
    reasons.push_back(
        fmt::format("the samples do not fit the training materials (chi2 {:.2g} per "
                    "value, about 1 for one of their kind)",
                    fit.innovation_chi2_per_sample));
    advice = "measure it densely, or train with materials of its kind";
  }
  if (!verdict.reciprocity.passed) {
    reasons.push_back(
        fmt::format("exchanging lamp and camera changes the values ({:.1f} sigmas "
                    "over {} pairs)",
                    verdict.reciprocity.rms_z, verdict.reciprocity.pairs.size()));
    advice = "check alignment, white reference and stray light, then measure again";
  }
  if (const Suspects suspects = suspect_poses(samples); suspects.suspect > 0) {
    reasons.push_back(fmt::format("{} of {} poses are suspect by the session's own checks",
                                  suspects.suspect, suspects.all));
    advice = "see why (gonio status), then measure again";
  }
  if (!verdict.energy.passed) {
    reasons.push_back(fmt::format("it would reflect {:.0f} % of the light that falls in",
                                  100.0 * verdict.energy.largest));
  }
  if (verdict.clamped_share > kClampedLimit) {
    reasons.push_back(fmt::format("{:.0f} % of the directions came out below zero",
                                  100.0 * verdict.clamped_share));
  }
  if (!reasons.empty()) {
    verdict.trusted = false;
    verdict.line = "do not trust: ";
    for (std::size_t i = 0; i < reasons.size(); ++i) {
      verdict.line += (i > 0 ? "; " : "") + reasons[i];
    }
    verdict.line += "; " + advice;
    return verdict;
  }
  if (!verdict.outlook) {
    const std::size_t materials = basis::count_groups(basis.materials);
    verdict.line =
        "cannot tell: the samples fit the training materials, but " +
        (materials < basis::kFewestGroups
             ? fmt::format(
                   "{} (siblings counted once) are too few to foresee an error ({} at least)",
                   materials, basis::kFewestGroups)
             : std::string("this method foresees no error (the method auto does)"));
    return verdict;
  }
  verdict.trusted = true;
  verdict.line = fmt::format("trust: a picture of it is expected at {:.0f} dB (usable from {:.0f})",
                             verdict.outlook->expected_psnr_db, kUsablePsnr_db);
  if (verdict.grazing_half_width) {
    verdict.line += fmt::format(", two in three grazing values within {:.0f} %",
                                100.0 * std::expm1(*verdict.grazing_half_width));
  }
  return verdict;
}

}  // namespace gonio::quality
