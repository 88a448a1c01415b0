#include "gonio/calibration/sensor/pixel_stack.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "gonio/calibration/result/step_refused.h"
#include "pixel_selection.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kStackStep = "frame stack";
constexpr int kMaxSide_px = 65536;
constexpr std::size_t kMaxFrames = 65536;  // 65536 * 65535 is what 32 bits hold
constexpr double kMaxSaturated = 0.01;

}  // namespace

PixelStack::PixelStack(int width_px, int height_px, double exposure_s, double saturation_dn)
    : width_px_(width_px),
      height_px_(height_px),
      exposure_s_(exposure_s),
      saturation_dn_(saturation_dn) {
  if (width_px < 1 || height_px < 1 || width_px > kMaxSide_px || height_px > kMaxSide_px) {
    throw std::invalid_argument(fmt::format("{}: size {} x {}, expected 1 to {}", kStackStep,
                                            width_px, height_px, kMaxSide_px));
  }
  if (!(exposure_s >= 0.0) || !std::isfinite(exposure_s)) {
    throw std::invalid_argument(
        fmt::format("{}: exposure {} s, expected 0 or more", kStackStep, exposure_s));
  }
  sum_.resize(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  sum_of_squares_.resize(sum_.size());
}

void PixelStack::add(const FrameView& frame) {
  check_frame(kStackStep, frame);
  if (frame.width_px != width_px_ || frame.height_px != height_px_) {
    throw StepRefused(fmt::format(
        "{}: a frame of {} x {} among frames of {} x {}, expected one size: do not change the "
        "camera's window in between",
        kStackStep, frame.width_px, frame.height_px, width_px_, height_px_));
  }
  if (frame.exposure_s != exposure_s_) {
    throw StepRefused(fmt::format(
        "{}: a frame of {} s among frames of {} s, expected one exposure: take the set again",
        kStackStep, frame.exposure_s, exposure_s_));
  }
  if (frames() >= kMaxFrames) {
    throw StepRefused(
        fmt::format("{}: more than {} frames, expected fewer", kStackStep, kMaxFrames));
  }
  std::uint64_t total = 0;
  std::uint64_t checksum = 14695981039346656037U;  // FNV-1a, by pixel
  std::size_t saturated = 0;
  for (const std::uint16_t value : frame.pixels_dn) {
    total += value;
    checksum = (checksum ^ value) * 1099511628211U;
    if (value >= saturation_dn_) ++saturated;
  }
  const auto count = static_cast<double>(pixels());
  if (const double share = static_cast<double>(saturated) / count; share > kMaxSaturated) {
    throw StepRefused(
        fmt::format("{}: {:.1f} % of the pixels are saturated, expected less than {:.0f} %: expose "
                    "shorter",
                    kStackStep, 100.0 * share, 100.0 * kMaxSaturated));
  }
  if (frames() > 0 && checksum == last_checksum_) {
    throw StepRefused(
        fmt::format("{}: two frames of {} s are the same in every pixel, expected "
                    "noise: the camera delivered one twice; take the set again",
                    kStackStep, exposure_s_));
  }
  for (std::size_t p = 0; p < sum_.size(); ++p) {
    const std::uint64_t value = frame.pixels_dn[p];
    sum_[p] += static_cast<std::uint32_t>(value);
    sum_of_squares_[p] += value * value;
  }
  last_checksum_ = checksum;
  frame_means_dn_.push_back(static_cast<double>(total) / count);
}

double PixelStack::mean_dn(std::size_t pixel) const {
  return static_cast<double>(sum_[pixel]) / static_cast<double>(frames());
}

double PixelStack::variance_dn2(std::size_t pixel) const {
  // n sum(y^2) - sum(y)^2 in whole numbers: nothing cancels. 2^16 * 2^48 just fits.
  const std::uint64_t count = frames();
  const std::uint64_t sum = sum_[pixel];
  const std::uint64_t scaled = count * sum_of_squares_[pixel] - sum * sum;
  return static_cast<double>(scaled) /
         (static_cast<double>(count) * (static_cast<double>(count) - 1.0));
}

}  // namespace gonio::calibration::sensor
