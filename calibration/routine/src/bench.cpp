#include "bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/measurement_equation.h"
#include "gonio/instrument/pixel_counts.h"
#include "good_neighbours.h"

namespace gonio::calibration::routine {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kBrightest = 20;  // pixels: a lamp's image has more, stray hot ones are fewer
constexpr double kSaturated = 0.95;
constexpr double kTooDark_dn = 40.0;
constexpr int kMaxTries = 12;
constexpr double kGrazing_cos = 0.1736;  // 80 deg
// Of a square: fewer saturated pixels are hot ones that no map knows, more are too much light.
constexpr double kStraySaturated = 0.02;

double seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

/// Of the brightest pixels, the dimmest.
double brightness(const devices::Frame& frame, const std::vector<std::uint8_t>& bad) {
  const std::size_t nth = std::min(kBrightest, frame.pixels_dn.size() - 1);
  if (bad.size() != frame.pixels_dn.size()) {
    return instrument::PixelCounts(frame.pixels_dn).nth_largest(nth);
  }
  std::vector<std::uint16_t> pixels = frame.pixels_dn;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (bad[i] != 0) pixels[i] = 0;
  }
  return instrument::PixelCounts(pixels).nth_largest(nth);
}

}  // namespace

Bench::Bench(acquisition::GuardedDevices& devices, const instrument::Instrument& instrument,
             const RoutineSettings& settings, Tell tell)
    : devices_(devices),
      instrument_(instrument),
      settings_(settings),
      bad_pixels_(instrument::bad_pixel_mask(instrument.sensor, instrument.camera.width_px,
                                             instrument.camera.height_px)),
      tell_(std::move(tell)),
      channels_(devices.devices().light->channels()),
      last_exposure_(settings.session.first_exposure) {}

std::size_t Bench::axis(const std::string& name) const {
  const auto& axes = instrument_.rig.axes;
  const auto found =
      std::find_if(axes.begin(), axes.end(), [&](const rig::Axis& a) { return a.name == name; });
  if (found == axes.end()) {
    throw StepRefused(
        fmt::format("rig: found no axis {}, expected lamp_arm, azimuth and tilt: calibration needs "
                    "a rig of type la2",
                    name));
  }
  return static_cast<std::size_t>(found - axes.begin());
}

rig::Joints Bench::joints(Angle lamp_arm, Angle azimuth, Angle tilt) const {
  rig::Joints joints = instrument_.rig.home();
  joints[axis("lamp_arm")] = lamp_arm;
  joints[axis("azimuth")] = azimuth;
  joints[axis("tilt")] = tilt;
  return joints;
}

bool Bench::allowed(const rig::Joints& joints) const {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const rig::Axis& axis = instrument_.rig.axes[i];
    if (joints[i] - axis.approach_overshoot < axis.min || axis.max < joints[i]) return false;
  }
  return true;
}

rig::Joints Bench::go(const rig::Joints& joints) { return devices_.move_to(joints); }

const std::string& Bench::main_channel() const {
  const auto green = std::find_if(channels_.begin(), channels_.end(),
                                  [](const devices::LightChannel& c) { return c.name == "G"; });
  return green == channels_.end() ? channels_.at(0).name : green->name;
}

nanoseconds Bench::exposure_for(double level) {
  const devices::CameraInfo camera = devices_.devices().camera->info();
  const double black = instrument_.sensor.black_level_dn;
  const double room = saturation_dn() - black;
  const nanoseconds longest = std::min(camera.max_exposure, settings_.session.max_exposure);
  nanoseconds exposure = std::clamp(last_exposure_, camera.min_exposure, longest);
  for (int attempt = 0; attempt < kMaxTries; ++attempt) {
    const double bright = brightness(frame(exposure), bad_pixels_) - black;
    const bool saturated = bright > kSaturated * room;
    double factor = level * room / std::max(bright, 1.0);
    if (saturated) {
      if (exposure <= camera.min_exposure) {
        throw StepRefused(fmt::format(
            "found saturated pixels even in {:.3g} ms, the camera's shortest exposure: dim the "
            "lamp, or put a filter on",
            1e3 * seconds(exposure)));
      }
      factor = 0.2;
    } else if (bright < kTooDark_dn) {
      if (exposure >= longest) {
        throw StepRefused(fmt::format(
            "found {:.0f} DN above black in {:.3g} s, expected light: is the lamp on and the right "
            "target in the holder?",
            bright, seconds(exposure)));
      }
      factor = 8.0;
    } else if (factor > 0.8 && factor < 1.25) {
      last_exposure_ = exposure;
      return exposure;
    }
    const auto next = nanoseconds(static_cast<std::int64_t>(
        std::llround(static_cast<double>(exposure.count()) * std::min(factor, 16.0))));
    const nanoseconds clamped = std::clamp(next, camera.min_exposure, longest);
    if (clamped == exposure) {
      last_exposure_ = exposure;
      return exposure;  // as near as the camera gets
    }
    exposure = clamped;
  }
  throw StepRefused("found light that changes from frame to frame, expected a steady lamp");
}

Picture Bench::picture(const std::string& channel, nanoseconds exposure, int frames) {
  Picture picture;
  picture.frames = frames;
  std::vector<double> sum;
  const auto add = [&](double sign) {
    for (int i = 0; i < frames; ++i) {
      const devices::Frame taken = frame(exposure);
      sum.resize(taken.pixels_dn.size(), 0.0);
      picture.saturated.resize(sum.size(), 0);
      for (std::size_t p = 0; p < sum.size(); ++p) {
        sum[p] += sign * taken.pixels_dn[p];
        if (taken.pixels_dn[p] >= taken.saturation_level_dn) picture.saturated[p] = 1;
      }
      picture.width_px = taken.width_px;
      picture.height_px = taken.height_px;
      picture.exposure_s = seconds(taken.exposure);
    }
  };
  light(channel);
  const bool watched = devices_.devices().monitor != nullptr;
  double monitor = watched ? devices_.read_monitor() : 1.0;
  add(1.0);
  if (watched) monitor = 0.5 * (monitor + devices_.read_monitor());
  picture.monitor = monitor;
  devices_.close_shutter();
  add(-1.0);
  light(channel);
  picture.signal_dn.reserve(sum.size());
  for (const double value : sum) {
    picture.signal_dn.push_back(static_cast<float>(value / frames));
  }
  return picture;
}

Eigen::Vector2d Bench::middle(const rig::Joints& joints) const {
  const auto pixel = instrument::pixel_of_point(instrument_, rig::forward(instrument_.rig, joints),
                                                Eigen::Vector3d::Zero());
  if (!pixel) throw std::logic_error("the rig's centre lies behind its camera");
  return *pixel;
}

bool Bench::inside(const Eigen::Vector2d& pixel, double margin_px) const {
  return pixel.x() >= margin_px && pixel.y() >= margin_px &&
         pixel.x() <= instrument_.camera.width_px - 1 - margin_px &&
         pixel.y() <= instrument_.camera.height_px - 1 - margin_px;
}

std::optional<PixelSignal> Bench::signal_at(const Picture& picture, const rig::Joints& joints,
                                            const Eigen::Vector2d& centre_mm,
                                            double half_width_mm) const {
  const rig::RigPose pose = rig::forward(instrument_.rig, joints);
  const auto directions = pose.directions_at({centre_mm.x(), centre_mm.y(), 0.0});
  if (directions.wi.z() < kGrazing_cos || directions.wo.z() < kGrazing_cos) return std::nullopt;
  std::array<Eigen::Vector2d, 4> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d point(centre_mm.x() + ((i & 1U) != 0 ? 1 : -1) * half_width_mm,
                                centre_mm.y() + ((i & 2U) != 0 ? 1 : -1) * half_width_mm, 0.0);
    const auto pixel = instrument::pixel_of_point(instrument_, pose, point);
    if (!pixel || !inside(*pixel, 2.0)) return std::nullopt;
    corners[i] = *pixel;
  }
  // The four-sided image of the square, corners in this order around it.
  constexpr std::array<std::size_t, 4> around{0, 1, 3, 2};
  Eigen::Vector2d low = corners[0];
  Eigen::Vector2d high = corners[0];
  for (const Eigen::Vector2d& corner : corners) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  struct Sums {
    double signal = 0.0;
    double columns = 0.0;
    double rows = 0.0;
    double count = 0.0;
  };
  std::array<Sums, 2> sums;  // of pixels with a value, and of saturated ones
  for (int row = static_cast<int>(std::ceil(low.y())); row <= high.y(); ++row) {
    for (int column = static_cast<int>(std::ceil(low.x())); column <= high.x(); ++column) {
      const Eigen::Vector2d here(column, row);
      int left = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector2d a = corners[around[i]];
        const Eigen::Vector2d b = corners[around[(i + 1) % 4]];
        const Eigen::Vector2d edge = b - a;
        const Eigen::Vector2d to = here - a;
        left += edge.x() * to.y() - edge.y() * to.x() >= 0.0 ? 1 : 0;
      }
      if (left != 0 && left != 4) continue;
      const std::size_t index =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width_px) +
          static_cast<std::size_t>(column);
      if (bad_pixels_[index] != 0) continue;
      Sums& of = sums[picture.saturated[index] != 0 ? 1 : 0];
      of.signal += instrument_.sensor.response.linear_dn(picture.signal_dn[index]);
      of.columns += column;
      of.rows += row;
      of.count += 1.0;
    }
  }
  auto& [all, saturated] = sums;
  if (saturated.count > kStraySaturated * (all.count + saturated.count)) {
    all.signal += saturated.signal;
    all.columns += saturated.columns;
    all.rows += saturated.rows;
    all.count += saturated.count;
  }
  if (all.count == 0.0) return std::nullopt;
  const double n = all.count;
  const instrument::SensorModel& sensor = instrument_.sensor;
  const double exposed_s = picture.exposure_s + sensor.shutter_offset_s;
  const double mean = all.signal / n;
  const double read_dn = sensor.gain_dn_per_e * sensor.read_noise_e;
  const double temporal =
      (sensor.gain_dn_per_e * std::max(mean, 0.0) + 2.0 * read_dn * read_dn) / picture.frames;
  const double pattern = sensor.prnu * mean;
  return PixelSignal{all.columns / n, all.rows / n, mean / exposed_s,
                     std::sqrt((temporal + pattern * pattern) / n) / exposed_s};
}

std::vector<PixelSignal> Bench::signals(const Picture& picture, const rig::Joints& joints,
                                        const Square& square) const {
  std::vector<PixelSignal> found;
  const double half = square.half_width_mm / square.parts;
  for (int j = 0; j < square.parts; ++j) {
    for (int i = 0; i < square.parts; ++i) {
      const Eigen::Vector2d centre((2 * i + 1 - square.parts) * half,
                                   (2 * j + 1 - square.parts) * half);
      if (const auto signal = signal_at(picture, joints, centre, half)) found.push_back(*signal);
    }
  }
  return found;
}

double Bench::light_within(const Picture& picture, const Eigen::Vector2d& centre_px,
                           double radius_px) const {
  const double outer = 1.5 * radius_px;
  const PixelMap map{picture.width_px, picture.height_px, bad_pixels_};
  const auto linear = [&](int row, int column) {
    return instrument_.sensor.response.linear_dn(picture.signal_dn[map.index(row, column)]);
  };
  double inside = 0.0, around = 0.0, pixels_inside = 0.0, pixels_around = 0.0;
  const int top = std::max(0, static_cast<int>(std::ceil(centre_px.y() - outer)));
  const int left = std::max(0, static_cast<int>(std::ceil(centre_px.x() - outer)));
  for (int row = top; row < picture.height_px && row <= centre_px.y() + outer; ++row) {
    for (int column = left; column < picture.width_px && column <= centre_px.x() + outer;
         ++column) {
      const double distance = (Eigen::Vector2d(column, row) - centre_px).norm();
      if (distance > outer) continue;
      const std::optional<double> signal = map.is_bad(row, column)
                                               ? mean_of_neighbours(map, row, column, linear)
                                               : linear(row, column);
      if (!signal) continue;
      (distance <= radius_px ? inside : around) += *signal;
      (distance <= radius_px ? pixels_inside : pixels_around) += 1.0;
    }
  }
  const double background = pixels_around > 0.0 ? around / pixels_around : 0.0;
  return (inside - pixels_inside * background) /
         (picture.exposure_s + instrument_.sensor.shutter_offset_s);
}

void Bench::tell(const std::string& what, std::size_t done, std::size_t all) const {
  tell_(fmt::format("{} {} of {}", what, done + 1, all),
        static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(all, 1)));
}

}  // namespace gonio::calibration::routine
