#include "gonio/calibration/routine/sample_alignment.h"

#include <gmock/gmock.h>

#include <memory>

#include "gonio/brdf/builtin_materials.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/sim/sim_goniometer.h"
#include "hidden_bench.h"

namespace gonio::calibration::routine {
namespace {

constexpr double kTiltX_deg = 0.2;
constexpr double kTiltY_deg = -0.224;  // 0.3 deg together

/// The rig as described, with a sample that leans.
sim::SimOptions leaning(std::shared_ptr<const brdf::BrdfModel> material) {
  sim::SimOptions options = sim::nominal_options(std::move(material), 1);
  options.sample_mount = {Angle::from_degrees(kTiltX_deg), Angle::from_degrees(kTiltY_deg), 0.0};
  return options;
}

SampleAlignment align(const sim::SimOptions& options) {
  test::HiddenBench bench(options);
  instrument::Instrument known = test::HiddenBench::nominal(sim::HiddenImage::small);
  const sim::CameraOptions& camera = options.camera;
  known.camera = {camera.width_px, camera.height_px, camera.fx_px,
                  camera.fy_px,    camera.cx_px,     camera.cy_px};
  known.lamp_field = {0.0, 0.0, options.lamp.field[2], 0.0, options.lamp.field[4]};
  return align_sample(bench.devices, known, {}, {}, {});
}

TEST(SampleAlignment, FindsHowAGlossySampleLeans) {
  const auto found = align(leaning(brdf::builtin_material("gold-satin").model)).normal;
  EXPECT_NEAR(found.tilt_x.degrees(), kTiltX_deg, 0.02);
  EXPECT_NEAR(found.tilt_y.degrees(), kTiltY_deg, 0.02);
}

TEST(SampleAlignment, RefusesAMatteSample) {
  EXPECT_THAT([] { align(leaning(std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5)))); },
              testing::ThrowsMessage<StepRefused>(testing::HasSubstr("expected a glossy sample")));
}

}  // namespace
}  // namespace gonio::calibration::routine
