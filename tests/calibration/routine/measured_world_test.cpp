// Sessions on the world that was calibrated, with what was found: the BRDFs that come out against
// the materials that were there.

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "finished_run.h"
#include "gauge.h"
#include "gonio/brdf/builtin_materials.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/calibration/routine/sample_alignment.h"
#include "gonio/instrument/alignment.h"
#include "hidden_bench.h"
#include "recovery.h"
#include "simulated_session.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine {
namespace {

const Angle kTiltX = Angle::from_degrees(0.2);
const Angle kTiltY = Angle::from_degrees(-0.224);  // 0.3 deg together

/// Ground steel: a lobe of m = 0.105 beside a broad one.
sim::SimOptions leaning_steel() {
  sim::SimOptions world = test::another_day();
  world.scene.sample = brdf::builtin_material("steel-ground").model;
  world.sample_mount = {kTiltX, kTiltY, 0.0};
  return world;
}

instrument::Instrument aligned_to_steel() {
  const sim::SimOptions world = leaning_steel();
  const Routine routine = test::reopened(test::finished_run());
  test::HiddenBench bench(world);
  const geometry::MountNormal found =
      align_sample(bench.devices, routine.instrument(), routine.settings(), {}, {}).normal;
  instrument::Alignment alignment{found.tilt_x, found.tilt_y, found.covariance,
                                  "highlight",  "",           ""};
  alignment.instrument_sha256.assign(64, '0');
  return instrument::aligned(routine.instrument(), alignment);
}

/// The calibrated instrument as it is when the steel is mounted, found once.
const instrument::Instrument& known_with_steel() {
  static const instrument::Instrument known = aligned_to_steel();
  return known;
}

/// One channel of one spot.
struct Spot {
  Angle theta_h;
  Angle steepest;  ///< the larger of theta_i and theta_o
  double off;      ///< relative
};

std::vector<Spot> measured(const sim::SimOptions& options, const instrument::Instrument& known,
                           const std::vector<std::array<double, 3>>& directions_deg) {
  const TemporaryFolder folder;
  const std::filesystem::path session = folder.path() / "session";
  sim::SimGoniometer world(options);
  acquisition::SessionOptions how;
  how.relative_sigma = 0.001;
  {
    acquisition::SessionWriter archive(session, {}, {});
    acquisition::run_session(devices_of(world), known, plan_of(known, directions_deg), how,
                             archive);
  }
  const auto reduction = acquisition::reduce(acquisition::SessionReader(session), known);
  std::vector<Spot> spots;
  for (const samples::Sample& sample : reduction.samples.samples) {
    const brdf::DirectionPair directions = brdf::directions_from_half_diff(sample.direction);
    const brdf::Rgb off = sample.value_per_sr / options.scene.sample->evaluate(directions) - 1.0;
    const Angle steepest =
        Angle::from_radians(std::acos(std::min(directions.wi.z(), directions.wo.z())));
    for (int channel = 0; channel < 3; ++channel) {
      spots.push_back({sample.direction.theta_h, steepest, off[channel]});
    }
  }
  return spots;
}

TEST(CalibratedWorld, IsFoundWithinTheLimits) {
  const test::FinishedRun& run = test::finished_run();
  constexpr double kAnglesAtAQuarter = 3.0;
  for (const test::Recovered& each :
       test::recovered(test::reopened(run), run.truth, kAnglesAtAQuarter)) {
    EXPECT_LT(std::abs(each.error), each.limit) << each.name << " " << each.unit;
  }
  EXPECT_TRUE(std::filesystem::exists(run.folder.instrument()));
}

TEST(CalibratedWorld, FindsHowASampleLeansToATwentiethOfThat) {
  const sim::SimOptions world = leaning_steel();
  const rig::Joints readings(3);
  const Eigen::Vector3d in_mount =
      Eigen::AngleAxisd(kTiltX.radians(), Eigen::Vector3d::UnitX()) *
      (Eigen::AngleAxisd(kTiltY.radians(), Eigen::Vector3d::UnitY()) * Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d truth =
      calibration::test::gauge_from_world(world.rig).linear() *
      rig::forward(world.rig, test::true_joints(world, readings)).world_from_sample.linear() *
      in_mount;
  const Eigen::Vector3d found =
      rig::forward(known_with_steel().rig, readings).world_from_sample.linear().col(2);
  EXPECT_LT(Angle::from_radians(std::atan2(found.cross(truth).norm(), found.dot(truth))).degrees(),
            0.02);
}

TEST(CalibratedWorld, GivesALambertianPlateToOnePerCent) {
  sim::SimOptions world = test::another_day();
  world.scene.sample = std::make_shared<brdf::Lambertian>(brdf::Rgb(0.6, 0.4, 0.2));
  world.sample_mount = {};  // it lies on the datum, which is all that is known of a matte sample
  const auto spots = measured(world, test::reopened(test::finished_run()).instrument(),
                              {{3, 12, 28}, {20, 30, 45}, {5, 40, 90}, {10, 52, 80}});
  int looked_at = 0;
  for (const Spot& spot : spots) {
    if (spot.steepest.degrees() > 60.0) continue;
    ++looked_at;
    EXPECT_LT(std::abs(spot.off), 0.01) << spot.steepest.degrees() << " deg";
  }
  EXPECT_GT(looked_at, 200);
}

TEST(CalibratedWorld, GivesAGlossyMaterialToThreePerCentAboutItsHighlight) {
  const sim::SimOptions world = leaning_steel();
  std::vector<double> off;
  for (const Spot& spot :
       measured(world, known_with_steel(), {{2, 20, 90}, {5, 45, 60}, {10, 30, 30}, {4, 60, 90}})) {
    if (spot.theta_h.degrees() <= 15.0) off.push_back(std::abs(spot.off));
  }
  ASSERT_GT(off.size(), 200U);
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), middle, off.end());
  EXPECT_LT(*middle, 0.03);
}

}  // namespace
}  // namespace gonio::calibration::routine
