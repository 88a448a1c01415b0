#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gonio/calibration/sensor/frame_view.h"

namespace gonio::calibration::sensor {

/// Mean and temporal variance of every pixel over frames of one exposure and scene, added one by
/// one, so that a set of any length needs 12 bytes per pixel. Sums are whole numbers: the result
/// does not depend on the order.
///
/// Threads  One thread per object, const calls from any.
class PixelStack {
 public:
  /// `saturation_dn`  At or above it a pixel carries no value.
  /// Throws std::invalid_argument: a size that is not positive or above 65536, an exposure below 0
  /// or not finite.
  PixelStack(int width_px, int height_px, double exposure_s, double saturation_dn);

  /// Throws StepRefused, and stays as it was: another size or exposure than the stack's, more than
  /// 1 % of the pixels saturated (hot pixels may be), the frame added last once more (one buffer
  /// delivered twice), more than 65536 frames.
  void add(const FrameView& frame);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  std::size_t pixels() const { return sum_.size(); }
  double exposure_s() const { return exposure_s_; }
  std::size_t frames() const { return frame_means_dn_.size(); }
  /// Mean over all pixels of each frame, in the order added: drift and jumps show here.
  const std::vector<double>& frame_means_dn() const { return frame_means_dn_; }

  double mean_dn(std::size_t pixel) const;       ///< needs one frame
  double variance_dn2(std::size_t pixel) const;  ///< of one frame; needs two

 private:
  int width_px_;
  int height_px_;
  double exposure_s_;
  double saturation_dn_;
  std::vector<std::uint32_t> sum_;
  std::vector<std::uint64_t> sum_of_squares_;
  std::vector<double> frame_means_dn_;
  std::uint64_t last_checksum_ = 0;
};

}  // namespace gonio::calibration::sensor
