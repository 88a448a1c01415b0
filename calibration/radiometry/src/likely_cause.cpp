#include "likely_cause.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "forward_model.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::calibration {
namespace {

// What a healthy instrument still shows: the certificate's table from pose to pose, and the angles.
constexpr double kWhiteFloor = 0.002;
constexpr double kMirrorFloorDeg = 0.004;
/// Of the brightest of a colour: light that comes by other ways, and what is no more than dark.
constexpr double kStray = 0.0005;
constexpr double kDark = 0.001;
constexpr double kLargestLog = 3.0;
constexpr double kZeroStepDeg = 0.02;
constexpr int kZeroRounds = 3;
constexpr double kMostPerRound_deg = 2.0;
/// Of half the white's width: a part of the white whose middle lies within is clear of its edge.
constexpr double kClearOfEdge = 0.92;
/// Of the number of residuals: chi^2 that one more size has to take away, for what no cause
/// explains (fields, certificate) is as large as a residual's sigma and may look like a little of
/// any.
constexpr double kPrice = 0.25;
constexpr double kExplainedEnough = 0.7;

/// Residuals of white and mirror, each over its sigma, in the order of the data.
using Residuals = Eigen::VectorXd;

double limited_log(double ratio) {
  if (!(ratio > 0.0)) return -kLargestLog;
  return std::clamp(std::log(ratio), -kLargestLog, kLargestLog);
}

double mirror_sigma(const instrument::Instrument& instrument, const HighlightView& view) {
  return std::hypot(view.sigma_px / instrument.camera.fx_px,
                    Angle::from_degrees(kMirrorFloorDeg).radians());
}

/// Verification's data with what goes for dark in each colour.
class Evidence {
 public:
  explicit Evidence(const VerificationData& data) : data_(data) {
    for (const WhiteView& view : data.white) {
      double& dark = dark_[static_cast<std::size_t>(view.channel)];
      for (const PixelSignal& pixel : view.pixels) dark = std::max(dark, kDark * pixel.dn_per_s);
    }
  }

  const VerificationData& data() const { return data_; }

  double sigma(const WhiteView& view, const PixelSignal& pixel) const {
    const double light = std::max(pixel.dn_per_s, 0.0) + dark(view);
    if (!(light > 0.0)) return 1.0;
    const double stray = dark(view) * (kStray / kDark);
    return std::hypot(pixel.sigma_dn_per_s / light, stray / light, kWhiteFloor);
  }

  Residuals residuals(const instrument::Instrument& instrument) const {
    std::vector<double> values;
    for (const WhiteView& view : data_.white) {
      for (const PixelSignal& pixel : view.pixels) {
        const double light = std::max(pixel.dn_per_s, 0.0) + dark(view);
        const double predicted = predicted_signal(instrument, data_, view, pixel) + dark(view);
        const double log = predicted > 0.0 ? limited_log(light / predicted) : kLargestLog;
        values.push_back(log / sigma(view, pixel));
      }
    }
    for (const HighlightView& view : data_.mirror) {
      const Eigen::Vector2d error = lamp_error(instrument, view) / mirror_sigma(instrument, view);
      values.push_back(error.x());
      values.push_back(error.y());
    }
    return Eigen::Map<const Residuals>(values.data(), static_cast<Eigen::Index>(values.size()));
  }

  /// 1 where a residual says something if the rig is any of `rigs`: the mirror's all, and those of
  /// the white that lie on it. With an axis that turns the other way or counts from elsewhere the
  /// white lies elsewhere in the picture, and its edge, which no prediction knows, would outweigh
  /// all else. What a rig sees from behind stays: it speaks against that rig.
  Eigen::VectorXd on_the_white(const std::vector<instrument::Instrument>& rigs) const {
    std::vector<double> kept;
    for (const WhiteView& view : data_.white) {
      const std::size_t first = kept.size();
      kept.resize(first + view.pixels.size(), 1.0);
      for (const instrument::Instrument& rig : rigs) {
        const rig::RigPose pose = rig::forward(rig.rig, view.joints);
        for (std::size_t i = 0; i < view.pixels.size(); ++i) {
          const auto seen =
              instrument::pixel_geometry(rig, pose, view.pixels[i].column, view.pixels[i].row);
          if (seen && seen->point_in_sample_mm.head<2>().cwiseAbs().maxCoeff() >
                          kClearOfEdge * data_.white_half_width_mm) {
            kept[first + i] = 0.0;
          }
        }
      }
    }
    kept.resize(kept.size() + 2 * data_.mirror.size(), 1.0);
    return Eigen::Map<const Eigen::VectorXd>(kept.data(), static_cast<Eigen::Index>(kept.size()));
  }

  /// A pattern that lies on the white alone: `value` of every pixel, over its sigma.
  Residuals white_pattern(
      const std::function<double(const WhiteView&, const PixelSignal&)>& value) const {
    std::vector<double> values;
    for (const WhiteView& view : data_.white) {
      for (const PixelSignal& pixel : view.pixels) {
        values.push_back(value(view, pixel) / sigma(view, pixel));
      }
    }
    values.resize(values.size() + 2 * data_.mirror.size(), 0.0);
    return Eigen::Map<const Residuals>(values.data(), static_cast<Eigen::Index>(values.size()));
  }

  /// One column per colour that was looked at: a factor on all of its pictures.
  Eigen::MatrixXd factors() const {
    std::vector<Residuals> columns;
    for (int channel = 0; channel < static_cast<int>(dark_.size()); ++channel) {
      const Residuals column = white_pattern([&](const WhiteView& view, const PixelSignal&) {
        return view.channel == channel ? 1.0 : 0.0;
      });
      if (!column.isZero(0.0)) columns.push_back(column);
    }
    Eigen::MatrixXd all(columns.at(0).size(), static_cast<Eigen::Index>(columns.size()));
    for (std::size_t i = 0; i < columns.size(); ++i) {
      all.col(static_cast<Eigen::Index>(i)) = columns[i];
    }
    return all;
  }

 private:
  double dark(const WhiteView& view) const { return dark_[static_cast<std::size_t>(view.channel)]; }

  const VerificationData& data_;
  std::array<double, 3> dark_{};
};

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
  Residuals residuals;     ///< of the instrument that `size` counts from `start`
  double start = 0.0;      ///< of its first pattern
  double chi2 = 0.0;       ///< what it leaves
  double size = 0.0;       ///< of its first pattern; of factors: the largest, in per cent

  double priced(double rows) const {
    return chi2 + kPrice * rows * static_cast<double>(design.cols());
  }
};

/// Least squares over the rows that are kept.
Eigen::VectorXd solved(const Eigen::MatrixXd& design, const Residuals& residuals,
                       const Eigen::VectorXd& kept) {
  const Eigen::MatrixXd rows = kept.asDiagonal() * design;
  return rows.colPivHouseholderQr().solve(kept.cwiseProduct(residuals));
}

/// A pattern beside factors on the colours: the constants were taken with the same mistake.
Hypothesis beside(const Eigen::MatrixXd& factors, Cause cause, std::string sentence,
                  const Residuals& pattern) {
  Hypothesis hypothesis;
  hypothesis.cause = cause;
  hypothesis.sentence = std::move(sentence);
  hypothesis.design.resize(pattern.size(), 1 + factors.cols());
  hypothesis.design << pattern, factors;
  return hypothesis;
}

std::vector<Hypothesis> of_the_light(const instrument::Instrument& instrument,
                                     const Evidence& evidence, const Eigen::MatrixXd& factors) {
  std::vector<Hypothesis> list(1);
  list[0].cause = Cause::stale_white;
  list[0].sentence =
      "every picture of a colour is off by one factor (up to {:+.1f} %): the white is stale or "
      "soiled, or the lamp has changed; measure the white again";
  list[0].design = factors;
  list.push_back(beside(
      factors, Cause::response_curve,
      "signals go with a power of the light (exponent off by {:+.2f}): a gamma or lookup table is "
      "on in the camera",
      evidence.white_pattern([&](const WhiteView& view, const PixelSignal& pixel) {
        // What the sensor held, not the rate: exposures are chosen so that pictures are alike.
        const double held =
            predicted_signal(instrument, evidence.data(), view, pixel) * view.exposure_s;
        return held > 0.0 ? std::log(held) : 0.0;
      })));
  list.push_back(beside(
      factors, Cause::cosine_of_view,
      "signals go with cos theta_o (power {:+.2f}): the reduction has a cosine of the viewing "
      "angle that does not belong there",
      evidence.white_pattern([&](const WhiteView& view, const PixelSignal& pixel) {
        const auto seen = instrument::pixel_geometry(
            instrument, rig::forward(instrument.rig, view.joints), pixel.column, pixel.row);
        return seen ? limited_log(seen->directions.wo.z()) : 0.0;
      })));
  list.push_back(beside(
      factors, Cause::inverse_square_law,
      "signals go with the lamp's distance (power of r^2 {:+.2f}): 1/r^2 is left out or applied "
      "twice",
      evidence.white_pattern([&](const WhiteView& view, const PixelSignal& pixel) {
        const rig::RigPose pose = rig::forward(instrument.rig, view.joints);
        const auto seen = instrument::pixel_geometry(instrument, pose, pixel.column, pixel.row);
        if (!seen) return 0.0;
        const Eigen::Vector3d to_lamp =
            pose.world_from_lamp.translation() - pose.world_from_sample * seen->point_in_sample_mm;
        return std::log(to_lamp.squaredNorm() / pose.world_from_lamp.translation().squaredNorm());
      })));
  return list;
}

/// Residuals by a turn of an axis' zero, per degree.
Residuals by_zero(const instrument::Instrument& instrument, const Evidence& evidence,
                  const Residuals& residuals, std::size_t axis) {
  const Angle step = Angle::from_degrees(kZeroStepDeg);
  return (residuals - evidence.residuals(turned(instrument, axis, step))) / kZeroStepDeg;
}

/// An axis that counts from another zero, and may turn the other way round: then its zero is found
/// with it, for where it counts from depends on who turned its sign.
struct OtherAxis {
  std::size_t axis = 0;
  Cause cause = Cause::zero_offset;
  instrument::Instrument instrument;
  double zero_deg = 0.0;  ///< turned by so far
};

OtherAxis other_axis(const instrument::Instrument& instrument, const Evidence& evidence,
                     const Eigen::MatrixXd& factors, std::size_t axis, Cause cause) {
  OtherAxis other{axis, cause,
                  cause == Cause::axis_sign ? other_way_round(instrument, axis) : instrument};
  for (int round = 0; round < kZeroRounds; ++round) {
    const Residuals residuals = evidence.residuals(other.instrument);
    Eigen::MatrixXd design(residuals.size(), 1 + factors.cols());
    design << by_zero(other.instrument, evidence, residuals, axis), factors;
    const double by_deg =
        std::clamp(solved(design, residuals, evidence.on_the_white({other.instrument}))[0],
                   -kMostPerRound_deg, kMostPerRound_deg);
    other.instrument = turned(other.instrument, axis, Angle::from_degrees(by_deg));
    other.zero_deg += by_deg;
  }
  return other;
}

Hypothesis hypothesis_of(const OtherAxis& other, const Evidence& evidence,
                         const Eigen::MatrixXd& factors) {
  const std::string& name = other.instrument.rig.axes[other.axis].name;
  const Residuals residuals = evidence.residuals(other.instrument);
  Hypothesis hypothesis = beside(
      factors, other.cause,
      other.cause == Cause::axis_sign
          ? name + " turns the other way: its scale in the rig file has the wrong sign"
          : name + " counts from another zero, by {:+.3f} deg: home it, then repeat zero_offsets",
      by_zero(other.instrument, evidence, residuals, other.axis));
  hypothesis.residuals = residuals;
  hypothesis.start = other.zero_deg;
  return hypothesis;
}

void fit(Hypothesis& hypothesis, const Eigen::VectorXd& kept) {
  const Eigen::VectorXd sizes = solved(hypothesis.design, hypothesis.residuals, kept);
  hypothesis.chi2 =
      kept.cwiseProduct(hypothesis.residuals - hypothesis.design * sizes).squaredNorm();
  hypothesis.size = hypothesis.start + sizes[0];
  if (hypothesis.cause != Cause::stale_white) return;
  Eigen::Index largest = 0;
  sizes.cwiseAbs().maxCoeff(&largest);
  hypothesis.size = 100.0 * std::expm1(sizes[largest]);
}

}  // namespace

LikelyCause likely_cause(const instrument::Instrument& instrument, const VerificationData& data) {
  const Evidence evidence(data);
  const Residuals residuals = evidence.residuals(instrument);
  const Eigen::MatrixXd factors = evidence.factors();
  std::vector<Hypothesis> list = of_the_light(instrument, evidence, factors);
  for (Hypothesis& hypothesis : list) hypothesis.residuals = residuals;
  std::vector<instrument::Instrument> rigs{instrument};
  for (const Cause cause : {Cause::zero_offset, Cause::axis_sign}) {
    for (std::size_t axis = 0; axis < instrument.rig.axes.size(); ++axis) {
      const OtherAxis other = other_axis(instrument, evidence, factors, axis, cause);
      list.push_back(hypothesis_of(other, evidence, factors));
      rigs.push_back(other.instrument);
    }
  }
  // One set of rows for all: what one of them may leave out, none has to explain.
  const Eigen::VectorXd kept = evidence.on_the_white(rigs);
  for (Hypothesis& hypothesis : list) fit(hypothesis, kept);
  const auto best = std::min_element(list.begin(), list.end(),
                                     [rows = kept.sum()](const Hypothesis& a, const Hypothesis& b) {
                                       return a.priced(rows) < b.priced(rows);
                                     });
  const double all = kept.cwiseProduct(residuals).squaredNorm();
  const double explained = all > 0.0 ? std::clamp(1.0 - best->chi2 / all, 0.0, 1.0) : 0.0;
  if (explained < kExplainedEnough) {
    return {Cause::unknown,
            fmt::format("no single mistake explains it (the likeliest, {}, takes away {:.0f} %): "
                        "look at the failed checks",
                        to_string(best->cause), 100.0 * explained),
            explained};
  }
  return {best->cause, fmt::format(fmt::runtime(best->sentence), best->size), explained};
}

}  // namespace gonio::calibration
