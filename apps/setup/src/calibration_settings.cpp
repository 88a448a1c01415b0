#include "gonio/setup/calibration_settings.h"

#include "gonio/sim/hidden_options.h"

namespace gonio::cli {

calibration::routine::RoutineSettings calibration_settings(const RigFile& rig) {
  calibration::routine::RoutineSettings settings;
  settings.session = rig.session;
  settings.target_half_width_mm =
      rig.session.white_half_width_mm.value_or(rig.session.sample_half_width_mm);
  settings.mirror.offset_mm = rig.targets.mirror_raised_mm;
  settings.mirror.u_offset_mm = rig.targets.u_mirror_raised_mm;
  settings.sample.raised_mm = rig.targets.sample_raised_mm;
  settings.sample.u_raised_mm = rig.targets.u_sample_raised_mm;
  settings.black_glass_index = rig.targets.black_glass_index;
  if (rig.driver == RigFile::Driver::simulated || rig.hidden) {
    for (const brdf::Rgb& patch : sim::hidden_chart()) {
      settings.chart.linear_srgb.emplace_back(patch.matrix());
    }
  }
  return settings;
}

}  // namespace gonio::cli
