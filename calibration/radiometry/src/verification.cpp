#include "gonio/calibration/radiometry/verification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "forward_model.h"
#include "gonio/calibration/radiometry/white_ratios.h"
#include "gonio/calibration/result/step_refused.h"
#include "likely_cause.h"

namespace gonio::calibration {
namespace {

constexpr double kWhiteLimit = 0.015;
constexpr double kMirrorLimitDeg = 0.05;
constexpr std::size_t kMinPoses = 3;

void require_poses(const char* target, std::size_t found) {
  if (found >= kMinPoses) return;
  throw StepRefused(
      fmt::format("found {} {} poses, expected at least {}: one pose cannot tell an angle from a "
                  "factor",
                  found, target, kMinPoses));
}

void require_mirror_views(const instrument::Instrument& instrument,
                          const std::vector<HighlightView>& views) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].joints.size() == instrument.rig.axes.size() && views[i].pixel.allFinite() &&
        views[i].sigma_px > 0.0) {
      continue;
    }
    throw StepRefused(
        fmt::format("mirror view {}: found no finite pixel, sigma or joints, expected all", i));
  }
}

/// Largest relative difference of a signal from its prediction; infinite where none was expected.
double worst_white(const instrument::Instrument& instrument, const VerificationData& data) {
  double worst = 0.0;
  for (const WhiteView& view : data.white) {
    for (const PixelSignal& pixel : view.pixels) {
      const double predicted = predicted_signal(instrument, data, view, pixel);
      const double ratio =
          predicted > 0.0 ? pixel.dn_per_s / predicted : std::numeric_limits<double>::infinity();
      worst = std::max(worst, std::abs(ratio - 1.0));
    }
  }
  return worst;
}

double worst_mirror_deg(const instrument::Instrument& instrument, const VerificationData& data) {
  double worst = 0.0;
  for (const HighlightView& view : data.mirror) {
    worst = std::max(worst, Angle::from_radians(lamp_error(instrument, view).norm()).degrees());
  }
  return worst;
}

std::string failed_ratios(const std::vector<instrument::AcceptanceCheck>& checks) {
  std::string text;
  for (const instrument::AcceptanceCheck& check : checks) {
    if (check.passed()) continue;
    text += fmt::format("{}{} is off by {:.2f} %", text.empty() ? "" : "; ", check.name,
                        100.0 * check.found);
  }
  return text + ": white and angles are right; did the sample or the lamp change?";
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
  require_poses("white", data.white.size());
  require_mirror_views(instrument, data.mirror);

  Verification verification;
  verification.passed = true;
  const auto check = [&](std::string name, double found, double limit) {
    verification.checks.push_back({std::move(name), limit, found});
    verification.passed = verification.passed && verification.checks.back().passed();
  };
  check("white at other poses, relative", worst_white(instrument, data), kWhiteLimit);
  if (verification.passed) {
    // A white as it should be does not make up for what was not there to be looked at.
    if (!data.unseen.empty()) throw StepRefused(data.unseen.front());
    require_poses("mirror", data.mirror.size());
  }
  if (!data.mirror.empty()) {
    check("lamp's mirror image, deg", worst_mirror_deg(instrument, data), kMirrorLimitDeg);
  }
  const WhiteRatios white = white_ratios(instrument, data);
  const auto check_ratio = [&](const RatioCheck& ratio) {
    check(ratio.name, std::abs(ratio.found / ratio.expected - 1.0), ratio.tolerance);
  };
  if (white.hemisphere) check_ratio(*white.hemisphere);
  if (!verification.passed) {
    const LikelyCause likely = likely_cause(instrument, data);
    verification.cause = likely.cause;
    verification.explanation = likely.explanation;
    verification.explained = likely.explained;
    for (const std::string& each : data.unseen) verification.explanation += "; " + each;
  }
  for (const auto& ratio : {white.repeat, white.reciprocity, white.energy}) {
    if (ratio) check_ratio(*ratio);
  }
  for (const RatioCheck& ratio : data.ratios) check_ratio(ratio);
  if (!verification.passed && verification.cause == Cause::none) {
    verification.cause = Cause::unknown;
    verification.explanation = failed_ratios(verification.checks);
  }
  return verification;
}

}  // namespace gonio::calibration
