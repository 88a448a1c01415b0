#include "patch_geometry.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "failures.h"
#include "simulated_rig.h"

namespace gonio::cli {
namespace {

constexpr double kAssumedHalfWidth_mm = 25.0;
constexpr double kLargestHalfWidth_mm = 500.0;

}  // namespace

design::PatchGeometry patch_of(const RigFile& rig) {
  const acquisition::ReductionOptions& reduction = rig.reduction;
  design::PatchGeometry patch;
  patch.grid = reduction.grid;
  patch.camera_distance_mm = rig.camera_distance();
  patch.lamp_distance_mm = rig.lamp_distance();
  if (patch.grid == 1) return patch;
  // The outermost spots touch the usable edge, the squares of a patch fill it.
  const double outermost_mm =
      reduction.sample_half_width_mm - reduction.edge_margin_mm - reduction.spot_half_width_mm;
  patch.half_width_mm = outermost_mm * patch.grid / (patch.grid - 1.0);
  return patch;
}

design::PatchGeometry planned_patch(const std::string& word, const RigFile* rig) {
  if (word == "auto") {
    return rig != nullptr ? patch_of(*rig)
                          : design::PatchGeometry::of_half_width(kAssumedHalfWidth_mm);
  }
  double half_width_mm = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), half_width_mm);
  if (error != std::errc() || end != word.data() + word.size() ||
      !(half_width_mm >= 0.0 && half_width_mm <= kLargestHalfWidth_mm)) {
    throw UsageError(fmt::format("--patch: found '{}', expected auto or 0 to {} mm", word,
                                 kLargestHalfWidth_mm));
  }
  design::PatchGeometry patch = design::PatchGeometry::of_half_width(half_width_mm);
  if (rig != nullptr) {
    patch.camera_distance_mm = rig->camera_distance();
    patch.lamp_distance_mm = rig->lamp_distance();
  }
  return patch;
}

std::string to_text(const design::PatchGeometry& patch) {
  if (patch.is_point()) return "points";
  return fmt::format("patches of +-{:g} mm ({} x {})", patch.half_width_mm, patch.grid, patch.grid);
}

design::PoseNoise planned_noise(const RigFile* rig) {
  design::PoseNoise noise;
  if (rig != nullptr) {
    const instrument::Instrument instrument = nominal_instrument(*rig);
    noise.common = std::hypot(instrument.white.u_relative, instrument.u_lamp_relative,
                              instrument.u_linearity_relative);
  }
  return noise;
}

}  // namespace gonio::cli
