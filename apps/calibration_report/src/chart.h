#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gonio/page/svg.h"

namespace gonio::calibration_report {

/// Marks of one kind. `css` is "dot", "off" (rings) or "curve" and a colour: "dot g".
struct Series {
  std::vector<page::Point> points;
  std::string_view css;
  std::string name;  ///< in the key; empty: not in it. Escaped where it is written
};

/// What stands around a drawing. All is escaped where it is written.
struct Caption {
  std::string title;
  std::string x;     ///< "signal (DN)"
  std::string y;     ///< read upwards
  std::string note;  ///< one line below: how much is drawn, what bad would look like
};

/// A line across at a value that means something: a limit, two sigmas.
struct Level {
  double y = 0.0;
  std::string name;  ///< of the first only; in the key
};

struct ChartOptions {
  bool with_zero = false;  ///< the axis of y holds zero, which is drawn
  std::vector<Level> levels = {};
};

/// A value over a rectangle of a map, all in the map's own units.
struct Cell {
  page::Point low;
  page::Point high;
  double value = 0.0;
  bool veiled = false;  ///< drawn faded: not supported by data
};

/// A field over a plane: an image (rows downwards) or angles (upwards).
struct MapOptions {
  page::Point low;   ///< of the plane
  page::Point high;  ///< above `low`
  bool downwards = true;
  double full = 0.0;      ///< |value| of full colour; 0: no colours and no bar
  double middle = 0.0;    ///< value without colour; above it red, below it blue
  std::string unit;       ///< of the values, beside the bar
  bool positive = false;  ///< values are counts: one colour from `middle` up
};

/// Points and curves over common linear axes. Empty when nothing is finite.
std::string chart(const Caption& caption, const std::vector<Series>& series,
                  const ChartOptions& options = {});

/// Vectors about (0, 0) at one scale for x and y, with a circle of radius `rms`; `downwards`: as in
/// a picture, y grows downwards. A series of more than 300 is drawn as dots without tooltips. Empty
/// when nothing but curves is there.
std::string scatter(const Caption& caption, const std::vector<Series>& series, double rms,
                    bool downwards = true);

/// Cells, then marks and curves in the map's units. `key` as in a chart.
std::string field_map(const Caption& caption, const MapOptions& options,
                      const std::vector<Cell>& cells, const std::vector<Series>& series);

/// A figure of a finished drawing: title above, key and note below.
std::string figure(const Caption& caption, const std::string& drawing,
                   const std::vector<Series>& series, const std::vector<Level>& levels = {});

/// Round numbers in [low, high], about `count` of them.
std::vector<double> ticks(double low, double high, int count);
/// A tick's number with as many decimals as its step needs.
std::string tick_label(double value, double step);

/// 1, 2 or 5 times a power of ten, at least `value`; 1 for 0.
double round_up(double value);

}  // namespace gonio::calibration_report
