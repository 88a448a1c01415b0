#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <string>
#include <vector>

namespace gonio::calibration_report::test {

/// A mark as a person reads it off the page: by the numbers at the axes.
struct Mark {
  double x;
  double y;
};

/// A coloured field of a map: its middle, and how strong its colour is.
struct Field {
  double x;
  double y;
  double strength;
};

/// One figure of the page and what its axes' numbers say.
class Figure {
 public:
  Figure(const std::string& page, const std::string& title) {
    const std::string caption = "<figcaption>" + title + "</figcaption>";
    const std::size_t begin = page.find(caption);
    if (begin == std::string::npos) return;
    text_ = page.substr(begin, page.find("</figure>", begin) - begin);
    const std::regex tick(
        "<text x=\"([-0-9.]+)\" y=\"([-0-9.]+)\" text-anchor=\"(middle|end)\" "
        "class=\"tick\">([^<]+)</text>");
    for (std::sregex_iterator it(text_.begin(), text_.end(), tick), end; it != end; ++it) {
      const bool across = (*it)[3] == "middle";
      // Numbers beside the axis of y stand a little below their line.
      const double at = std::stod((*it)[across ? 1 : 2]) - (across ? 0.0 : kBelowLine);
      (across ? x_ : y_).push_back({at, number_of((*it)[4])});
    }
  }

  bool there() const { return !text_.empty(); }
  const std::string& text() const { return text_; }

  /// Circles of a class.
  std::vector<Mark> circles(const std::string& css) const {
    const std::regex circle("<circle cx=\"([-0-9.]+)\" cy=\"([-0-9.]+)\" r=\"[0-9.]+\" class=\"" +
                            css + "\"");
    return marks(circle);
  }

  /// Dots of a cloud.
  std::vector<Mark> dots() const { return marks(std::regex("M([-0-9.]+) ([-0-9.]+)h0")); }

  /// First point and last of every curve of a class.
  std::vector<std::pair<Mark, Mark>> curves(const std::string& css) const {
    std::vector<std::pair<Mark, Mark>> all;
    const std::regex curve(
        "<path d=\"M([-0-9.]+) ([-0-9.]+)[^\"]*L([-0-9.]+) ([-0-9.]+)\" class=\"" + css + "\"");
    for (std::sregex_iterator it(text_.begin(), text_.end(), curve), end; it != end; ++it) {
      all.push_back({mark((*it)[1], (*it)[2]), mark((*it)[3], (*it)[4])});
    }
    return all;
  }

  /// Coloured fields of a class; those of the colour bar, right of the plot, are left out.
  std::vector<Field> fields(const std::string& css) const {
    const std::regex rect(
        "<rect x=\"([-0-9.]+)\" y=\"([-0-9.]+)\" width=\"([0-9.]+)\" height=\"([0-9.]+)\" "
        "class=\"" +
        css + "\" opacity=\"([-0-9.e]+)\"/>");
    constexpr double kBar = 430.0;
    std::vector<Field> all;
    for (std::sregex_iterator it(text_.begin(), text_.end(), rect), end; it != end; ++it) {
      const double left = std::stod((*it)[1]);
      if (left > kBar) continue;
      const double top = std::stod((*it)[2]);
      all.push_back({value(x_, left + 0.5 * std::stod((*it)[3])),
                     value(y_, top + 0.5 * std::stod((*it)[4])), std::stod((*it)[5])});
    }
    return all;
  }

  /// How far the rms circle reaches, in units of the axis of x; 0: there is none.
  double circle_radius(const std::string& css) const {
    std::smatch found;
    const std::regex circle("r=\"([0-9.]+)\" class=\"" + css + "\"");
    if (!std::regex_search(text_, found, circle)) return 0.0;
    const double radius = std::stod(found[1]);
    return value(x_, radius) - value(x_, 0.0);
  }

 private:
  struct Tick {
    double at;
    double value;
  };
  static constexpr double kBelowLine = 4.5;

  static double number_of(std::string label) {
    const std::string minus = "−";
    const bool negative = label.starts_with(minus);
    return negative ? -std::stod(label.substr(minus.size())) : std::stod(label);
  }

  static double value(const std::vector<Tick>& ticks, double at) {
    if (ticks.size() < 2) {
      ADD_FAILURE() << "an axis with fewer than two numbers";
      return 0.0;
    }
    const Tick& a = ticks.front();
    const Tick& b = ticks.back();
    return a.value + (at - a.at) / (b.at - a.at) * (b.value - a.value);
  }

  Mark mark(const std::string& x, const std::string& y) const {
    return {value(x_, std::stod(x)), value(y_, std::stod(y))};
  }

  std::vector<Mark> marks(const std::regex& element) const {
    std::vector<Mark> all;
    for (std::sregex_iterator it(text_.begin(), text_.end(), element), end; it != end; ++it) {
      all.push_back(mark((*it)[1], (*it)[2]));
    }
    return all;
  }

  std::string text_;
  std::vector<Tick> x_;
  std::vector<Tick> y_;
};

/// That one of the marks lies at (x, y).
inline bool has_mark(const std::vector<Mark>& marks, double x, double y, double within_x,
                     double within_y) {
  return std::any_of(marks.begin(), marks.end(), [&](const Mark& m) {
    return std::abs(m.x - x) <= within_x && std::abs(m.y - y) <= within_y;
  });
}

}  // namespace gonio::calibration_report::test
