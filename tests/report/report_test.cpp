#include "gonio/report/report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "directions_deg.h"
#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"
#include "temporary_folder.h"

namespace gonio::report {
namespace {

constexpr const char* kHostile = "</title><script>alert(\"1\")</script>' onload='x & \xff\x01 end";

std::shared_ptr<const brdf::BrdfTable> table(const brdf::Rgb& colour, double gloss) {
  auto made = std::make_shared<brdf::BrdfTable>(brdf::IndexConvention::bin_centre,
                                                brdf::RadiometricScale::si);
  for (const std::uint32_t cell : brdf::lattice::cells_above_horizon()) {
    const int theta_h = brdf::lattice::index_from_cell(cell).theta_h;
    made->set_value(cell, colour / 3.0 + gloss * std::exp(-theta_h / 6.0));
  }
  return made;
}

/// A page with everything on it. Tables are made once: they are what takes time.
const ReportData& full_data() {
  static const ReportData data = [] {
    ReportData d;
    d.material = "blue-test-paint";
    d.summary = "Measured with care.";
    d.sphere_size = 64;
    d.truth = table({0.1, 0.2, 0.7}, 2.0);
    const auto found = table({0.12, 0.2, 0.66}, 1.8);
    d.methods.push_back(
        {"This measurement", "two poses", found, quality::compare(*d.truth, *found)});
    const auto worse = table({0.3, 0.3, 0.3}, 0.5);
    d.methods.push_back({"Another method", "", worse, quality::compare(*d.truth, *worse)});
    for (int pose = 0; pose < 2; ++pose) {
      d.poses.push_back(
          {pose, half_diff_deg(5.0 + 20.0 * pose, 30.0, 60.0), 'A', "Measured", 2.0, 1.0});
      for (int k = 0; k < 3; ++k) {
        FittedSample s;
        s.sample.direction = half_diff_deg(5.0 + 20.0 * pose + k, 30.0, 60.0);
        s.sample.pose = pose;
        s.sample.value_per_sr = brdf::Rgb(0.1, 0.2, 0.4);
        s.sample.sigma_per_sr = brdf::Rgb(0.01, 0.01, 0.02);
        s.fitted_per_sr = brdf::Rgb(0.11, 0.19, 0.41);
        s.standardised = brdf::Rgb(-1.0, 1.0, -0.5);
        d.samples.push_back(s);
      }
    }
    d.refused.push_back({half_diff_deg(2.84, 89.0, 15.0), "BELOW_HORIZON: theta_i 91.7 deg"});
    d.timing = {{"travel", 30.0}, {"exposure", 10.0}};
    d.checks = {{"Energy", CheckStatus::passed, "Largest albedo 0.7."}};
    d.warnings = {"white drifted by 0.4 %"};
    d.session = {{"Sample", "S-1"}};
    d.provenance = {{"created", "yesterday"}};
    return d;
  }();
  return data;
}

/// The tags of a page in order, with attributes; text, comments and style sheets are skipped.
/// Fails the test on a '<' that opens nothing known or is not closed.
std::vector<std::string> tags_of(const std::string& page) {
  std::vector<std::string> tags;
  std::size_t at = 0;
  while ((at = page.find('<', at)) != std::string::npos) {
    if (page.compare(at, 4, "<!--") == 0) {
      at = page.find("-->", at);
      if (at == std::string::npos) ADD_FAILURE() << "comment without end";
      if (at == std::string::npos) break;
      continue;
    }
    // Quoted values may hold '>'.
    char quote = 0;
    std::size_t end = at + 1;
    while (end < page.size() && (quote != 0 || page[end] != '>')) {
      if (quote != 0 && page[end] == quote) {
        quote = 0;
      } else if (quote == 0 && (page[end] == '"' || page[end] == '\'')) {
        quote = page[end];
      }
      ++end;
    }
    if (end == page.size()) {
      ADD_FAILURE() << "tag without end: " << page.substr(at, 60);
      break;
    }
    tags.push_back(page.substr(at + 1, end - at - 1));
    at = end;
    if (tags.back() == "style") at = page.find("</style", at);
  }
  return tags;
}

std::string name_of(const std::string& tag) {
  const std::size_t from = tag[0] == '/' ? 1 : 0;
  return tag.substr(from, tag.find_first_of(" /\n", from) - from);
}

void expect_well_formed(const std::string& page) {
  const std::set<std::string> without_end = {"!DOCTYPE", "meta", "img"};
  const std::set<std::string> known = {
      "html", "head", "title", "style",  "body",  "main",  "header",    "section", "h1",     "h2",
      "p",    "div",  "span",  "b",      "em",    "i",     "small",     "sub",     "figure", "ul",
      "li",   "dl",   "dt",    "dd",     "table", "thead", "tbody",     "tr",      "th",     "td",
      "svg",  "line", "path",  "circle", "rect",  "text",  "figcaption"};
  std::vector<std::string> open;
  for (const std::string& tag : tags_of(page)) {
    ASSERT_FALSE(tag.empty());
    const std::string name = name_of(tag);
    if (without_end.count(name) != 0) continue;
    ASSERT_EQ(known.count(name), 1u) << "unexpected <" << tag.substr(0, 60) << ">";
    if (tag[0] == '/') {
      ASSERT_FALSE(open.empty()) << "</" << name << "> closes nothing";
      ASSERT_EQ(open.back(), name) << "closed in the wrong order";
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(name);
    }
  }
  EXPECT_TRUE(open.empty()) << "left open: " << (open.empty() ? "" : open.back());
}

/// The page without its pictures: their base64 may spell anything, and a failed test prints it.
std::string readable(const ReportData& data) {
  std::string page = html(data);
  const std::string start = "base64,";
  for (std::size_t at = 0; (at = page.find(start, at)) != std::string::npos; ++at) {
    const std::size_t from = at + start.size();
    page.erase(from, page.find('"', from) - from);
  }
  return page;
}

bool has(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += what.size()) ++n;
  return n;
}

TEST(Report, IsWellFormed) { expect_well_formed(html(full_data())); }

TEST(Report, LoadsNothingFromElsewhere) {
  const std::string page = readable(full_data());
  for (const char* reference : {"http:", "https:", "//cdn", "<script", "<link", "@import", "url(",
                                "<iframe", "xmlns", "file:"}) {
    EXPECT_FALSE(has(page, reference)) << reference;
  }
  for (const std::string& tag : tags_of(page)) {
    if (name_of(tag) != "img") continue;
    EXPECT_EQ(count(tag, "src=\"data:image/png;base64,\""), 1u);
    EXPECT_EQ(count(tag, " alt=\""), 1u);
  }
}

TEST(Report, HoldsItsPicturesAsPng) {
  const std::string page = html(full_data());
  // "iVBORw0KGgo" is the PNG signature in base64 (RFC 4648).
  EXPECT_EQ(count(page, "src=\"data:image/png;base64,iVBORw0KGgo"), count(page, "<img "));
}

TEST(Report, ShowsEverySectionOfAFullMeasurement) {
  const std::string page = readable(full_data());
  for (const char* heading :
       {"How it looks", "How close it is", "Samples against the fit", "Where it was measured",
        "In the plane of incidence", "Checks and remarks", "Where the time went", "Session",
        "Provenance", "Other methods on the same material"}) {
    EXPECT_EQ(count(page, std::string(">") + heading + "</h2>"), 1u) << heading;
  }
  // Top; truth, result, difference under three lights; the scale; the other method's three.
  EXPECT_EQ(count(page, "<img "), 1u + 9u + 1u + 3u);
  // Six samples times three channels, above and in the residuals.
  EXPECT_EQ(count(page, "class=\"dot "), 36u);
  EXPECT_EQ(count(page, "class=\"err "), 18u);
  // Two poses on three figures.
  EXPECT_EQ(count(page, "class=\"pose "), 6u);
  EXPECT_TRUE(has(page, "40.0 s"));  // total time
  EXPECT_TRUE(has(page, "BELOW_HORIZON: theta_i 91.7 deg"));
  EXPECT_TRUE(has(page, "Complete, with remarks"));
}

TEST(Report, MarksTheBetterMethod) {
  const std::string page = readable(full_data());
  const std::size_t row = page.find("Weighted log RMSE");
  ASSERT_NE(row, std::string::npos);
  const std::string cells = page.substr(row, page.find("</tr>", row) - row);
  EXPECT_LT(cells.find("class=\"best\""), cells.rfind("<td"));  // the first column, ours
  EXPECT_EQ(count(cells, "class=\"best\""), 1u);
}

TEST(Report, LeavesOutWhatIsNotKnown) {
  ReportData data;
  data.material = "plate";
  data.sphere_size = 64;
  data.methods.push_back({"Result", "", full_data().methods.front().table, std::nullopt});
  const std::string page = readable(data);
  expect_well_formed(page);
  for (const char* heading : {"How close it is", "Samples against", "Where it was measured",
                              "Checks and remarks", "Where the time went", "Provenance</h2>"}) {
    EXPECT_FALSE(has(page, heading)) << heading;
  }
  EXPECT_EQ(count(page, "<img "), 4u);
  EXPECT_TRUE(has(page, "Complete"));
}

TEST(Report, EscapesEveryTextItIsGiven) {
  ReportData data = full_data();
  data.material = kHostile;
  data.summary = kHostile;
  data.methods[0].name = data.methods[1].name = data.methods[0].note = data.methods[1].note =
      kHostile;
  data.poses[0].outcome = kHostile;
  data.poses[0].branch = '<';
  data.refused[0].reason = kHostile;
  data.timing[0].name = kHostile;
  data.checks[0].name = data.checks[0].detail = kHostile;
  data.warnings[0] = kHostile;
  data.session[0] = data.provenance[0] = {kHostile, kHostile};
  data.samples[0].sample.flags = kHostile;
  const std::string page = readable(data);
  expect_well_formed(page);
  EXPECT_FALSE(has(page, "<script")) << "<script";
  EXPECT_FALSE(has(page, "\xff")) << "\xff";
  EXPECT_TRUE(has(page,
                  "&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt;&#39; onload=&#39;x "
                  "&amp; \xEF\xBF\xBD\xEF\xBF\xBD end"));
}

TEST(Report, SurvivesValuesThatAreNoNumbers) {
  ReportData data = full_data();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  data.samples[0].sample.value_per_sr = brdf::Rgb(nan, inf, -1.0);
  data.samples[0].sample.sigma_per_sr = brdf::Rgb(nan, inf, 0.0);
  data.samples[1].fitted_per_sr = brdf::Rgb(nan, 0.0, -inf);
  data.samples[2].standardised = brdf::Rgb(nan, inf, 1e9);
  data.timing[0].seconds = nan;
  data.methods[0].comparison->lighting_a.psnr_db = inf;
  data.methods[0].comparison->lattice.grazing_log_rmse = nan;
  const std::string page = readable(data);
  expect_well_formed(page);
  EXPECT_FALSE(std::regex_search(page, std::regex("\\b(nan|inf)\\b")));
  EXPECT_TRUE(has(page, "∞ dB"));
}

TEST(Report, DiffersOnlyInTheProvenanceBlockWhenOnlyThatDiffers) {
  ReportData later = full_data();
  later.provenance = {{"created", "today"}, {"host", "other"}};
  const auto without_block = [](const std::string& page) {
    const std::string begin = "<!-- provenance -->";
    const std::string end = "<!-- /provenance -->";
    EXPECT_EQ(count(page, begin), 1u);
    EXPECT_EQ(count(page, end), 1u);
    return page.substr(0, page.find(begin)) + page.substr(page.find(end));
  };
  const std::string first = html(full_data());
  const std::string second = html(later);
  EXPECT_TRUE(first != second);
  EXPECT_TRUE(without_block(first) == without_block(second));
}

TEST(Report, IsTheSameBytesWithOneThreadAndTwo) {
  parallel::set_thread_count(1);
  const std::string one = html(full_data());
  parallel::set_thread_count(2);
  const std::string two = html(full_data());
  parallel::set_thread_count(0);
  EXPECT_TRUE(one == two);  // not EXPECT_EQ: it would print megabytes
}

TEST(Report, SaysSoWhenACheckFailed) {
  ReportData data = full_data();
  data.checks.push_back({"Reciprocity", CheckStatus::failed, "pair 3 differs by 9 sigma"});
  EXPECT_TRUE(has(readable(data), "A check failed"));
  data = full_data();
  data.warnings.clear();
  EXPECT_TRUE(has(readable(data), "all checks passed"));
}

TEST(Report, RefusesToStartWithoutAResult) {
  ReportData data;
  EXPECT_THROW(html(data), std::invalid_argument);
  data = full_data();
  data.truth = std::make_shared<brdf::BrdfTable>(brdf::IndexConvention::bin_centre,
                                                 brdf::RadiometricScale::merl);
  EXPECT_THROW(html(data), std::invalid_argument);
}

TEST(Report, IsNotWrittenOverAnExistingFileUnlessTold) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "report.html";
  write_report(path, full_data());
  EXPECT_TRUE(read_bytes(path) == html(full_data()));
  EXPECT_THROW(write_report(path, full_data()), FileError);
  write_report(path, full_data(), files::Overwrite::Yes);
}

}  // namespace
}  // namespace gonio::report
