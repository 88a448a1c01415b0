#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/guarded_devices.h"
#include "gonio/calibration/radiometry/white_view.h"
#include "gonio/calibration/routine/settings.h"
#include "gonio/instrument/instrument.h"

namespace gonio::calibration::routine {

/// Mean of frames of one scene and exposure, less the mean of as many with the shutter closed.
struct Picture {
  int width_px = 0;
  int height_px = 0;
  double exposure_s = 0.0;
  int frames = 1;
  double monitor = 1.0;
  std::vector<float> signal_dn;  ///< row-major
  /// Not 0 where a lit frame was saturated: the mean is a bound there. Row-major.
  std::vector<std::uint8_t> saturated;
};

/// A square of the sample plane about its origin.
struct Square {
  double half_width_mm = 0.0;
  int parts = 1;  ///< along an edge: parts x parts values
};

/// Devices with what is known of the instrument: the moves and looks that steps are made of.
///
/// Threads  One.
/// Errors   devices::DeviceError; StepRefused when a look shows nothing that can be used.
class Bench {
 public:
  using Tell = std::function<void(const std::string& what, double fraction)>;

  /// All that is passed by reference must outlive it. `instrument` is what is known by now.
  Bench(acquisition::GuardedDevices& devices, const instrument::Instrument& instrument,
        const RoutineSettings& settings, Tell tell);

  acquisition::GuardedDevices& devices() { return devices_; }
  const instrument::Instrument& instrument() const { return instrument_; }
  const RoutineSettings& settings() const { return settings_; }
  /// As instrument::bad_pixel_mask().
  const std::vector<std::uint8_t>& bad_pixels() const { return bad_pixels_; }

  /// Index of an axis by name.
  std::size_t axis(const std::string& name) const;
  /// LA-2's; other axes stay at home.
  rig::Joints joints(Angle lamp_arm, Angle azimuth, Angle tilt) const;
  bool allowed(const rig::Joints& joints) const;
  /// Returns what the encoders read there.
  rig::Joints go(const rig::Joints& joints);

  const std::vector<devices::LightChannel>& channels() const { return channels_; }
  /// The channel that geometry is looked at in: the green one, or the only one.
  const std::string& main_channel() const;
  void light(const std::string& channel) { devices_.light(channel); }

  devices::Frame frame(std::chrono::nanoseconds exposure) { return devices_.capture(exposure); }
  /// Exposure at which the brightest pixels come to `level` (0 to 1) of saturation above black.
  /// Throws StepRefused: saturated in the shortest, or dark in the longest.
  std::chrono::nanoseconds exposure_for(double level);
  /// Lit frames, and as many dark ones of the same exposure; the channel stays lit.
  Picture picture(const std::string& channel, std::chrono::nanoseconds exposure, int frames);

  /// Pixel of the sample's origin in a pose.
  Eigen::Vector2d middle(const rig::Joints& joints) const;
  bool inside(const Eigen::Vector2d& pixel, double margin_px) const;
  double saturation_dn() const { return instrument_.sensor.saturation_dn; }

  /// Means over parts of a square of the sample plane, sensor's bend and shutter offset taken off.
  /// Bad pixels are left out, and saturated ones that are too few to be the target's own light.
  /// Parts that are not wholly in the picture, lit and seen under less than 80 deg are left out.
  std::vector<PixelSignal> signals(const Picture& picture, const rig::Joints& joints,
                                   const Square& square) const;
  /// One value: of a square about a point of the sample plane; none where it is not seen.
  std::optional<PixelSignal> signal_at(const Picture& picture, const rig::Joints& joints,
                                       const Eigen::Vector2d& centre_mm,
                                       double half_width_mm) const;

  /// DN/s of the linear signal within a circle, above what surrounds it (from there to 1.5 times
  /// its radius). The mean of their neighbours stands for bad pixels.
  double light_within(const Picture& picture, const Eigen::Vector2d& centre_px,
                      double radius_px) const;

  void tell(const std::string& what, std::size_t done, std::size_t all) const;

 private:
  acquisition::GuardedDevices& devices_;
  const instrument::Instrument& instrument_;
  const RoutineSettings& settings_;
  std::vector<std::uint8_t> bad_pixels_;
  Tell tell_;
  std::vector<devices::LightChannel> channels_;
  std::chrono::nanoseconds last_exposure_;
};

}  // namespace gonio::calibration::routine
