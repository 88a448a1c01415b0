#include "scene.h"

#include <cmath>
#include <utility>

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
      surfaces_(1, Surface{nullptr, brdf::Rgb::Zero()}),
      sample_(add(options.sample)),
      white_tile_(add(or_white(options.white_tile))),
      patch_(add(or_white(options.patch))),
      holder_(add(grey(options.holder_albedo))),
      board_white_(add(grey(options.board.white_albedo))),
      board_black_(add(grey(options.board.black_albedo))),
      mirror_(add(grey(options.mirror.diffuse_albedo), &options_.mirror)),
      glass_(add(grey(options.black_glass.diffuse_albedo), &options_.black_glass)),
      trap_(add(grey(options.black_trap_albedo))),
      chart_(static_cast<Index>(surfaces_.size())) {
  for (const brdf::Rgb& albedo : options.colour_chart.albedos) add(lambertian(albedo));
}

Scene::Index Scene::add(std::shared_ptr<const brdf::BrdfModel> material,
                        const PolishedOptions* polish) {
  Surface surface;
  if (const auto* same = dynamic_cast<const brdf::Lambertian*>(material.get())) {
    const Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    surface.per_sr = same->evaluate(brdf::DirectionPair{normal, normal});
  }
  surface.material = std::move(material);
  surface.polish = polish;
  surfaces_.push_back(std::move(surface));
  return static_cast<Index>(surfaces_.size() - 1);
}

Scene::Index Scene::on_board(double x_mm, double y_mm) const {
  const BoardOptions& board = options_.board;
  const double column = (x_mm - board.x_mm) / board.cell_mm + 0.5 * board.columns;
  const double row = 0.5 * board.rows - (y_mm - board.y_mm) / board.cell_mm;
  const double margin = board.margin_mm / board.cell_mm;
  if (board.columns == 0 || column < -margin || row < -margin || column > board.columns + margin ||
      row > board.rows + margin) {
    return kBackground;
  }
  const bool on_cells = column >= 0.0 && row >= 0.0 && column < board.columns && row < board.rows;
  if (!on_cells) return board_white_;
  const std::size_t cell = static_cast<std::size_t>(row) * static_cast<std::size_t>(board.columns) +
                           static_cast<std::size_t>(column);
  return board.white[cell] ? board_white_ : board_black_;
}

Scene::Index Scene::on_chart(double x_mm, double y_mm) const {
  const ColourChartOptions& chart = options_.colour_chart;
  if (chart.albedos.empty()) return kBackground;
  const double pitch = chart.patch_mm + chart.gap_mm;
  const auto columns = static_cast<double>(chart.columns);
  const double rows = std::ceil(static_cast<double>(chart.albedos.size()) / columns);
  const double column = x_mm / pitch + 0.5 * columns;
  const double row = 0.5 * rows - y_mm / pitch;
  if (column < 0.0 || row < 0.0 || column >= columns || row >= rows) return kBackground;
  const double half_patch = 0.5 * chart.patch_mm / pitch;
  const bool in_gap = std::abs(column - std::floor(column) - 0.5) > half_patch ||
                      std::abs(row - std::floor(row) - 0.5) > half_patch;
  const std::size_t patch =
      static_cast<std::size_t>(row) * static_cast<std::size_t>(chart.columns) +
      static_cast<std::size_t>(column);
  return in_gap || patch >= chart.albedos.size() ? board_black_
                                                 : static_cast<Index>(chart_ + patch);
}

Scene::Index Scene::surface_at(double x_mm, double y_mm, devices::Target target) const {
  const SceneOptions& scene = options_;
  Index seen = kBackground;
  const auto within = [&](double half_width, Index surface) {
    if (in_square(x_mm, y_mm, half_width)) seen = surface;
  };
  switch (target) {
    case devices::Target::sample:
      within(scene.sample_half_width_mm, sample_);
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
      within(scene.mirror.half_width_mm, mirror_);
      break;
    case devices::Target::black_trap:
      within(scene.black_trap_half_width_mm, trap_);
      break;
    case devices::Target::black_glass:
      within(scene.black_glass.half_width_mm, glass_);
      break;
    case devices::Target::colour_chart:
      seen = on_chart(x_mm, y_mm);
      break;
  }
  if (seen != kBackground) return seen;
  if (scene.white_patch &&
      in_square(x_mm - scene.patch_x_mm, y_mm - scene.patch_y_mm, scene.patch_half_width_mm)) {
    return patch_;
  }
  return in_square(x_mm, y_mm, scene.holder_half_width_mm) ? holder_ : kBackground;
}

}  // namespace gonio::sim
