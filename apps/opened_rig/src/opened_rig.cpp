#include "gonio/opened_rig/opened_rig.h"

#include <fmt/format.h>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/setup/simulated_rig.h"
#include "gonio/sim/sim_goniometer.h"

namespace gonio::cli {
namespace {

constexpr double kPlateAlbedo = 0.5;

class SimulatedRig final : public OpenedRig {
 public:
  explicit SimulatedRig(const sim::SimOptions& options)
      : world_(options),
        devices_(devices_of(world_)),
        // Another seed is another world, which no calibration of this one is good for.
        identity_(fmt::format("simulated, seed {}", options.seed)) {}

  const acquisition::DeviceSet& devices() override { return devices_; }
  void require_safe() override {
    for (devices::RotationStage* stage : devices_.stages) stage->stop();
    devices_.light->close_shutter();
  }
  std::vector<DeviceIdentity> identities() override {
    const devices::CameraInfo camera = world_.camera().info();
    std::vector<DeviceIdentity> all;
    for (const devices::RotationStage* stage : devices_.stages) {
      all.push_back({stage->name(), identity_});
    }
    all.push_back({world_.light_source().name(), identity_});
    all.push_back({world_.lamp_monitor().name(), identity_});
    all.push_back({world_.camera().name(), camera.model + " " + camera.serial});
    return all;
  }

 private:
  sim::SimGoniometer world_;
  acquisition::DeviceSet devices_;
  std::string identity_;
};

}  // namespace

std::map<std::string, std::string> serials_of(OpenedRig& rig) {
  std::map<std::string, std::string> serials;
  for (const DeviceIdentity& each : rig.identities()) serials[each.device] = each.identity;
  return serials;
}

std::unique_ptr<OpenedRig> open_simulated_rig(const sim::SimOptions& world) {
  return std::make_unique<SimulatedRig>(world);
}

std::unique_ptr<OpenedRig> open_rig(const RigFile& rig, Parts parts, const std::stop_token& stop,
                                    std::uint64_t seed) {
  if (rig.driver == RigFile::Driver::hardware) return open_hardware_rig(rig, parts, stop);
  const auto plate = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(kPlateAlbedo));
  return open_simulated_rig(simulated_world(rig, plate, seed));
}

}  // namespace gonio::cli
