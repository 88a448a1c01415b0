#include "demo_index.h"

#include <fmt/format.h>

namespace gonio::cli {
namespace {

/// In the look of the reports it leads to (apps/report/src/style.cpp), light and dark.
constexpr const char* kIndexHead = R"html(<!doctype html>
<html lang="en"><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>gonio demo</title>
<style>
:root{color-scheme:light dark;--paper:#f6f6f4;--card:#fff;--ink:#1b1e24;--quiet:#666d78;
--line:#e2e3e0;--accent:#0f6e84;--stage:#17191d}
@media (prefers-color-scheme:dark){:root{--paper:#101215;--card:#181b20;--ink:#e7e9ec;
--quiet:#979ea9;--line:#2a2e35;--accent:#5fc3d9;--stage:#0b0c0e}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1240px;padding:28px;background:var(--paper);color:var(--ink);
font:16px/1.55 system-ui,sans-serif;font-variant-numeric:tabular-nums}
section{background:var(--card);border:1px solid var(--line);border-radius:14px;padding:24px 26px;
margin:0 0 20px;overflow-x:auto}
h1{font-size:2.5rem;line-height:1.12;letter-spacing:-.022em;margin:0 0 .25em}
p{margin:.3em 0 .8em;max-width:76ch;color:var(--quiet)}
a{color:var(--accent);text-decoration:none}
a:hover{text-decoration:underline}
table{border-collapse:collapse;margin-top:1em}
td,th{padding:.4rem 1.6rem .4rem 0;text-align:right;border-bottom:1px solid var(--line)}
th{color:var(--quiet);font-size:.85rem;font-weight:500}
td:first-child,th:first-child{text-align:left}
tr:last-child td{border-bottom:0}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(340px,100%),1fr));gap:20px}
.cards a{background:var(--stage);border-radius:14px;padding:12px;display:block}
.cards img{width:100%;height:auto;display:block;border-radius:6px}
.cards span{display:block;padding:8px 4px 0;color:#9ad7e6}
</style>
<section><h1>gonio demo</h1>
<p>Built-in analytic materials on a simulated rig of which nothing is where its drawing has it: it was
<a href="calibration/report.html">calibrated</a> first, and each sample aligned. The whole family of each
material was left out of basis and design.</p>
<table><tr><th>Image PSNR in dB<th>patches<th>the same frames as points<th>published method</tr>
)html";

}  // namespace

std::string demo_index_page(const std::vector<DemoRow>& rows) {
  std::string text = kIndexHead;
  for (const DemoRow& row : rows) {
    text += fmt::format(
        "<tr><td><a "
        "href=\"{0}/report.html\">{0}</a><td><b>{1:.1f}</b><td>{2:.1f}<td>{3:.1f}</tr>\n",
        row.material, row.ours_db, row.points_db, row.published_db);
  }
  text += "</table></section>\n<div class=\"cards\">\n";
  for (const DemoRow& row : rows) {
    text += fmt::format(
        "<a href=\"{0}/report.html\"><img src=\"{0}/spheres.png\" alt=\"{0}, its reconstruction "
        "and the difference\"><span>Report of {0}</span></a>\n",
        row.material);
  }
  return text + "</div>\n</html>\n";
}

}  // namespace gonio::cli
