#pragma once

#include <optional>

#include "bench.h"
#include "highlight.h"

namespace gonio::calibration::routine {

/// The mirror on the cradle, with the lamp's image in it.
class MirrorSight {
 public:
  /// Mounts the mirror (turned or not), lights the main channel and sets the exposure where the
  /// image is expected. Throws StepRefused where there is none.
  MirrorSight(Bench& bench, bool turned);

  /// Joints at which the lamp's image comes to the rig's middle: nominal ones, and what they were
  /// found to be off by at the first look. Further off by two angles.
  rig::Joints bisecting(Angle lamp_arm, Angle azimuth_off = {}, Angle tilt_off = {}) const;

  /// None where the image is cut or out of sight.
  std::optional<Highlight> look();
  /// As look(), which has to find it. `where` is for the message.
  Highlight must_look(const std::string& where);

  devices::Frame frame() { return bench_.frame(exposure_); }
  double expected_radius_px() const { return radius_px_; }

 private:
  Bench& bench_;
  double radius_px_;
  std::chrono::nanoseconds exposure_{0};
  Angle azimuth_off_;
  Angle tilt_off_;
};

/// Of the lamp's image in a mirror or glass, for a lamp of usual size: a first guess.
double lamp_image_radius_px(const instrument::Instrument& instrument);

/// Where the image stands along its way as one axis turns, as an angle of that axis.
struct AxisScale {
  Eigen::Vector2d origin;
  Eigen::Vector2d px_per_deg;

  Angle angle(const Eigen::Vector2d& pixel) const {
    return Angle::from_degrees((pixel - origin).dot(px_per_deg) / px_per_deg.squaredNorm());
  }
};

}  // namespace gonio::calibration::routine
