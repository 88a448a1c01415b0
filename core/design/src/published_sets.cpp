#include "gonio/design/published_sets.h"

#include <array>
#include <stdexcept>
#include <string>

namespace gonio::design {
namespace {

brdf::HalfDiff at(double theta_h_deg, double theta_d_deg, double phi_d_deg) {
  return {Angle::from_degrees(theta_h_deg), Angle::from_degrees(theta_d_deg),
          Angle::from_degrees(phi_d_deg), Angle()};
}

}  // namespace

std::span<const PublishedSet> published_sets() {
  static const std::array<PublishedSet, 4> sets = {{
      {"dtu-5",
       "DTU image analysis group, example of the release of Nielsen, Jensen, Ramamoorthi 2015 "
       "(positions their gantry reached), brdf.compute.dtu.dk",
       {at(1.4, 4.0, 36.2), at(76.7, 13.1, 86.5), at(7.6, 78.9, 85.5), at(2.5, 73.8, 144.8),
        at(12.9, 51.6, 80.4)}},
      {"nielsen-10",
       "Nielsen, Jensen, Ramamoorthi, \"On Optimal, Minimal BRDF Sampling for Reflectance "
       "Acquisition\", ACM TOG 34(6), 2015",
       {at(3, 12, 28), at(63, 19, 89), at(5, 77, 77), at(2, 60, 180), at(15, 4, 130), at(1, 6, 37),
        at(2, 79, 110), at(39, 76, 89), at(0, 71, 104), at(5, 75, 180)}},
      {"seed-report-10",
       "student report this project starts from: its own condition-number search",
       {at(4.01, 14, 16), at(69.3, 17, 151), at(8.1, 82, 48), at(2.84, 89, 15), at(17.77, 41, 92),
        at(0.9, 3, 33), at(1.87, 69, 145), at(26.67, 71, 56), at(0.01, 89, 59), at(1.87, 50, 70)}},
      {"near-field-2",
       "Xu, Nielsen, Yu, Jensen, Ramamoorthi, \"Minimal BRDF Sampling for Two-Shot Near-Field "
       "Reflectance Acquisition\", ACM TOG 35(6), 2016: centres of two shots with a 25 degree "
       "field of view",
       {at(6, 23, 41), at(16, 79, 87)}},
  }};
  return sets;
}

const PublishedSet& published_set(std::string_view name) {
  std::string known;
  for (const PublishedSet& set : published_sets()) {
    if (set.name == name) return set;
    known += known.empty() ? "" : ", ";
    known += set.name;
  }
  throw std::invalid_argument("no published directions called '" + std::string(name) +
                              "'; there are " + known);
}

}  // namespace gonio::design
