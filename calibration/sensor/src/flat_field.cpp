#include "gonio/calibration/sensor/flat_field.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kFlatStep = "flat field";
constexpr int kPhases = 4;  // of a Bayer mosaic

class FlatFit {
 public:
  FlatFit(const instrument::CameraModel& camera, std::span<const FlatImage> images,
          const FlatFieldOptions& options)
      : camera_(camera), images_(images), options_(options), constants_(images.size() * kPhases) {
    check();
    seen_.assign(constants_.size(), 0.0);
    for_each_pixel([&](std::size_t, int column, int row, double q) {
      q_max_ = std::max(q_max_, q);
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (used(i, column, row)) seen_[group(i, column, row)] += 1.0;
      }
    });
    double total = 0.0;
    for (const double count : seen_) total += count;
    constexpr double kFewest = 1000.0;
    if (total < kFewest) {
      throw StepRefused(
          fmt::format("{}: {} pixels see the white, expected at least {}: place it in "
                      "the image",
                      kFlatStep, total, kFewest));
    }
    constexpr double kSmallField = 1e-3;  // 1.8 deg off the axis; plain lenses lose 0.2 % there
    if (q_max_ < kSmallField) {
      throw StepRefused(fmt::format(
          "{}: the white is seen up to {:.2f} deg off the axis, expected at least 1.8 deg: use all "
          "of the image",
          kFlatStep, std::atan(std::sqrt(q_max_)) * 180.0 / std::numbers::pi));
    }
  }

  FlatField run() {
    constexpr int kMaxRounds = 20;
    constexpr double kDone = 1e-9;  // of V at the corner
    for (int round = 0; round < kMaxRounds; ++round) {
      update_constants();
      const Eigen::Vector3d change = step();
      v_ += change;
      if (change.cwiseAbs().maxCoeff() < kDone) break;
    }
    update_constants();
    FlatField field;
    const Eigen::Vector3d scale(1.0 / q_max_, 1.0 / (q_max_ * q_max_),
                                1.0 / (q_max_ * q_max_ * q_max_));
    const Eigen::Vector3d v = v_.cwiseProduct(scale);
    field.vignetting = {v[0], v[1], v[2]};
    field.covariance = scale.asDiagonal() * covariance() * scale.asDiagonal();
    fill_pixels(field);
    field.residual_rms = block_rms();
    field.acceptance = {"rms of the flat field's residual over 16 x 16 px (relative)",
                        options_.max_residual, field.residual_rms};
    return field;
  }

 private:
  void check() const {
    const auto pixels =
        static_cast<std::size_t>(camera_.width_px) * static_cast<std::size_t>(camera_.height_px);
    if (images_.empty()) {
      throw StepRefused(fmt::format("{}: no image, expected one of the white at least", kFlatStep));
    }
    for (std::size_t i = 0; i < images_.size(); ++i) {
      if (images_[i].signal_dn.size() != pixels || images_[i].expected.size() != pixels) {
        throw StepRefused(fmt::format(
            "{}: image {} has {} pixels and {} expected values, expected {} x {} as the camera",
            kFlatStep, i, images_[i].signal_dn.size(), images_[i].expected.size(), camera_.width_px,
            camera_.height_px));
      }
      for (std::size_t p = 0; p < pixels; ++p) {
        if (!std::isfinite(images_[i].signal_dn[p]) || !std::isfinite(images_[i].expected[p])) {
          throw StepRefused(fmt::format("{}: pixel {} of image {} is not a number: take it again",
                                        kFlatStep, p, i));
        }
      }
    }
    if (!options_.bad_pixels.empty() && options_.bad_pixels.size() != pixels) {
      throw std::invalid_argument(fmt::format("{}: a mask of {} pixels, expected {}", kFlatStep,
                                              options_.bad_pixels.size(), pixels));
    }
  }

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width_px) +
           static_cast<std::size_t>(column);
  }
  bool used(std::size_t image, int column, int row) const {
    return images_[image].expected[index(column, row)] > 0.0;
  }
  std::size_t group(std::size_t image, int column, int row) const {
    const int phase = options_.mosaic ? 2 * (row % 2) + column % 2 : 0;
    return image * kPhases + static_cast<std::size_t>(phase);
  }

  /// Calls visit(pixel, column, row, q) for each good pixel that an image sees.
  template <typename Visit>
  void for_each_pixel(const Visit& visit) const {
    for (int row = 0; row < camera_.height_px; ++row) {
      for (int column = 0; column < camera_.width_px; ++column) {
        const std::size_t p = index(column, row);
        if (!options_.bad_pixels.empty() && options_.bad_pixels[p] != 0) continue;
        bool any = false;
        for (std::size_t i = 0; i < images_.size() && !any; ++i) any = used(i, column, row);
        if (!any) continue;
        const double x = (column - camera_.cx_px) / camera_.fx_px;
        const double y = (row - camera_.cy_px) / camera_.fy_px;
        visit(p, column, row, x * x + y * y);
      }
    }
  }

  /// Powers of q over its largest, so that the three coefficients are of one size.
  Eigen::Vector3d powers(double q) const {
    const double s = q / q_max_;
    return {s, s * s, s * s * s};
  }
  double falloff(double q) const { return 1.0 + v_.dot(powers(q)); }
  double residual(std::size_t image, std::size_t pixel, int column, int row, double v) const {
    const double model = constants_[group(image, column, row)] * v * images_[image].expected[pixel];
    return images_[image].signal_dn[pixel] / model - 1.0;
  }

  void update_constants() {
    std::vector<double> sum(constants_.size(), 0.0);
    for_each_pixel([&](std::size_t p, int column, int row, double q) {
      const double v = falloff(q);
      if (!(v > 0.0)) refuse_falloff();
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (!used(i, column, row)) continue;
        sum[group(i, column, row)] += images_[i].signal_dn[p] / (v * images_[i].expected[p]);
      }
    });
    for (std::size_t g = 0; g < sum.size(); ++g) {
      if (seen_[g] == 0.0) continue;
      constants_[g] = sum[g] / seen_[g];
      if (!(constants_[g] > 0.0)) {
        throw StepRefused(
            fmt::format("{}: image {} has no signal above dark, expected a lit white: "
                        "the lamp is off or the shutter closed",
                        kFlatStep, g / kPhases));
      }
    }
  }

  [[noreturn]] static void refuse_falloff() {
    throw StepRefused(
        fmt::format("{}: the lens would pass no light in a part of the image, expected "
                    "a falloff: the expected radiance belongs to another pose",
                    kFlatStep));
  }

  /// Mean of d ln V / d v over each group: what its constant takes up.
  void update_means() {
    means_.assign(constants_.size(), Eigen::Vector3d::Zero());
    for_each_pixel([&](std::size_t, int column, int row, double q) {
      const Eigen::Vector3d gradient = powers(q) / falloff(q);
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (used(i, column, row)) means_[group(i, column, row)] += gradient;
      }
    });
    for (std::size_t g = 0; g < means_.size(); ++g) {
      if (seen_[g] > 0.0) means_[g] /= seen_[g];
    }
  }

  /// One step of Gauss and Newton on relative residuals, the constants eliminated.
  Eigen::Vector3d step() {
    update_means();
    normal_.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for_each_pixel([&](std::size_t p, int column, int row, double q) {
      const double v = falloff(q);
      const Eigen::Vector3d gradient = powers(q) / v;
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (!used(i, column, row)) continue;
        const Eigen::Vector3d own = gradient - means_[group(i, column, row)];
        normal_.noalias() += own * own.transpose();
        right += own * residual(i, p, column, row, v);
      }
    });
    const Eigen::LDLT<Eigen::Matrix3d> factor(normal_);
    constexpr double kIndependent = 1e-9;
    if (!(factor.rcond() > kIndependent)) {
      throw StepRefused(
          fmt::format("{}: the white covers too little of the image to tell the "
                      "falloff, expected it from the middle to a corner",
                      kFlatStep));
    }
    return factor.solve(right);
  }

  /// The images of one pixel share its response: their residuals count as one.
  Eigen::Matrix3d covariance() {
    step();
    Eigen::Matrix3d meat = Eigen::Matrix3d::Zero();
    for_each_pixel([&](std::size_t p, int column, int row, double q) {
      const double v = falloff(q);
      const Eigen::Vector3d gradient = powers(q) / v;
      Eigen::Vector3d score = Eigen::Vector3d::Zero();
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (!used(i, column, row)) continue;
        score += (gradient - means_[group(i, column, row)]) * residual(i, p, column, row, v);
      }
      meat.noalias() += score * score.transpose();
    });
    const Eigen::Matrix3d bread = normal_.inverse();
    return bread * meat * bread;
  }

  void fill_pixels(FlatField& field) const {
    field.pixel_response.assign(images_[0].signal_dn.size(), 0.0F);
    double squares = 0.0;
    double count = 0.0;
    for_each_pixel([&](std::size_t p, int column, int row, double q) {
      const double v = falloff(q);
      double sum = 0.0;
      double images = 0.0;
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (!used(i, column, row)) continue;
        sum += residual(i, p, column, row, v);
        images += 1.0;
      }
      field.pixel_response[p] = static_cast<float>(1.0 + sum / images);
      squares += std::pow(sum / images, 2.0);
      count += 1.0;
    });
    field.pixel_response_rms = std::sqrt(squares / count);
  }

  double block_rms() const {
    constexpr int kBlock_px = 16;
    constexpr double kFull = 0.25 * kBlock_px * kBlock_px;
    const int across = (camera_.width_px + kBlock_px - 1) / kBlock_px;
    const int down = (camera_.height_px + kBlock_px - 1) / kBlock_px;
    const auto blocks = static_cast<std::size_t>(across) * static_cast<std::size_t>(down);
    std::vector<double> sum(blocks * images_.size(), 0.0);
    std::vector<double> seen(sum.size(), 0.0);
    for_each_pixel([&](std::size_t p, int column, int row, double q) {
      const double v = falloff(q);
      const auto block = static_cast<std::size_t>((row / kBlock_px) * across + column / kBlock_px);
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (!used(i, column, row)) continue;
        sum[i * blocks + block] += residual(i, p, column, row, v);
        seen[i * blocks + block] += 1.0;
      }
    });
    double squares = 0.0;
    double count = 0.0;
    for (std::size_t b = 0; b < sum.size(); ++b) {
      if (seen[b] < kFull) continue;
      squares += std::pow(sum[b] / seen[b], 2.0);
      count += 1.0;
    }
    return count > 0.0 ? std::sqrt(squares / count) : 0.0;
  }

  const instrument::CameraModel& camera_;
  std::span<const FlatImage> images_;
  const FlatFieldOptions& options_;
  std::vector<double> constants_;  ///< per image and phase
  std::vector<double> seen_;       ///< pixels of each
  std::vector<Eigen::Vector3d> means_;
  double q_max_ = 0.0;
  Eigen::Vector3d v_ = Eigen::Vector3d::Zero();  ///< times q_max, q_max^2, q_max^3
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero();
};

}  // namespace

FlatField fit_flat_field(const instrument::CameraModel& camera, std::span<const FlatImage> images,
                         const FlatFieldOptions& options) {
  const bool sized =
      camera.width_px > 0 && camera.height_px > 0 && camera.fx_px > 0.0 && camera.fy_px > 0.0;
  if (!sized) {
    throw std::invalid_argument(
        fmt::format("{}: a camera of {} x {} px, f {} px, expected positive", kFlatStep,
                    camera.width_px, camera.height_px, camera.fx_px));
  }
  return FlatFit(camera, images, options).run();
}

}  // namespace gonio::calibration::sensor
