#include <fmt/format.h>

#include <cmath>

#include "page_parts.h"
#include "plots.h"

namespace gonio::report {
namespace {

constexpr int kColours = 8;

bool worth_showing(const TimingEntry& entry) {
  return std::isfinite(entry.seconds) && entry.seconds > 0.0;
}

}  // namespace

std::string timing_figure(const ReportData& data) {
  double total = 0.0;
  for (const TimingEntry& entry : data.timing) total += worth_showing(entry) ? entry.seconds : 0.0;
  if (!(total > 0.0)) return {};

  std::string bar;
  std::string legend;
  int index = 0;
  for (const TimingEntry& entry : data.timing) {
    if (!worth_showing(entry)) continue;
    const double share = 100.0 * entry.seconds / total;
    const std::string colour = fmt::format("t{}", index++ % kColours);
    bar += fmt::format("<span class=\"{}\" style=\"width:{:.2f}%\" title=\"{}: {}\"></span>",
                       colour, share, escaped(entry.name), duration(entry.seconds));
    legend += fmt::format(
        "<li><i class=\"{}\"></i>{} <b>{}</b> <span class=\"quiet\">{:.0f} %</span></li>\n", colour,
        escaped(entry.name), duration(entry.seconds), share);
  }
  return fmt::format(
      "<div class=\"timebar\">{}</div>\n<ul class=\"legend\">\n{}<li class=\"total\">together "
      "<b>{}</b></li>\n</ul>\n",
      bar, legend, duration(total));
}

}  // namespace gonio::report
