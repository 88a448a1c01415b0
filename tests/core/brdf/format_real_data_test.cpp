#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "albedo_quadrature.h"
#include "gonio/brdf/material_file.h"
#include "gonio/brdf/rgl_file.h"

namespace gonio::brdf {
namespace {

namespace fs = std::filesystem;

/// Files of a folder of GONIO_FORMAT_DATA, which holds rgl/*.bsdf and cornell/*.brdf.
std::vector<fs::path> files_of(const char* folder) {
  std::vector<fs::path> files;
  const char* root = std::getenv("GONIO_FORMAT_DATA");
  if (root == nullptr) return files;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(fs::path(root) / folder, missing)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(RglRealData, IsReciprocalAsReadAndUnderNoOtherConvention) {
  const std::vector<fs::path> files = files_of("rgl");
  if (files.empty()) GTEST_SKIP() << "GONIO_FORMAT_DATA names no folder with rgl/*.bsdf";
  for (const fs::path& file : files) {
    const auto report = check_file_conventions(file);
    ASSERT_TRUE(report.has_value());
    RecordProperty(file.stem().string(), report->text());
    std::printf("%s: %s\n", file.stem().c_str(), report->text().c_str());
    // Flakes and steep lobes, seen by a camera and lamp of finite size, differ most both ways
    // round.
    EXPECT_LT(report->as_read, 0.25) << file;
    EXPECT_EQ(report->warning(), "") << file;
  }
}

TEST(RglRealData, ReflectsNoMoreThanItReceives) {
  const std::vector<fs::path> files = files_of("rgl");
  if (files.empty()) GTEST_SKIP() << "GONIO_FORMAT_DATA names no folder with rgl/*.bsdf";
  for (const fs::path& file : files) {
    const RglBrdf brdf(read_rgl(file));
    for (const double theta_i : {10.0, 40.0, 60.0}) {
      const Rgb albedo = testing::directional_albedo(brdf, Angle::from_degrees(theta_i));
      std::printf("%s: albedo at %2.0f deg %.3f %.3f %.3f\n", file.stem().c_str(), theta_i,
                  albedo[0], albedo[1], albedo[2]);
      // A few percent of calibration.
      EXPECT_LT(albedo.maxCoeff(), 1.05) << file;
      EXPECT_GT(albedo.maxCoeff(), 0.02) << file;
    }
  }
}

TEST(CornellRealData, CoversTheLatticeAndIsReciprocalAsRead) {
  const std::vector<fs::path> files = files_of("cornell");
  if (files.empty()) GTEST_SKIP() << "GONIO_FORMAT_DATA names no folder with cornell/*.brdf";
  for (const fs::path& file : files) {
    const auto report = check_file_conventions(file);
    std::printf("%s: %s\n", file.stem().c_str(), report->text().c_str());
    EXPECT_LT(report->as_read, 0.1) << file;
    EXPECT_EQ(report->warning(), "") << file;
    const BrdfTable table = read_material(file);
    std::size_t valid = 0;
    for (const std::uint32_t cell : lattice::cells_above_horizon()) valid += table.valid(cell);
    // A training material may lack a fifth.
    EXPECT_GT(valid, lattice::cells_above_horizon().size() * 4 / 5) << file;
  }
}

}  // namespace
}  // namespace gonio::brdf
