// The calibration board to print, at its true size.

#include <fmt/format.h>

#include "command.h"
#include "gonio/calibration/board/board_spec.h"
#include "gonio/files/text_file.h"
#include "outputs.h"

namespace gonio::cli {
namespace {

struct BoardOptions {
  std::string out;
  bool force = false;
};

/// Lengths in mm; what is not black is paper.
std::string board_svg(const calibration::board::BoardSpec& spec) {
  constexpr double kMargin_mm = 10.0;
  constexpr double kRuler_mm = 8.0;
  const calibration::board::BoardCells cells = calibration::board::board_cells(spec);
  const double cell_mm = spec.cell_mm();
  const double width = cells.columns * cell_mm;
  const double height = cells.rows * cell_mm;
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}mm\" height=\"{1:g}mm\" "
      "viewBox=\"0 0 {0:g} {1:g}\">\n<rect width=\"{0:g}\" height=\"{1:g}\" fill=\"#fff\"/>\n<path "
      "fill=\"#000\" shape-rendering=\"crispEdges\" d=\"",
      width + 2.0 * kMargin_mm, height + 2.0 * kMargin_mm + kRuler_mm);
  const auto black = [&](int row, int column) {
    return !cells.white[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells.columns) +
                        static_cast<std::size_t>(column)];
  };
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns;) {
      const int begin = column;
      while (column < cells.columns && black(row, column)) ++column;
      if (column > begin) {
        text += fmt::format("M{:g} {:g}h{:g}v{:g}h{:g}z", kMargin_mm + begin * cell_mm,
                            kMargin_mm + row * cell_mm, (column - begin) * cell_mm, cell_mm,
                            -(column - begin) * cell_mm);
      }
      while (column < cells.columns && !black(row, column)) ++column;
    }
  }
  const double ruler = kMargin_mm + height + 5.0;
  text += fmt::format(
      "\"/>\n<path stroke=\"#000\" stroke-width=\".2\" fill=\"none\" d=\"M{0:g} {1:g}v3m0 "
      "-1.5h{2:g}m0 -1.5v3\"/>\n<text x=\"{3:g}\" y=\"{4:g}\" font-family=\"sans-serif\" "
      "font-size=\"3\">{2:g} mm as drawn; what it measures / {5} is --square-mm</text>\n</svg>\n",
      kMargin_mm, ruler, width, kMargin_mm, ruler + 7.0, spec.columns);
  return text;
}

int board(Context& context, const BoardOptions& options) {
  require_output(options.out, options.force, {});
  files::write_text_file(options.out, board_svg({}), overwrite(options.force));
  context.console.say(
      fmt::format("{}: print it at 100 %, glue it to something flat, and measure the line "
                  "under it: an eleventh is what gonio calibrate --square-mm takes",
                  options.out));
  return kSuccess;
}

}  // namespace

void add_board(const Command& root) {
  auto options = std::make_shared<BoardOptions>();
  const Command command = root.add("board", "Draw the calibration board, to print (SVG)",
                                   "gonio board --out board.svg");
  command.text("--out", options->out, "Picture to write, at its true size", Need::required);
  command.force(options->force);
  command.on_call(options, board);
}

}  // namespace gonio::cli
