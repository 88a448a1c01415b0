#include <fmt/format.h>

#include <charconv>
#include <stdexcept>

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

constexpr const char* kBoardSquare = "board_square_mm";

}  // namespace

void keep_measured_board(const instrument::CalibrationArchive& archive, RoutineSettings& settings) {
  if (settings.board_measured) return;
  // The last that was told: a result that is to be taken again still holds what was corrected.
  const instrument::StepResult* last = nullptr;
  for (const instrument::StepResult& result : archive.results) {
    if (!result.told.contains(kBoardSquare)) continue;
    if (last == nullptr || result.finished >= last->finished) last = &result;
  }
  if (last == nullptr) return;
  const std::string& told = last->told.at(kBoardSquare);
  double square_mm = 0.0;
  const char* const end = told.data() + told.size();
  const auto read = std::from_chars(told.data(), end, square_mm);
  if (read.ec != std::errc() || read.ptr != end) {
    throw std::invalid_argument(fmt::format("{}: told.{}: found \"{}\", expected a length",
                                            last->step, kBoardSquare, told));
  }
  settings.board.square_mm = square_mm;
  settings.board.validate();
  settings.board_measured = true;
}

instrument::TargetData target_data(const RoutineSettings& settings) {
  instrument::TargetData data{
      {"mirror_raised_mm", fmt::format("{}", settings.mirror.offset_mm)},
      {"u_mirror_raised_mm", fmt::format("{}", settings.mirror.u_offset_mm)},
      {"sample_raised_mm", fmt::format("{}", settings.sample.raised_mm)},
      {"u_sample_raised_mm", fmt::format("{}", settings.sample.u_raised_mm)},
      {"black_glass_index", fmt::format("{}", settings.black_glass_index)}};
  if (settings.board_measured) {
    data[kBoardSquare] = fmt::format("{}", settings.board.square_mm);
  }
  if (!settings.chart.linear_srgb.empty()) data["colour_chart"] = chart_sha256(settings.chart);
  return data;
}

}  // namespace gonio::calibration::routine
