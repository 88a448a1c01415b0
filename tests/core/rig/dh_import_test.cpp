#include "gonio/rig/dh_import.h"

#include <gtest/gtest.h>

#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using test::deg;

constexpr double kRounding_mm = 1e-9;  // of lengths near 1 m

DhRow row(double a, double alpha_deg, double d, double theta_deg, std::size_t axis) {
  DhRow result;
  result.a_mm = a;
  result.alpha = deg(alpha_deg);
  result.d_mm = d;
  result.theta = deg(theta_deg);
  result.axis = axis;
  return result;
}

RigDescription rig_of(const Chain& chain, std::size_t axes) {
  RigDescription rig = la2();
  rig.axes.clear();
  for (std::size_t i = 0; i < axes; ++i) {
    Axis axis;
    axis.name = "q" + std::to_string(i);
    axis.min = deg(-360.0);
    axis.max = deg(360.0);
    rig.axes.push_back(axis);
  }
  rig.camera = rig.lamp = Chain{};
  rig.sample = chain;
  return rig;
}

Eigen::Isometry3d tip(const Chain& chain, const Joints& q) {
  return forward(rig_of(chain, q.size()), q).world_from_sample;
}

/// The link matrices as the conventions' textbooks print them, all sixteen numbers.
Eigen::Matrix4d printed_link(const DhRow& r, Angle joint, DhConvention convention) {
  const double ct = cos(r.theta + joint);
  const double st = sin(r.theta + joint);
  const double ca = cos(r.alpha);
  const double sa = sin(r.alpha);
  Eigen::Matrix4d m;
  if (convention == DhConvention::classic) {
    m << ct, -st * ca, st * sa, r.a_mm * ct, st, ct * ca, -ct * sa, r.a_mm * st, 0, sa, ca, r.d_mm,
        0, 0, 0, 1;
  } else {
    m << ct, -st, 0, r.a_mm, st * ca, ct * ca, -sa, -r.d_mm * sa, st * sa, ct * sa, ca, r.d_mm * ca,
        0, 0, 0, 1;
  }
  return m;
}

TEST(DhImport, PlanarArmReachesWhereItShould) {
  const Chain chain =
      chain_from_dh({row(300, 0, 0, 0, 0), row(200, 0, 0, 0, 1)}, DhConvention::classic);
  const Eigen::Vector3d elbow_up = tip(chain, test::joints({90.0, -90.0})).translation();
  EXPECT_NEAR((elbow_up - Eigen::Vector3d(200.0, 300.0, 0.0)).norm(), 0.0, kRounding_mm);
}

TEST(DhImport, BothConventionsEqualTheirPrintedMatrices) {
  const std::vector<DhRow> rows{row(25, -90, 400, 10, 0), row(455, 5, 3, -90, 1),
                                row(35, -90, -7, 0, 2), row(0, 90, 420, 30, 3)};
  test::Random random(4);
  for (const DhConvention convention : {DhConvention::classic, DhConvention::modified}) {
    const Chain chain = chain_from_dh(rows, convention);
    for (int i = 0; i < 100; ++i) {
      Joints q;
      Eigen::Matrix4d expected = Eigen::Matrix4d::Identity();
      for (const DhRow& r : rows) {
        q.push_back(deg(random.uniform(-180.0, 180.0)));
        expected = expected * printed_link(r, q.back(), convention);
      }
      EXPECT_LT((tip(chain, q).matrix() - expected).cwiseAbs().maxCoeff(), kRounding_mm);
    }
  }
}

TEST(DhImport, KeepsBaseToolScaleOffsetAndSlides) {
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();
  base.translation() = Eigen::Vector3d(1.0, 2.0, 3.0);
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
  tool.translation() = Eigen::Vector3d(0.0, 0.0, 10.0);
  DhRow turn = row(100, 0, 0, 0, 0);
  turn.scale = -2.0;
  turn.offset = deg(10.0);
  DhRow slide = row(0, 0, 50, 0, 1);
  slide.lead_mm_per_turn = 5.0;
  const Chain chain = chain_from_dh({turn, slide}, DhConvention::classic, base, tool);
  // -2 * 50 + 10 = -90 deg; two turns of the screw lift by 10 mm.
  const Eigen::Vector3d end = tip(chain, test::joints({50.0, 720.0})).translation();
  EXPECT_NEAR((end - Eigen::Vector3d(1.0, -98.0, 73.0)).norm(), 0.0, kRounding_mm);
}

}  // namespace
}  // namespace gonio::rig
