#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/devices/target_changer.h"
#include "gonio/rig/kinematics.h"
#include "gonio/sim/sim_options.h"
#include "lens.h"
#include "pixel_contents.h"
#include "scene.h"

namespace gonio::sim {

/// Which of the bands R, G, B are asked for.
using Bands = std::array<bool, 3>;

/// What the lens would see of the scene under 1 W/sr in each band: planes (R, G, B) of radiance in
/// W m^-2 sr^-1, row-major, without falloff, ambient light, stray light and noise. Planes of bands
/// that nobody has asked for yet hold anything.
struct RadianceImage {
  std::array<std::vector<float>, 3> planes;
};

/// Renders radiance images; the last few are kept, because a bracket of exposures and three lamp
/// channels all look at one of them.
///
/// Threads  One.
class RadianceRenderer {
 public:
  explicit RadianceRenderer(const SimOptions& options);

  /// At true joint angles. The image stays valid as long as the pointer is held.
  std::shared_ptr<const RadianceImage> render(const rig::Joints& joints, devices::Target target,
                                              const Bands& bands);

  const Lens& lens() const { return lens_; }

  /// What is rendered: the target along rays in a pose.
  TargetView view(const rig::Joints& joints, devices::Target target) const;

  /// Radiance of a perfect white at the rig's centre under normal incidence, per W/sr.
  double white_radiance() const { return white_radiance_; }

 private:
  struct Entry {
    rig::Joints joints;
    devices::Target target;
    PixelContents contents;
    Bands done{};
    std::shared_ptr<RadianceImage> image;
  };

  /// The entry of a pose, made if there is none.
  Entry& entry_of(const rig::Joints& joints, devices::Target target);
  MountOptions mount_of(devices::Target target) const;

  SimOptions options_;
  Lens lens_;
  Scene scene_;
  double lamp_distance_mm_;
  double white_radiance_;
  std::vector<Entry> kept_;  ///< latest last
};

}  // namespace gonio::sim
