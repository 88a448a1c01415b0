#include "near_field_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gonio/console/failures.h"
#include "planning.h"

namespace gonio::cli {
namespace {

constexpr int kTablePx = 64;  // image edge of the table: shares to a per cent
constexpr double kEnough = 0.9;

}  // namespace

design::NearFieldSetup near_field_setup(const NearFieldWords& words) {
  design::NearFieldSetup setup;
  setup.field_of_view = Angle::from_degrees(words.fov_deg);
  setup.camera_distance_mm = words.camera_mm;
  if (words.lamp_mm > 0.0) setup.lamp_distance_mm = words.lamp_mm;
  if (words.sample_mm > 0.0) setup.sample_half_width_mm = words.sample_mm;
  return setup;
}

void add_near_field_options(const Command& command, NearFieldWords& words) {
  command.number("--fov", words.fov_deg, 1.0, 120.0,
                 "Field of view of a square near-field photograph, degrees");
  command.number("--camera-mm", words.camera_mm, 1.0, 1e5, "Distance of its camera");
  command.number("--lamp-mm", words.lamp_mm, 0.0, 1e6,
                 "Distance of its point lamp; 0: directional light");
  command.number("--sample-mm", words.sample_mm, 0.0, 1e5,
                 "Half width of the sample it shows; 0: no edge in sight");
}

void refuse_near_field_options(const NearFieldWords& words, const std::string& asked_by) {
  const NearFieldWords defaults;
  const auto refuse = [&](const char* name, bool given) {
    if (given) throw UsageError(fmt::format("{} goes with {} only", name, asked_by));
  };
  refuse("--fov", words.fov_deg != defaults.fov_deg);
  refuse("--camera-mm", words.camera_mm != defaults.camera_mm);
  refuse("--lamp-mm", words.lamp_mm != defaults.lamp_mm);
  refuse("--sample-mm", words.sample_mm != defaults.sample_mm);
}

std::vector<brdf::HalfDiff> choose_shots(const Console& console, const basis::Basis& basis,
                                         const Eigen::MatrixXd& importance,
                                         const design::NearFieldSetup& setup,
                                         const design::NearFieldOptions& options,
                                         const std::stop_token& stop) {
  const PhaseTimer timer(console, "choosing shots");
  Progress progress(console, "choosing shots");
  return design::choose_shots(
             basis, importance, setup, options,
             [&](const design::SearchProgress& now) { progress.update(now.fraction); }, stop)
      .shots;
}

std::string near_field_text(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                            const std::vector<brdf::HalfDiff>& shots,
                            const design::NearFieldSetup& setup, const design::PoseNoise& noise) {
  const basis::BasisRows rows(basis);
  design::NearFieldSetup table = setup;
  table.image_px = kTablePx;
  design::NearFieldSetup endless = table;
  endless.sample_half_width_mm = std::numeric_limits<double>::infinity();
  std::string text =
      "usable pixels by half width of the sample, and the expected weighted log error:\n";
  const auto line = [&](double half_width_mm) {
    table.sample_half_width_mm = half_width_mm;
    text += std::isfinite(half_width_mm) ? fmt::format("  +-{:<4g} mm ", half_width_mm)
                                         : std::string("  no edge   ");
    for (const brdf::HalfDiff& shot : shots) {
      const auto usable = static_cast<double>(design::near_field_view(shot, table).usable_pixels);
      text += fmt::format(" {:5.1f} %", 100.0 * usable / (kTablePx * kTablePx));
    }
    text += fmt::format("   {:.4f}\n",
                        std::sqrt(design::near_field_error(rows, importance, shots, table, noise)));
  };
  for (const double half_width_mm : {25.0, 50.0, 100.0, 150.0, 250.0, 500.0}) line(half_width_mm);
  line(endless.sample_half_width_mm);
  double needed_mm = 0.0;
  for (const brdf::HalfDiff& shot : shots) {
    needed_mm = std::max(needed_mm, design::needed_half_width_mm(shot, endless, kEnough));
  }
  text += fmt::format("a sample of +-{:.0f} mm keeps {:.0f} % of what an endless one shows\n",
                      std::ceil(needed_mm), 100.0 * kEnough);
  return text;
}

}  // namespace gonio::cli
