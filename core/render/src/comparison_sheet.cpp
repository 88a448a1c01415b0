#include "gonio/render/comparison_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "gonio/render/difference.h"
#include "text.h"

namespace gonio::render {
namespace {

constexpr Rgba8 kPaper = {22, 24, 28, 255};
constexpr Rgba8 kInk = {226, 229, 234, 255};
constexpr Rgba8 kQuietInk = {142, 149, 160, 255};

/// Where things lie on a sheet of `columns` spheres a row.
struct Grid {
  int size;
  int gap;
  int head;     ///< height of the names' line
  int caption;  ///< below each row
  double letter;

  explicit Grid(int sphere_size)
      : size(sphere_size),
        gap(std::max(12, sphere_size / 14)),
        head(std::max(20, sphere_size / 8)),
        caption(std::max(16, sphere_size / 10)),
        letter(std::max(7.0, sphere_size / 30.0)) {}

  int width(int columns) const { return columns * size + (columns + 1) * gap; }
  int height(int rows) const { return head + rows * (size + caption) + gap / 2; }
  int x(int column) const { return gap + column * (size + gap); }
  int y(int row) const { return head + row * (size + caption); }
};

void check(const SheetOptions& options) {
  if (options.sphere_size < 64 || options.sphere_size > 1024) {
    throw std::invalid_argument(
        fmt::format("sheet: spheres of {} pixels, must be in 64..1024", options.sphere_size));
  }
  if (options.lightings.empty()) throw std::invalid_argument("sheet: no lighting chosen");
}

/// As much of the text as fits into a column.
std::string_view fitting(std::string_view text, double letter, int width) {
  while (!text.empty() && text_width(letter, text) > width) text.remove_suffix(1);
  return text;
}

void centred(Image& sheet, double middle, double baseline, double letter, std::string_view text,
             Rgba8 colour) {
  draw_text(sheet, middle - 0.5 * text_width(letter, text), baseline, letter, text, colour);
}

}  // namespace

Image comparison_sheet(const brdf::BrdfModel& reference, const brdf::BrdfModel& result,
                       brdf::RadiometricScale scale, const SheetOptions& options) {
  check(options);
  const Grid grid(options.sphere_size);
  const int rows = static_cast<int>(options.lightings.size());
  Image sheet(grid.width(3), grid.height(rows), kPaper);

  const double head_line = grid.head - 0.35 * grid.head;
  const std::array<std::string_view, 3> names = {options.reference_name, options.result_name,
                                                 "difference"};
  for (int column = 0; column < 3; ++column) {
    centred(sheet, grid.x(column) + 0.5 * grid.size, head_line, grid.letter,
            fitting(names[static_cast<std::size_t>(column)], grid.letter, grid.size), kInk);
  }

  const std::array<const brdf::BrdfModel*, 2> models = {&reference, &result};
  for (int row = 0; row < rows; ++row) {
    const PictureLighting lighting = options.lightings[static_cast<std::size_t>(row)];
    const std::vector<SpherePicture> pictures = render_spheres(models, lighting, grid.size);
    const double exposure = picture_exposure(pictures[0], lighting, scale);
    const DifferencePicture difference = difference_picture(pictures[0], pictures[1], exposure);
    sheet.draw(develop(pictures[0], exposure), grid.x(0), grid.y(row));
    sheet.draw(develop(pictures[1], exposure), grid.x(1), grid.y(row));
    sheet.draw(difference.image, grid.x(2), grid.y(row));

    const double small = 0.8 * grid.letter;
    const double line = grid.y(row) + grid.size + 0.5 * grid.caption + 0.5 * small;
    draw_text(sheet, grid.x(0), line, small, to_string(lighting), kQuietInk);
    const std::string mean = fmt::format("mean {:.2f}", difference.mean_delta_e);
    const std::string end = fmt::format("{:.0f} CIEDE2000", kDifferenceScale);
    const double end_x = grid.x(2) + grid.size - text_width(small, end);
    const int bar_width = grid.size / 5;
    const int bar_x = static_cast<int>(end_x - 0.7 * small) - bar_width;
    const double zero_x = bar_x - 1.4 * small;
    if (grid.x(2) + text_width(small, mean) > zero_x) {
      // Under a small sphere the scale would run into the mean, which says more.
      draw_text(sheet, grid.x(2), line, small, mean + " dE00", kQuietInk);
      continue;
    }
    draw_text(sheet, grid.x(2), line, small, mean, kQuietInk);
    draw_text(sheet, end_x, line, small, end, kQuietInk);
    sheet.draw(heat_bar(bar_width, static_cast<int>(small)), bar_x, static_cast<int>(line - small));
    draw_text(sheet, zero_x, line, small, "0", kQuietInk);
  }
  return sheet;
}

Image sphere_sheet(const brdf::BrdfModel& model, brdf::RadiometricScale scale,
                   const SheetOptions& options) {
  check(options);
  const Grid grid(options.sphere_size);
  const int columns = static_cast<int>(options.lightings.size());
  Image sheet(grid.width(columns), grid.height(1), kPaper);
  draw_text(sheet, grid.x(0), grid.head - 0.35 * grid.head, grid.letter,
            fitting(options.result_name, grid.letter, grid.width(columns) - 2 * grid.gap), kInk);
  for (int column = 0; column < columns; ++column) {
    const PictureLighting lighting = options.lightings[static_cast<std::size_t>(column)];
    const SpherePicture picture = render_sphere(model, lighting, grid.size);
    sheet.draw(develop(picture, picture_exposure(picture, lighting, scale)), grid.x(column),
               grid.y(0));
    const double small = 0.8 * grid.letter;
    centred(sheet, grid.x(column) + 0.5 * grid.size,
            grid.y(0) + grid.size + 0.5 * grid.caption + 0.5 * small, small, to_string(lighting),
            kQuietInk);
  }
  return sheet;
}

}  // namespace gonio::render
