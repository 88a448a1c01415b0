#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "evaluate_steps.h"
#include "geometry_uncertainty.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::calibration::routine {
namespace {

constexpr double kMaxFieldResidual = 0.005;
constexpr double kMaxStray = 0.001;
constexpr double kMaxRepeat = 0.003;
constexpr double kMaxDeltaE = 2.0;
const std::array<const char*, 3> kChannelNames{"0", "1", "2"};

/// Where the lamp's image stands in a mirror whose normal leans by a small rotation vector (x, y)
/// from the sample's; none behind the camera.
std::optional<Eigen::Vector2d> image_in_mirror(const instrument::Instrument& instrument,
                                               const rig::Joints& joints,
                                               const Eigen::Vector2d& tilt_rad) {
  const rig::RigPose pose = rig::forward(instrument.rig, joints);
  const Eigen::Vector3d normal = pose.world_from_sample.linear() *
                                 Eigen::Vector3d(tilt_rad.y(), -tilt_rad.x(), 1.0).normalized();
  const Eigen::Vector3d point = pose.world_from_sample.translation();
  const Eigen::Vector3d source = pose.world_from_lamp.translation();
  const Eigen::Vector3d image = source - 2.0 * normal.dot(source - point) * normal;
  const Eigen::Vector3d in_camera = pose.world_from_camera.inverse() * image;
  if (!(in_camera.z() > 0.0)) return std::nullopt;
  return instrument.camera.project(in_camera);
}

/// Mean of signal over prediction, weighted, of one channel in one take or in several.
struct ChannelMean {
  double sum = 0.0;
  double weight = 0.0;
  double mean() const { return sum / weight; }
};

ChannelMean constant_of(const instrument::Instrument& instrument, const WhiteView& view) {
  ChannelMean mean;
  for (const PixelSignal& pixel : view.pixels) {
    const auto factor = white_factor(instrument, view, pixel);
    if (!factor) continue;
    const double value = pixel.dn_per_s / factor->per_constant;
    const double sigma = pixel.sigma_dn_per_s / factor->per_constant;
    mean.sum += value / (sigma * sigma);
    mean.weight += 1.0 / (sigma * sigma);
  }
  if (!(mean.weight > 0.0) || !(mean.mean() > 0.0)) {
    throw StepRefused("white: found no light from the reference, expected it lit and in view");
  }
  return mean;
}

/// Of the constants, relative: what the lamp's distance and the angles are uncertain by.
double geometry_sigma(const instrument::Instrument& instrument, const WhiteView& view,
                      const std::vector<CalibratedRig>& one_sigma_rigs) {
  const double middle = constant_of(instrument, view).mean();
  instrument::Instrument other = instrument;
  double variance = 0.0;
  for (const CalibratedRig& moved : one_sigma_rigs) {
    other.rig = moved.rig;
    other.camera = moved.camera;
    variance += std::pow(constant_of(other, view).mean() / middle - 1.0, 2);
  }
  return std::sqrt(variance);
}

/// The monitor follows the lamp: what is far from the constant that the fields were found with was
/// not the white.
void require_as_fields(double with_fields, double now) {
  constexpr double kMaxApart = 0.1;
  if (!(with_fields > 0.0) || std::abs(now / with_fields - 1.0) <= kMaxApart) return;
  throw StepRefused(fmt::format(
      "found an instrument constant {:.3g} times that of flat_field, expected within {:.0f} %: is "
      "the white mounted, clean and lit? If lamp, lens or monitor are others, take flat_field "
      "again",
      now / with_fields, 100.0 * kMaxApart));
}

std::array<double, 3> constant_then(const Observations& seen) {
  if (!seen.constant) {
    throw StepRefused("found no constants of the white beside what was seen, expected its day's");
  }
  return *seen.constant;
}

}  // namespace

void evaluate_flat_field(const Observations& seen, const Known& known, Findings& findings,
                         ResultBuilder& result) {
  const FieldFit found =
      fit_fields(known.instrument, seen.whites, one_sigma_rigs_after(findings, seen.homing));
  findings.fields = found;
  std::vector<ResultBuilder::Named> parameters;
  for (std::size_t channel = 0; channel < kChannelNames.size(); ++channel) {
    if (!(found.constant[channel] > 0.0)) continue;
    parameters.push_back({std::string("fields.ln_constant_") + kChannelNames[channel], "",
                          std::log(found.constant[channel])});
  }
  const auto& field = found.lamp_field;
  const auto& lens = found.vignetting;
  for (const auto& [name, value] :
       std::initializer_list<std::pair<const char*, double>>{{"lamp_field.c10", field.c10},
                                                             {"lamp_field.c01", field.c01},
                                                             {"lamp_field.c20", field.c20},
                                                             {"lamp_field.c11", field.c11},
                                                             {"lamp_field.c02", field.c02},
                                                             {"vignetting.v1", lens.v1},
                                                             {"vignetting.v2", lens.v2},
                                                             {"vignetting.v3", lens.v3}}) {
    parameters.push_back({name, "", value});
  }
  result.block(parameters, found.covariance);
  result.residual("rms", found.residual_rms);
  result.residual("field_sigma", found.field_sigma);
  result.residual("chi2_per_dof", found.chi2_per_dof);
  result.check("residual of the fields (relative)", found.residual_rms, kMaxFieldResidual);
}

void evaluate_stray_light(const Observations& seen, const Known& known, Findings& findings,
                          ResultBuilder& result) {
  const StrayLight found =
      stray_light(known.instrument, constant_then(seen), seen.whites, kMaxStray);
  findings.stray = found;
  result.parameter("stray.fraction", "", {found.fraction, found.sigma});
  result.residual("spread", found.spread);
  result.check("stray light (of a white)", found.worst_fraction, kMaxStray);
}

void evaluate_white(const Observations& seen, const Known& known, Findings& findings,
                    ResultBuilder& result) {
  require_white_views(known.instrument, seen.whites);
  WhiteConstant white;
  // The fields are 1 on their axes, the reference is seen and lit beside them.
  const double shape = findings.fields.value().field_sigma;
  const double geometry = geometry_sigma(known.instrument, seen.whites.front(),
                                         one_sigma_rigs_after(findings, seen.homing));
  std::array<std::vector<ChannelMean>, 3> takes;
  for (const WhiteView& view : seen.whites) {
    takes[static_cast<std::size_t>(view.channel)].push_back(constant_of(known.instrument, view));
  }
  for (std::size_t channel = 0; channel < takes.size(); ++channel) {
    ChannelMean all;
    double lowest = 0.0;
    double highest = 0.0;
    for (const ChannelMean& take : takes[channel]) {
      all.sum += take.sum;
      all.weight += take.weight;
      lowest = lowest == 0.0 ? take.mean() : std::min(lowest, take.mean());
      highest = std::max(highest, take.mean());
    }
    if (!(all.weight > 0.0)) continue;
    white.constant[channel] = all.mean();
    require_as_fields(findings.fields->constant[channel], all.mean());
    const double noise = 1.0 / std::sqrt(all.weight) / all.mean();
    const double drift = findings.lamp ? findings.lamp->sigma : 0.0;
    const double common = std::hypot(shape, geometry);
    white.relative_sigma[channel] = std::hypot(noise, drift, common);
    white.disagreement = std::max(white.disagreement, highest / lowest - 1.0);
    result.parameter(
        std::string("white.constant_") + kChannelNames[channel], "DN/s mm2 sr per unit of monitor",
        {white.constant[channel], white.constant[channel] * white.relative_sigma[channel]});
  }
  findings.white = white;
  result.residual("certificate_relative_sigma", known.instrument.white.u_relative);
  result.check("repeat of the white (relative)", white.disagreement, kMaxRepeat);
}

void evaluate_colour(const Observations& seen, const Known& known, Findings& findings,
                     ResultBuilder& result) {
  const std::vector<Eigen::Vector3d>& chart = seen.chart;
  if (chart.empty()) {
    result.note(known.settings.chart.linear_srgb.empty()
                    ? "no colour chart is given: the matrix is unity"
                    : "the lamp has fewer than three channels: the matrix is unity");
    findings.colour = ColourMatrix{};
    return;
  }
  std::vector<ChartPatch> patches(chart.size());
  const std::array<double, 3> constant = constant_then(seen);
  for (const WhiteView& view : seen.whites) {
    const rig::RigPose pose = rig::forward(known.instrument.rig, view.joints);
    if (view.pixels.size() != patches.size()) {
      throw StepRefused("colour chart: found another number of patches than its certificate has");
    }
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const PixelSignal& pixel = view.pixels[i];
      const auto geometry =
          instrument::pixel_geometry(known.instrument, pose, pixel.column, pixel.row);
      if (!geometry) throw StepRefused("colour chart: found a patch that the camera does not see");
      const auto channel = static_cast<std::size_t>(view.channel);
      patches[i].camera[view.channel] =
          std::numbers::pi * pixel.dn_per_s / (constant[channel] * view.monitor * geometry->factor);
      patches[i].target = chart[i];
    }
  }
  const Eigen::Vector3d white = known.instrument.white.reflectance.matrix();
  findings.colour = fit_colour_matrix(patches, white, white, kMaxDeltaE);
  const Eigen::Matrix3d& matrix = findings.colour->matrix;
  // From what the patches are off by; the white, which is kept, would make it a little smaller.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d square = Eigen::Vector3d::Zero();
  for (const ChartPatch& patch : patches) {
    normal += patch.camera * patch.camera.transpose();
    square += (matrix * patch.camera - patch.target).cwiseAbs2();
  }
  const double degrees = std::max(1.0, static_cast<double>(patches.size()) - 3.0);
  for (int row = 0; row < 3; ++row) {
    std::vector<ResultBuilder::Named> parameters;
    for (int column = 0; column < 3; ++column) {
      parameters.push_back(
          {"colour.m" + std::to_string(row) + std::to_string(column), "", matrix(row, column)});
    }
    result.block(parameters, square[row] / degrees * normal.inverse());
  }
  result.residual("max_delta_e", findings.colour->max_delta_e);
  result.check("mean CIEDE2000 of the chart", findings.colour->mean_delta_e, kMaxDeltaE);
}

void evaluate_verification(const Observations& seen, const Known& known, Findings& findings,
                           ResultBuilder& result) {
  VerificationData data;
  data.constant = findings.white.value().constant;
  data.white = seen.whites;
  data.white_half_width_mm = known.settings.target_half_width_mm;
  data.unseen = seen.unseen;
  if (!seen.glasses.empty()) {
    try {
      data.ratios = glass_ratios(known.instrument, seen.glasses, known.settings.black_glass_index);
    } catch (const StepRefused& refused) {
      data.unseen.emplace_back(refused.what());  // what the white and the mirror say comes first
    }
  }
  const geometry::LampArm& lamp = findings.lamp_arm.value();
  const Eigen::Vector2d tilt(lamp.mirror_tilt_x.radians(), lamp.mirror_tilt_y.radians());
  for (const geometry::MirrorView& view : seen.mirrors) {
    // As if the mirror lay flat in its mount: how it leans was found with the lamp's arm.
    const auto leaning = image_in_mirror(known.instrument, view.joints, tilt);
    const auto flat = image_in_mirror(known.instrument, view.joints, Eigen::Vector2d::Zero());
    if (!leaning || !flat) continue;
    data.mirror.push_back({view.joints, view.pixel - (*leaning - *flat)});
  }
  const Verification found = verify(known.instrument, data);
  findings.verification = found;
  for (const instrument::AcceptanceCheck& check : found.checks) result.check(check);
  result.residual("explained", found.explained);
  if (!found.passed) result.note("likely cause: " + found.explanation);
  const bool exchanged = std::any_of(found.checks.begin(), found.checks.end(),
                                     [](const instrument::AcceptanceCheck& check) {
                                       return check.name.find("reciprocity") != std::string::npos;
                                     });
  if (!exchanged) {
    result.note("reciprocity was not looked at: no two poses have light and camera exchanged");
  }
}

}  // namespace gonio::calibration::routine
