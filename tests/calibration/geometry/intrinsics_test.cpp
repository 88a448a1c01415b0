#include "gonio/calibration/geometry/intrinsics.h"

#include <gmock/gmock.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "gonio/calibration/result/step_refused.h"
#include "synthetic_board.h"

namespace gonio::calibration::geometry {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

struct Shots {
  instrument::CameraModel camera;
  std::vector<BoardView> views;
  IntrinsicsOptions options;
};

/// A board held into all corners of the image at slants up to `slant_deg`, 350 mm +- 15 % away.
Shots shots(std::uint64_t seed, test::Scale scale, int count = 24, double slant_deg = 40.0,
            double noise_px = 0.1) {
  random::Stream stream(random::make_key(seed, "intrinsics"));
  Shots result;
  result.camera = test::hidden_camera(stream, scale);
  result.options.width_px = result.camera.width_px;
  result.options.height_px = result.camera.height_px;
  for (int k = 0; k < count; ++k) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    const double towards_deg = 360.0 * stream.uniform();
    const double slant = slant_deg * std::sqrt(stream.uniform());
    const Eigen::Matrix3d in_plane = test::turn({0.0, 0.0, test::uniform(stream, 20.0)});
    const double rad = towards_deg * 3.14159265358979323846 / 180.0;
    pose.linear() = test::turn({slant * std::cos(rad), slant * std::sin(rad), 0.0}) * in_plane;
    const double z = 350.0 * (1.0 + test::uniform(stream, 0.15));
    const double x = test::uniform(stream, 35.0);
    const double y = test::uniform(stream, 25.0);
    pose.translation() = Eigen::Vector3d(x, y, z);
    result.views.push_back(test::seen_board(result.camera, pose, noise_px, stream));
  }
  return result;
}

/// Largest distance over the image between where two cameras see the same rays, after the turn of
/// the camera that a shifted principal point is traded for.
double largest_displacement(const instrument::CameraModel& found,
                            const instrument::CameraModel& truth) {
  std::vector<Eigen::Vector3d> a;
  std::vector<Eigen::Vector3d> b;
  Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
  for (int i = 0; i <= 10; ++i) {
    for (int j = 0; j <= 10; ++j) {
      const double column = 0.1 * i * (truth.width_px - 1);
      const double row = 0.1 * j * (truth.height_px - 1);
      a.push_back(found.ray(column, row));
      b.push_back(truth.ray(column, row));
      product += b.back() * a.back().transpose();
    }
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
  double largest = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    largest = std::max(largest, (turn * a[k] - b[k]).norm() * truth.fx_px);
  }
  return largest;
}

class IntrinsicsOfScale : public ::testing::TestWithParam<test::Scale> {};

TEST_P(IntrinsicsOfScale, FindTheHiddenCamera) {
  // Bars of the specification, 3.8; three times as much for angles at a quarter of the size.
  const double relax = GetParam() == test::Scale::Full ? 1.0 : 3.0;
  const Shots given = shots(7, GetParam());
  const Intrinsics found = fit_intrinsics(given.views, given.options);
  EXPECT_NEAR(found.camera.fx_px / given.camera.fx_px, 1.0, 0.001 * relax);
  EXPECT_NEAR(found.camera.fy_px / given.camera.fy_px, 1.0, 0.001 * relax);
  EXPECT_LT(largest_displacement(found.camera, given.camera), 0.3);
  EXPECT_NEAR(found.sigma_px, 0.1, 0.005);  // 3,800 coordinates
  EXPECT_NEAR(found.rms_px, 0.1 * std::sqrt(2.0), 0.01);
  EXPECT_EQ(found.camera.width_px, given.camera.width_px);
}
INSTANTIATE_TEST_SUITE_P(Scales, IntrinsicsOfScale,
                         ::testing::Values(test::Scale::Full, test::Scale::Quarter));

TEST(Intrinsics, StateTheirUncertainty) {
  test::Coverage coverage;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const Shots given = shots(1000 + seed, test::Scale::Quarter);
    const Intrinsics found = fit_intrinsics(given.views, given.options);
    const auto sigma = [&](Eigen::Index k) { return std::sqrt(found.covariance(k, k)); };
    coverage.count(found.camera.fx_px - given.camera.fx_px, sigma(0));
    coverage.count(found.camera.cx_px - given.camera.cx_px, sigma(2));
    coverage.count(found.camera.cy_px - given.camera.cy_px, sigma(3));
    coverage.count(found.camera.k1 - given.camera.k1, sigma(4));
    coverage.count(found.camera.p1 - given.camera.p1, sigma(6));
    coverage.count(found.camera.p2 - given.camera.p2, sigma(7));
  }
  RecordProperty("coverage", std::to_string(coverage.fraction()));
  EXPECT_GE(coverage.fraction(), 0.90);
  EXPECT_LE(coverage.fraction(), 0.99);
}

TEST(Intrinsics, LeaveOutABadView) {
  Shots given = shots(8, test::Scale::Full);
  random::Stream stream(random::make_key(8, "shake"));
  for (BoardCorner& corner : given.views[5].corners) {
    corner.pixel.x() += 2.0 * stream.normal();
    corner.pixel.y() += 2.0 * stream.normal();
  }
  const Intrinsics found = fit_intrinsics(given.views, given.options);
  EXPECT_FALSE(found.views[5].used);
  EXPECT_THAT(found.views[5].why_not, HasSubstr("px rms"));
  EXPECT_EQ(std::count_if(found.views.begin(), found.views.end(),
                          [](const FittedView& view) { return view.used; }),
            23);
  EXPECT_NEAR(found.camera.fx_px / given.camera.fx_px, 1.0, 0.001);
}

TEST(Intrinsics, LeaveOutViewsSlantedTooMuch) {
  const Shots given = shots(9, test::Scale::Full, 40, 58.0);
  const Intrinsics found = fit_intrinsics(given.views, given.options);
  bool any = false;
  for (const FittedView& view : found.views) {
    if (view.slant.degrees() > 45.5) {
      EXPECT_THAT(view.why_not, HasSubstr("slanted"));
    }
    if (view.slant.degrees() < 44.5) {
      EXPECT_TRUE(view.used);
    }
    any = any || !view.used;
  }
  EXPECT_TRUE(any);
}

TEST(Intrinsics, RefuseViewsThatAreAllAlike) {
  for (const double slant_deg : {0.0, 2.0, 6.0}) {
    const Shots given = shots(10, test::Scale::Quarter, 24, slant_deg);
    EXPECT_THAT([&] { fit_intrinsics(given.views, given.options); },
                ThrowsMessage<StepRefused>(
                    AllOf(HasSubstr("tilt the board by 20 to 40 deg"), Not(HasSubstr("\n")))))
        << slant_deg;
  }
}

TEST(Intrinsics, RefuseUnusableViewsInOneLine) {
  const Shots good = shots(11, test::Scale::Quarter);
  const auto refusal = [&](auto spoil, const char* why) {
    Shots given = good;
    spoil(given.views);
    EXPECT_THAT([&] { fit_intrinsics(given.views, given.options); },
                ThrowsMessage<StepRefused>(AllOf(HasSubstr(why), Not(HasSubstr("\n")))));
  };
  using Views = std::vector<BoardView>;
  refusal([](Views& views) { views.resize(5); }, "5 usable views of 5, expected at least 8");
  refusal([](Views& views) { views[2].corners.resize(7); }, "view 2 shows 7 corners");
  refusal([](Views& views) { views.clear(); }, "0 usable views");
  refusal(
      [](Views& views) {
        views[3].corners[4].pixel.y() = std::numeric_limits<double>::quiet_NaN();
      },
      "view 3 is not a number");
  refusal([](Views& views) { views[1].corners[4] = views[1].corners[9]; }, "given twice");
  refusal([](Views& views) { views[1].corners[4].pixel.x() = 9e9; }, "outside the image");
  refusal([](Views& views) { views[1].corners[4].point_mm.x() += 1.0; }, "another place");
  refusal(
      [](Views& views) {
        views[6].corners.resize(14);
        for (std::size_t k = 0; k < 14; ++k) {
          views[6].corners[k].point_mm = {8.0 * static_cast<double>(k), 0.0};
          views[6].corners[k].id = 1000 + static_cast<int>(k);
          views[6].corners[k].pixel = {20.0 + 30.0 * static_cast<double>(k), 50.0};
        }
      },
      "one line");
}

}  // namespace
}  // namespace gonio::calibration::geometry
