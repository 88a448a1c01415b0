#include <gmock/gmock.h>

#include <chrono>
#include <memory>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/calibration/sensor/linearity.h"
#include "gonio/calibration/sensor/photon_transfer.h"
#include "gonio/sim/sim_goniometer.h"

namespace gonio::calibration::sensor {
namespace {

using namespace gonio::literals;
using namespace std::chrono_literals;

/// A matte white facing lamp and camera alike in the world of the demonstration.
class WhiteWorld {
 public:
  explicit WhiteWorld(const sim::SimOptions& options) : world_(options) {
    const std::vector<Angle> pose{60.0_deg, 30.0_deg, 0.0_deg};
    for (std::size_t axis = 0; axis < world_.axis_count(); ++axis) {
      world_.stage(axis).home(kPatience);
      world_.stage(axis).begin_move_to(pose[axis]);
      world_.stage(axis).wait_until_settled(kPatience);
    }
  }

  LevelStatistics dark_level(std::chrono::nanoseconds exposure) {
    world_.light_source().close_shutter();
    return level(exposure);
  }
  LevelStatistics lit_level(std::chrono::nanoseconds exposure) {
    world_.light_source().light("G");
    return level(exposure);
  }

 private:
  static constexpr std::chrono::milliseconds kPatience{600000};  // of virtual time

  LevelStatistics level(std::chrono::nanoseconds exposure) {
    const devices::Frame first = world_.camera().capture(exposure);
    const devices::Frame second = world_.camera().capture(exposure);
    const auto view = [](const devices::Frame& frame) {
      return FrameView{frame.pixels_dn, frame.width_px, frame.height_px,
                       std::chrono::duration<double>(frame.exposure).count()};
    };
    const LevelOptions options{.region = {96, 64, 128, 128, 1},
                               .saturation_dn = double(first.saturation_level_dn)};
    return level_statistics(view(first), view(second), options);
  }

  sim::SimGoniometer world_;
};

TEST(SimulatedCamera, GivesItsGainAndReadNoiseAway) {
  sim::SimOptions options =
      sim::nominal_options(std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.9)), 31);
  options.camera.nonlinearity = 0.003;
  options.camera.shutter_offset = 3us;
  WhiteWorld world(options);
  std::vector<LevelStatistics> dark;
  for (const auto exposure : {50us, 50us, 20000us, 45000us}) {
    dark.push_back(world.dark_level(exposure));
  }
  std::vector<LevelStatistics> levels;
  for (const auto exposure : {50us, 100us, 200us, 400us, 800us}) {
    levels.push_back(world.lit_level(exposure));
  }
  for (int k = 1; k <= 20; ++k) levels.push_back(world.lit_level(k * 3500us));

  const Linearity linearity = fit_linearity(dark, levels, {});
  EXPECT_TRUE(linearity.acceptance.passed());
  EXPECT_NEAR(linearity.shutter_offset_s.value, 3e-6, 1.5e-6);  // lamp drift of 0.2 % in 10 min
  const PhotonTransfer transfer =
      fit_photon_transfer(dark, levels, {.response = linearity.curve, .curved = false});
  EXPECT_NEAR(transfer.gain_dn_per_e.value / options.camera.dn_per_electron, 1.0, 0.02);  // 128^2
  EXPECT_NEAR(transfer.read_noise_e.value / options.camera.read_noise_e, 1.0, 0.05);
  ASSERT_TRUE(transfer.full_well_e.has_value());
  // The converter ends first: (4095 - 64) / 0.39.
  EXPECT_NEAR(transfer.full_well_e->value / 10336.0, 1.0, 0.03);
}

}  // namespace
}  // namespace gonio::calibration::sensor
