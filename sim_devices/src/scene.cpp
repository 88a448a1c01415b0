#include "scene.h"

#include <cmath>

#include "gonio/brdf/diffuse_models.h"

namespace gonio::sim {
namespace {

constexpr double kWhiteAlbedo = 0.99;

std::shared_ptr<const brdf::BrdfModel> lambertian(const brdf::Rgb& albedo) {
  return std::make_shared<brdf::Lambertian>(albedo);
}

std::shared_ptr<const brdf::BrdfModel> grey(double albedo) {
  return lambertian(brdf::Rgb::Constant(albedo));
}

std::shared_ptr<const brdf::BrdfModel> or_white(std::shared_ptr<const brdf::BrdfModel> model) {
  return model ? model : grey(kWhiteAlbedo);
}

bool in_square(double x, double y, double half_width) {
  return std::abs(x) <= half_width && std::abs(y) <= half_width;
}

}  // namespace

Scene::Scene(const SceneOptions& options)
    : options_(options),
      white_tile_(or_white(options.white_tile)),
      patch_(or_white(options.patch)),
      holder_(grey(options.holder_albedo)),
      board_white_(grey(options.board.white_albedo)),
      board_black_(grey(options.board.black_albedo)),
      mirror_dust_(grey(options.mirror.diffuse_albedo)),
      glass_dust_(grey(options.black_glass.diffuse_albedo)),
      trap_(grey(options.black_trap_albedo)) {
  for (const brdf::Rgb& albedo : options.colour_chart.albedos) {
    chart_.push_back(lambertian(albedo));
  }
}

const brdf::BrdfModel* Scene::on_board(double x_mm, double y_mm) const {
  const BoardOptions& board = options_.board;
  const double column = (x_mm - board.x_mm) / board.cell_mm + 0.5 * board.columns;
  const double row = 0.5 * board.rows - (y_mm - board.y_mm) / board.cell_mm;
  const double margin = board.margin_mm / board.cell_mm;
  if (board.columns == 0 || column < -margin || row < -margin || column > board.columns + margin ||
      row > board.rows + margin) {
    return nullptr;
  }
  const bool on_cells = column >= 0.0 && row >= 0.0 && column < board.columns && row < board.rows;
  if (!on_cells) return board_white_.get();
  const std::size_t cell = static_cast<std::size_t>(row) * static_cast<std::size_t>(board.columns) +
                           static_cast<std::size_t>(column);
  return (board.white[cell] ? board_white_ : board_black_).get();
}

const brdf::BrdfModel* Scene::on_chart(double x_mm, double y_mm) const {
  const ColourChartOptions& chart = options_.colour_chart;
  if (chart_.empty()) return nullptr;
  const double pitch = chart.patch_mm + chart.gap_mm;
  const auto columns = static_cast<double>(chart.columns);
  const double rows = std::ceil(static_cast<double>(chart_.size()) / columns);
  const double column = x_mm / pitch + 0.5 * columns;
  const double row = 0.5 * rows - y_mm / pitch;
  if (column < 0.0 || row < 0.0 || column >= columns || row >= rows) return nullptr;
  const double half_patch = 0.5 * chart.patch_mm / pitch;
  const bool in_gap = std::abs(column - std::floor(column) - 0.5) > half_patch ||
                      std::abs(row - std::floor(row) - 0.5) > half_patch;
  const std::size_t patch =
      static_cast<std::size_t>(row) * static_cast<std::size_t>(chart.columns) +
      static_cast<std::size_t>(column);
  return in_gap || patch >= chart_.size() ? board_black_.get() : chart_[patch].get();
}

const PolishedOptions* Scene::polish_at(double x_mm, double y_mm, devices::Target target) const {
  const bool mirror = target == devices::Target::mirror || target == devices::Target::mirror_turned;
  const PolishedOptions* polish = mirror                                   ? &options_.mirror
                                  : target == devices::Target::black_glass ? &options_.black_glass
                                                                           : nullptr;
  if (polish == nullptr || !in_square(x_mm, y_mm, polish->half_width_mm)) return nullptr;
  return polish;
}

const brdf::BrdfModel* Scene::material_at(double x_mm, double y_mm, devices::Target target) const {
  const SceneOptions& scene = options_;
  const brdf::BrdfModel* seen = nullptr;
  const auto within = [&](double half_width, const auto& model) {
    if (in_square(x_mm, y_mm, half_width)) seen = model.get();
  };
  switch (target) {
    case devices::Target::sample:
      within(scene.sample_half_width_mm, scene.sample);
      break;
    case devices::Target::white:
      within(scene.white_tile_half_width_mm, white_tile_);
      break;
    case devices::Target::board:
      seen = on_board(x_mm, y_mm);
      break;
    case devices::Target::board_turned:
      seen = on_board(-x_mm, -y_mm);
      break;
    case devices::Target::mirror:
    case devices::Target::mirror_turned:
      within(scene.mirror.half_width_mm, mirror_dust_);
      break;
    case devices::Target::black_trap:
      within(scene.black_trap_half_width_mm, trap_);
      break;
    case devices::Target::black_glass:
      within(scene.black_glass.half_width_mm, glass_dust_);
      break;
    case devices::Target::colour_chart:
      seen = on_chart(x_mm, y_mm);
      break;
  }
  if (seen != nullptr) return seen;
  if (scene.white_patch &&
      in_square(x_mm - scene.patch_x_mm, y_mm - scene.patch_y_mm, scene.patch_half_width_mm)) {
    return patch_.get();
  }
  return in_square(x_mm, y_mm, scene.holder_half_width_mm) ? holder_.get() : nullptr;
}

}  // namespace gonio::sim
