#include "text.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gonio::render {
namespace {

// Strokes on a grid of 8 x 12: pairs of hexadecimal digits x, y from the lower left; a blank lifts
// the pen.
std::string_view strokes_of(char c) {
  switch (c) {
    case 'A':
      return "004c80 1474";
    case 'B':
      return "000c5c7a785606 5684826000";
    case 'C':
      return "8a6c2c0a02206082";
    case 'D':
      return "000c5c89835000";
    case 'E':
      return "8c0c0080 0666";
    case 'F':
      return "8c0c00 0666";
    case 'G':
      return "8a6c2c0a022060828656";
    case 'H':
      return "000c 808c 0686";
    case 'I':
      return "404c";
    case 'J':
      return "7c72502002";
    case 'K':
      return "000c 8c05 2780";
    case 'L':
      return "0c0080";
    case 'M':
      return "000c468c80";
    case 'N':
      return "000c808c";
    case 'O':
    case '0':
      return "2c0a022060828a6c2c";
    case 'P':
      return "000c5c7a775505";
    case 'Q':
      return "2c0a022060828a6c2c 5380";
    case 'R':
      return "000c5c7a775505 4580";
    case 'S':
      return "8a6c2c0a0826668482602002";
    case 'T':
      return "0c8c 4c40";
    case 'U':
      return "0c022060828c";
    case 'V':
      return "0c408c";
    case 'W':
      return "0c2048608c";
    case 'X':
      return "008c 0c80";
    case 'Y':
      return "0c468c 4640";
    case 'Z':
      return "0c8c0080";
    case '1':
      return "2a4c40";
    case '2':
      return "0a2c6c8a880080";
    case '3':
      return "0a2c6c8a886636 668482602002";
    case '4':
      return "606c0484";
    case '5':
      return "8c1c07578582602002";
    case '6':
      return "7c29050220608284662604";
    case '7':
      return "0c8c30";
    case '8':
      return "26080a2c6c8a88662604022060828466";
    case '9':
      return "1063878a6c2c0a08266688";
    case '.':
      return "4040";
    case ',':
      return "4130";
    case ':':
      return "4343 4949";
    case '-':
      return "1676";
    case '+':
      return "1676 4349";
    case '=':
      return "1474 1979";
    case '_':
      return "0080";
    case '/':
      return "008c";
    case '(':
      return "6c393360";
    case ')':
      return "2c595320";
    default:
      return "";
  }
}

constexpr double kAdvance = 11.5 / 12.0;  // of the height: a letter and the gap after it
constexpr double kStroke = 0.13;

char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

double nibble(char c) { return c >= 'a' ? c - 'a' + 10 : c - '0'; }

struct Segment {
  double x0, y0, x1, y1;

  double distance(double x, double y) const {
    const double dx = x1 - x0;
    const double dy = y1 - y0;
    const double length2 = dx * dx + dy * dy;
    const double t =
        length2 > 0.0 ? std::clamp(((x - x0) * dx + (y - y0) * dy) / length2, 0.0, 1.0) : 0.0;
    return std::hypot(x - x0 - t * dx, y - y0 - t * dy);
  }
};

std::vector<Segment> segments_of(char c, double x, double baseline, double unit) {
  std::vector<Segment> segments;
  const std::string_view strokes = strokes_of(c);
  std::size_t at = 0;
  while (at < strokes.size()) {
    const std::size_t end = std::min(strokes.find(' ', at), strokes.size());
    for (std::size_t i = at; i + 3 < end; i += 2) {
      segments.push_back({x + nibble(strokes[i]) * unit, baseline - nibble(strokes[i + 1]) * unit,
                          x + nibble(strokes[i + 2]) * unit,
                          baseline - nibble(strokes[i + 3]) * unit});
    }
    at = end + 1;
  }
  return segments;
}

}  // namespace

void draw_text(Image& image, double x, double baseline, double height, std::string_view text,
               Rgba8 colour) {
  const double unit = height / 12.0;
  const double half_stroke = std::max(0.55, 0.5 * kStroke * height);
  for (const char c : text) {
    const std::vector<Segment> segments = segments_of(upper(c), x, baseline, unit);
    const int top = std::max(0, static_cast<int>(baseline - height - 2.0));
    const int bottom = std::min(image.height(), static_cast<int>(baseline + 3.0));
    const int left = std::max(0, static_cast<int>(x - 2.0));
    const int right = std::min(image.width(), static_cast<int>(x + 8.0 * unit + 3.0));
    for (int py = top; py < bottom && !segments.empty(); ++py) {
      for (int px = left; px < right; ++px) {
        double nearest = height;
        for (const Segment& segment : segments) {
          nearest = std::min(nearest, segment.distance(px + 0.5, py + 0.5));
        }
        const double cover = std::clamp(half_stroke - nearest + 0.5, 0.0, 1.0);
        if (cover > 0.0) image.at(px, py) = blend(image.at(px, py), colour, cover);
      }
    }
    x += kAdvance * height;
  }
}

double text_width(double height, std::string_view text) {
  return text.empty() ? 0.0
                      : kAdvance * height * static_cast<double>(text.size()) - height * 3.5 / 12.0;
}

}  // namespace gonio::render
