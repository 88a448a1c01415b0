#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gonio::page {

struct Point {
  double x;
  double y;
};

/// An inline drawing, built element by element. Coordinates in units of the view box, y down;
/// looks come from the page's style sheet by class. Elements with a coordinate that is not finite
/// are left out.
class Svg {
 public:
  Svg(double width, double height, std::string_view label);

  void line(Point from, Point to, std::string_view css);
  void polyline(const std::vector<Point>& points, std::string_view css);
  void circle(Point centre, double radius, std::string_view css, std::string_view tooltip = {});
  void rect(Point top_left, double width, double height, std::string_view css);
  /// A rectangle of some strength: opacity 0 to 1.
  void cell(Point top_left, double width, double height, std::string_view css, double opacity);
  /// A rectangle of one colour, "#rrggbb".
  void swatch(Point top_left, double width, double height, std::string_view colour);
  /// Many dots as one element, a tenth of the bytes of as many circles; their size is the stroke's.
  void dots(const std::vector<Point>& points, std::string_view css);
  /// `anchor`: start, middle or end. The text is escaped here.
  void text(Point at, std::string_view anchor, std::string_view css, std::string_view text);
  /// Text that reads upwards, centred.
  void upward_text(Point at, std::string_view css, std::string_view text);

  std::string finish() const;

 private:
  std::string body_;
};

/// An axis from data to drawing units.
class Axis {
 public:
  static Axis linear(double low, double high, double at_low, double at_high);
  /// Throws std::invalid_argument unless 0 < low < high.
  static Axis logarithmic(double low, double high, double at_low, double at_high);

  double operator()(double value) const;
  double low() const { return low_; }
  double high() const { return high_; }

  /// Powers of ten inside a logarithmic axis.
  std::vector<double> decades() const;

 private:
  Axis(double low, double high, double at_low, double at_high, bool logarithmic);
  double low_;
  double high_;
  double at_low_;
  double at_high_;
  bool logarithmic_;
};

/// "0.01", "1", "100"; "10⁻⁶" where zeros would get long.
std::string decade_label(double power_of_ten);

}  // namespace gonio::page
