#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "gonio/brdf/brdf_table.h"
#include "gonio/render/difference.h"
#include "gonio/render/sphere_picture.h"
#include "page_parts.h"
#include "sections.h"

namespace gonio::report {
namespace {

using render::PictureLighting;

constexpr std::array<PictureLighting, 3> kLightings = {PictureLighting::studio, PictureLighting::a,
                                                       PictureLighting::b};

/// Pictures under one light: the reference first (truth, else the result), all exposed as it asks.
struct SphereRow {
  PictureLighting lighting;
  double exposure;
  std::vector<render::SpherePicture> pictures;

  render::Image shown(std::size_t i) const { return render::develop(pictures[i], exposure); }
  render::DifferencePicture difference(std::size_t i, double scale) const {
    return render::difference_picture(pictures[0], pictures[i], exposure, scale);
  }
};

std::string name_of(PictureLighting lighting) {
  std::string name(render::to_string(lighting));
  name[0] = static_cast<char>(name[0] - 'a' + 'A');
  return name;
}

std::vector<SphereRow> render_rows(const ReportData& data) {
  std::vector<brdf::TableBrdf> brdfs;
  brdfs.reserve(data.methods.size() + 1);
  if (data.truth) brdfs.emplace_back(*data.truth);
  for (std::size_t i = 0; i < data.methods.size(); ++i) {
    // Without a truth to hold them against, further methods are of no interest.
    if (data.methods[i].table && (i == 0 || data.truth)) brdfs.emplace_back(*data.methods[i].table);
  }
  std::vector<SphereRow> rows;
  for (const PictureLighting lighting : kLightings) {
    // Other methods only in the studio: the table of errors has the rest.
    const std::size_t count = lighting == PictureLighting::studio || !data.truth ? brdfs.size() : 2;
    std::vector<const brdf::BrdfModel*> models;
    for (std::size_t i = 0; i < count; ++i) models.push_back(&brdfs[i]);
    SphereRow row{lighting, 1.0, render::render_spheres(models, lighting, data.sphere_size)};
    row.exposure =
        render::picture_exposure(row.pictures[0], lighting, data.methods.front().table->scale());
    rows.push_back(std::move(row));
  }
  return rows;
}

/// One scale for the whole page, so that its pictures can be held against each other: the first
/// that most of every picture fits into.
double difference_scale(const std::vector<SphereRow>& rows) {
  double largest = 0.0;
  for (const SphereRow& row : rows) {
    for (std::size_t i = 1; i < row.pictures.size(); ++i) {
      largest = std::max(largest, row.difference(i, render::kDifferenceScale).p95_delta_e);
    }
  }
  for (const double scale : {3.0, 5.0, 10.0}) {
    if (largest <= scale) return scale;
  }
  return 20.0;
}

std::string figure(const render::Image& image, std::string_view alt, std::string_view title,
                   std::string_view remark) {
  return fmt::format("<figure>{}<figcaption><b>{}</b><span>{}</span></figcaption></figure>\n",
                     embedded_picture(image, alt), escaped(title), escaped(remark));
}

std::string difference_figure(const render::DifferencePicture& difference) {
  return figure(difference.image, "difference in false colour", "Difference",
                fmt::format("ΔE mean {:.2f}, 95 % below {:.1f}", difference.mean_delta_e,
                            difference.p95_delta_e));
}

std::string scale_line(double scale) {
  return fmt::format(
      "<div class=\"scale\"><span>0</span>{}<span>{:.0f} and more, CIEDE2000; 1 is just noticeable "
      "side by side</span></div>\n",
      embedded_picture(render::heat_bar(190, 11), "colour scale of the difference"), scale);
}

/// Further methods that have a table: what one gains over them.
std::string other_methods(const ReportData& data, const SphereRow& studio, double scale) {
  std::string figures;
  std::size_t at = 2;
  for (std::size_t i = 1; i < data.methods.size(); ++i) {
    if (!data.methods[i].table) continue;
    figures += figure(studio.shown(0), "sphere of the truth", "Truth", "Studio");
    figures += figure(studio.shown(at), "sphere of another method", data.methods[i].name,
                      data.methods[i].note);
    figures += difference_figure(studio.difference(at, scale));
    ++at;
  }
  if (figures.empty()) return {};
  return fmt::format(
      "<h2 class=\"inner\">Other methods on the same material</h2>\n"
      "<div class=\"spheres\">\n{}</div>\n",
      figures);
}

}  // namespace

SphereSection sphere_section(const ReportData& data) {
  const std::vector<SphereRow> rows = render_rows(data);
  const std::size_t ours = data.truth ? 1 : 0;
  std::string figures;
  std::string below;
  const double scale = difference_scale(rows);
  for (const SphereRow& row : rows) {
    const std::string lighting = name_of(row.lighting);
    if (!data.truth) {
      figures += figure(row.shown(ours), "sphere of the reconstruction", lighting, "");
      continue;
    }
    figures += figure(row.shown(0), "sphere of the truth", "Truth", lighting);
    figures += figure(row.shown(ours), "sphere of the reconstruction", "Reconstruction", lighting);
    figures += difference_figure(row.difference(ours, scale));
  }
  if (data.truth) below = scale_line(scale) + other_methods(data, rows.front(), scale);

  SphereSection result;
  result.hero_image = embedded_picture(rows.front().shown(ours), "sphere of the measured material");
  result.section = fmt::format(
      "<section>\n<h2>How it looks</h2>\n<p class=\"quiet\">A sphere of the material in a "
      "photographer’s studio, and under the two fixed lightings that image errors are quoted "
      "for.{}</p>\n<div class=\"spheres\">\n{}</div>\n{}</section>\n",
      data.truth ? " Each row is exposed as the truth asks." : "", figures, below);
  return result;
}

}  // namespace gonio::report
