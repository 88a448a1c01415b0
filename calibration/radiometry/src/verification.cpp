#include "gonio/calibration/radiometry/verification.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::calibration {
namespace {

constexpr double kWhiteLimit = 0.015;
constexpr double kMirrorLimitDeg = 0.05;
// What a healthy instrument still shows: the certificate's table from pose to pose, and the angles.
constexpr double kWhiteFloor = 0.002;
constexpr double kMirrorFloorDeg = 0.004;
constexpr double kLargestLog = 3.0;  // a prediction without light is no finite logarithm
constexpr double kZeroStepDeg = 0.02;
constexpr double kExplainedEnough = 0.7;
constexpr std::size_t kMinPoses = 3;

/// Residuals of white and mirror, each over its sigma, in the order of the data.
using Residuals = Eigen::VectorXd;

/// The direction to the lamp that a highlight shows, against where the instrument has the lamp:
/// two small angles across it. Large but finite where the picture and the instrument disagree so
/// much that the plane is seen from behind.
Eigen::Vector2d lamp_error(const instrument::Instrument& instrument, const HighlightView& view) {
  const rig::RigPose pose = rig::forward(instrument.rig, view.joints);
  const Eigen::Isometry3d sample_from_world = pose.world_from_sample.inverse();
  const Eigen::Isometry3d sample_from_camera = sample_from_world * pose.world_from_camera;
  const Eigen::Vector3d eye = sample_from_camera.translation();
  const Eigen::Vector3d ray =
      sample_from_camera.linear() * instrument.camera.ray(view.pixel.x(), view.pixel.y());
  if (!(ray.z() < 0.0) || !(eye.z() > 0.0)) return Eigen::Vector2d::Constant(1.0);
  const Eigen::Vector3d point = eye - ray * (eye.z() / ray.z());
  const Eigen::Vector3d mirrored(ray.x(), ray.y(), -ray.z());
  const Eigen::Vector3d lamp =
      (sample_from_world * pose.world_from_lamp.translation() - point).normalized();
  const Eigen::Vector3d across = lamp.unitOrthogonal();
  const Eigen::Vector3d error = mirrored.cross(lamp);
  Eigen::Vector2d angles(error.dot(across), error.dot(lamp.cross(across)));
  if (mirrored.dot(lamp) < 0.0) angles = angles.normalized() * (2.0 - angles.norm());
  return angles;
}

/// 0 in the dark or from behind: as wrong as it can be.
double predicted_signal(const instrument::Instrument& instrument, const VerificationData& data,
                        const WhiteView& view, const PixelSignal& pixel) {
  const auto factor = white_factor(instrument, view, pixel);
  if (!factor) return 0.0;
  return data.constant[static_cast<std::size_t>(view.channel)] * factor->per_constant;
}

double white_sigma(const PixelSignal& pixel) {
  const double relative = pixel.dn_per_s > 0.0 ? pixel.sigma_dn_per_s / pixel.dn_per_s : 1.0;
  return std::hypot(relative, kWhiteFloor);
}

double mirror_sigma(const instrument::Instrument& instrument, const HighlightView& view) {
  return std::hypot(view.sigma_px / instrument.camera.fx_px,
                    Angle::from_degrees(kMirrorFloorDeg).radians());
}

double limited_log(double ratio) {
  if (!(ratio > 0.0)) return -kLargestLog;
  return std::clamp(std::log(ratio), -kLargestLog, kLargestLog);
}

Residuals residuals_of(const instrument::Instrument& instrument, const VerificationData& data) {
  std::vector<double> values;
  for (const WhiteView& view : data.white) {
    for (const PixelSignal& pixel : view.pixels) {
      const double predicted = predicted_signal(instrument, data, view, pixel);
      const double log = predicted > 0.0 ? limited_log(pixel.dn_per_s / predicted) : kLargestLog;
      values.push_back(log / white_sigma(pixel));
    }
  }
  for (const HighlightView& view : data.mirror) {
    const Eigen::Vector2d error = lamp_error(instrument, view) / mirror_sigma(instrument, view);
    values.push_back(error.x());
    values.push_back(error.y());
  }
  return Eigen::Map<const Residuals>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// A pattern that lies on the white alone: `value` of every pixel, over its sigma.
Residuals white_pattern(const VerificationData& data, Eigen::Index size,
                        const std::function<double(const WhiteView&, const PixelSignal&)>& value) {
  Residuals pattern = Residuals::Zero(size);
  Eigen::Index at = 0;
  for (const WhiteView& view : data.white) {
    for (const PixelSignal& pixel : view.pixels) {
      pattern[at++] = value(view, pixel) / white_sigma(pixel);
    }
  }
  return pattern;
}

instrument::Instrument turned(instrument::Instrument instrument, std::size_t axis, Angle by) {
  for (rig::Chain* chain : {&instrument.rig.camera, &instrument.rig.lamp, &instrument.rig.sample}) {
    for (rig::ChainLink& link : chain->links) {
      if (link.axis == axis) link.offset += by;
    }
  }
  return instrument;
}

instrument::Instrument other_way_round(instrument::Instrument instrument, std::size_t axis) {
  for (rig::Chain* chain : {&instrument.rig.camera, &instrument.rig.lamp, &instrument.rig.sample}) {
    for (rig::ChainLink& link : chain->links) {
      if (link.axis == axis) link.scale = -link.scale;
    }
  }
  return instrument;
}

struct Hypothesis {
  Cause cause = Cause::unknown;
  std::string sentence;    ///< with {} for the fitted size
  Eigen::MatrixXd design;  ///< residuals = design * sizes
  double chi2 = 0.0;       ///< what it leaves
  double size = 0.0;       ///< of its first pattern
};

std::vector<Hypothesis> hypotheses(const instrument::Instrument& instrument,
                                   const VerificationData& data, const Residuals& residuals) {
  const Eigen::Index size = residuals.size();
  const Residuals one =
      white_pattern(data, size, [](const WhiteView&, const PixelSignal&) { return 1.0; });
  std::vector<Hypothesis> list;
  const auto add = [&](Cause cause, std::string sentence, const Residuals& pattern) {
    Hypothesis hypothesis;
    hypothesis.cause = cause;
    hypothesis.sentence = std::move(sentence);
    hypothesis.design.resize(size, cause == Cause::stale_white ? 1 : 2);
    hypothesis.design.col(0) = pattern;
    // The constant was taken with the same mistake: its error is one factor on everything.
    if (cause != Cause::stale_white) hypothesis.design.col(1) = one;
    list.push_back(std::move(hypothesis));
  };

  add(Cause::stale_white,
      "everything is off by one factor ({:+.3f} in ln): the white is stale or soiled, or the lamp "
      "has changed; measure the white again",
      one);
  add(Cause::response_curve,
      "signals go with a power of the light (exponent off by {:+.2f}): a gamma or lookup table is "
      "on in the camera",
      white_pattern(data, size, [&](const WhiteView& view, const PixelSignal& pixel) {
        const double predicted = predicted_signal(instrument, data, view, pixel);
        return predicted > 0.0 ? std::log(predicted) : 0.0;
      }));
  add(Cause::cosine_of_view,
      "signals go with cos theta_o (power {:+.2f}): the reduction has a cosine of the viewing "
      "angle that does not belong there",
      white_pattern(data, size, [&](const WhiteView& view, const PixelSignal& pixel) {
        const auto seen = instrument::pixel_geometry(
            instrument, rig::forward(instrument.rig, view.joints), pixel.column, pixel.row);
        return seen ? limited_log(seen->directions.wo.z()) : 0.0;
      }));
  add(Cause::inverse_square_law,
      "signals go with the lamp's distance (power of r^2 {:+.2f}): 1/r^2 is left out or applied "
      "twice",
      white_pattern(data, size, [&](const WhiteView& view, const PixelSignal& pixel) {
        const rig::RigPose pose = rig::forward(instrument.rig, view.joints);
        const auto seen = instrument::pixel_geometry(instrument, pose, pixel.column, pixel.row);
        if (!seen) return 0.0;
        const Eigen::Vector3d to_lamp =
            pose.world_from_lamp.translation() - pose.world_from_sample * seen->point_in_sample_mm;
        return std::log(to_lamp.squaredNorm() / pose.world_from_lamp.translation().squaredNorm());
      }));
  for (std::size_t axis = 0; axis < instrument.rig.axes.size(); ++axis) {
    const std::string& name = instrument.rig.axes[axis].name;
    const Angle step = Angle::from_degrees(kZeroStepDeg);
    add(Cause::zero_offset,
        name +
            " counts from another zero, by {:+.3f} deg: home it, then repeat "
            "zero_offsets",
        (residuals - residuals_of(turned(instrument, axis, step), data)) / kZeroStepDeg);
    Hypothesis sign;
    sign.cause = Cause::axis_sign;
    sign.sentence = name + " turns the other way: its scale in the rig file has the wrong sign";
    sign.design = residuals - residuals_of(other_way_round(instrument, axis), data);
    list.push_back(std::move(sign));
  }
  return list;
}

/// Fits the hypothesis' sizes; a sign is wrong or it is not.
void fit(Hypothesis& hypothesis, const Residuals& residuals) {
  if (hypothesis.cause == Cause::axis_sign) {
    hypothesis.size = 1.0;
    hypothesis.chi2 = (residuals - hypothesis.design.col(0)).squaredNorm();
    return;
  }
  const Eigen::VectorXd sizes = hypothesis.design.colPivHouseholderQr().solve(residuals);
  hypothesis.size = sizes[0];
  hypothesis.chi2 = (residuals - hypothesis.design * sizes).squaredNorm() +
                    static_cast<double>(hypothesis.design.cols()) *
                        std::log(static_cast<double>(residuals.size()));
}

void name_cause(const instrument::Instrument& instrument, const VerificationData& data,
                const Residuals& residuals, Verification& verification) {
  const double chi2 = residuals.squaredNorm();
  std::vector<Hypothesis> list = hypotheses(instrument, data, residuals);
  for (Hypothesis& hypothesis : list) fit(hypothesis, residuals);
  const auto best =
      std::min_element(list.begin(), list.end(),
                       [](const Hypothesis& a, const Hypothesis& b) { return a.chi2 < b.chi2; });
  verification.explained = std::clamp(1.0 - best->chi2 / chi2, 0.0, 1.0);
  if (verification.explained < kExplainedEnough) {
    verification.cause = Cause::unknown;
    verification.explanation = fmt::format(
        "no single mistake explains it (the likeliest, {}, takes away {:.0f} %): look at the "
        "failed "
        "checks",
        to_string(best->cause), 100.0 * verification.explained);
    return;
  }
  verification.cause = best->cause;
  verification.explanation = fmt::format(fmt::runtime(best->sentence), best->size);
}

}  // namespace

std::string_view to_string(Cause cause) {
  switch (cause) {
    case Cause::none:
      return "none";
    case Cause::stale_white:
      return "stale white";
    case Cause::zero_offset:
      return "zero offset";
    case Cause::axis_sign:
      return "axis sign";
    case Cause::response_curve:
      return "response curve";
    case Cause::cosine_of_view:
      return "cosine of view";
    case Cause::inverse_square_law:
      return "inverse square law";
    case Cause::unknown:
      return "unknown";
  }
  return "unknown";
}

Verification verify(const instrument::Instrument& instrument, const VerificationData& data) {
  require_white_views(instrument, data.white);
  if (data.white.size() < kMinPoses || data.mirror.size() < kMinPoses) {
    throw StepRefused(fmt::format(
        "found {} white and {} mirror poses, expected at least {} of each: one pose cannot tell an "
        "angle from a factor",
        data.white.size(), data.mirror.size(), kMinPoses));
  }
  for (std::size_t i = 0; i < data.mirror.size(); ++i) {
    const HighlightView& view = data.mirror[i];
    if (view.joints.size() != instrument.rig.axes.size() || !view.pixel.allFinite() ||
        !(view.sigma_px > 0.0)) {
      throw StepRefused(
          fmt::format("mirror view {}: found no finite pixel, sigma or joints, expected all", i));
    }
  }

  Verification verification;
  verification.passed = true;
  const auto check = [&](std::string name, double found, double limit) {
    verification.checks.push_back({std::move(name), limit, found});
    verification.passed = verification.passed && verification.checks.back().passed();
  };
  double worst_white = 0.0;
  for (const WhiteView& view : data.white) {
    for (const PixelSignal& pixel : view.pixels) {
      const double predicted = predicted_signal(instrument, data, view, pixel);
      const double ratio =
          predicted > 0.0 ? pixel.dn_per_s / predicted : std::numeric_limits<double>::infinity();
      worst_white = std::max(worst_white, std::abs(ratio - 1.0));
    }
  }
  check("white at other poses, relative", worst_white, kWhiteLimit);
  double worst_mirror = 0.0;
  for (const HighlightView& view : data.mirror) {
    worst_mirror =
        std::max(worst_mirror, Angle::from_radians(lamp_error(instrument, view).norm()).degrees());
  }
  check("lamp's mirror image, deg", worst_mirror, kMirrorLimitDeg);
  const bool white_and_angles_right = verification.passed;
  for (const RatioCheck& ratio : data.ratios) {
    check(ratio.name, std::abs(ratio.found / ratio.expected - 1.0), ratio.tolerance);
  }
  if (verification.passed) return verification;
  if (white_and_angles_right) {
    verification.cause = Cause::unknown;
    for (const instrument::AcceptanceCheck& result : verification.checks) {
      if (result.passed()) continue;
      verification.explanation +=
          fmt::format("{}{} is off by {:.2f} %", verification.explanation.empty() ? "" : "; ",
                      result.name, 100.0 * result.found);
    }
    verification.explanation += ": white and angles are right; did the sample or the lamp change?";
    return verification;
  }
  name_cause(instrument, data, residuals_of(instrument, data), verification);
  return verification;
}

}  // namespace gonio::calibration
