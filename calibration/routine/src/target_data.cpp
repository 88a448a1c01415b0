#include <fmt/format.h>

#include "gonio/calibration/routine/settings.h"
#include "gonio/files/sha256.h"

namespace gonio::calibration::routine {
namespace {

std::string chart_sha256(const ChartSpec& chart) {
  std::string text = fmt::format("{} {} {}\n", chart.columns, chart.patch_mm, chart.gap_mm);
  for (const Eigen::Vector3d& patch : chart.linear_srgb) {
    text += fmt::format("{} {} {}\n", patch.x(), patch.y(), patch.z());
  }
  return files::sha256_of_bytes(std::string_view(text));
}

}  // namespace

instrument::TargetData target_data(const RoutineSettings& settings) {
  instrument::TargetData data{
      {"mirror_raised_mm", fmt::format("{}", settings.mirror.offset_mm)},
      {"u_mirror_raised_mm", fmt::format("{}", settings.mirror.u_offset_mm)},
      {"sample_raised_mm", fmt::format("{}", settings.sample.raised_mm)},
      {"u_sample_raised_mm", fmt::format("{}", settings.sample.u_raised_mm)},
      {"black_glass_index", fmt::format("{}", settings.black_glass_index)}};
  if (!settings.chart.linear_srgb.empty()) data["colour_chart"] = chart_sha256(settings.chart);
  return data;
}

}  // namespace gonio::calibration::routine
