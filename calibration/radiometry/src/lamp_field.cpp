#include "gonio/calibration/radiometry/lamp_field.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration {
namespace {

constexpr int kFieldTerms = 5;
constexpr int kLensTerms = 3;
// What lenses are like before anything is seen: cos^4 has -2, 3 and -4. Without it the higher
// terms, of which a target far smaller than the picture shows nothing, would be noise, and the
// falloff beyond the target with them.
constexpr std::array<double, kLensTerms> kLensSpread{5.0, 10.0, 30.0};
constexpr int kMaxIterations = 50;
constexpr double kSmallStep = 1e-9;
// Ratio of the singular values of the scaled Jacobian beyond which numbers mean nothing.
constexpr double kMaxCondition = 1e8;
constexpr const char* kAddViews =
    "expected several arm angles and tilts, the white filling the picture: add views";

/// Channels that were seen: the column of the ln C of each, or -1, and how many there are.
struct Channels {
  std::array<Eigen::Index, 3> column{-1, -1, -1};
  Eigen::Index count = 0;
};

Channels channels_of(const std::vector<WhiteView>& views) {
  Channels channels;
  for (std::size_t c = 0; c < channels.column.size(); ++c) {
    const bool seen = std::any_of(views.begin(), views.end(), [&](const WhiteView& view) {
      return view.channel == static_cast<int>(c);
    });
    if (seen) channels.column[c] = channels.count++;
  }
  return channels;
}

/// One pixel: what is known of it before the fit.
struct Row {
  std::size_t view;
  std::size_t pose;       ///< the same for the colours of one pose
  Eigen::Index constant;  ///< column of its channel's ln C
  double log_signal;      ///< ln of the signal over everything but C, V and I
  double sigma;           ///< of it
  Eigen::Matrix<double, kFieldTerms, 1> field;
  Eigen::Matrix<double, kLensTerms, 1> lens;
};

/// For every view the index of its pose, which views in other colours share.
std::vector<std::size_t> poses_of(const std::vector<WhiteView>& views) {
  std::vector<std::size_t> first;  // view of every pose
  std::vector<std::size_t> pose;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto same = std::find_if(first.begin(), first.end(), [&](std::size_t other) {
      return views[other].joints == views[v].joints;
    });
    pose.push_back(static_cast<std::size_t>(same - first.begin()));
    if (same == first.end()) first.push_back(v);
  }
  return pose;
}

std::vector<Row> rows_of(const instrument::Instrument& instrument,
                         const std::vector<WhiteView>& views,
                         const std::array<Eigen::Index, 3>& column_of_channel) {
  instrument::Instrument flat = instrument;
  flat.lamp_field = {};
  flat.vignetting = {};
  const std::vector<std::size_t> pose_of_view = poses_of(views);
  std::vector<Row> rows;
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (const PixelSignal& pixel : views[v].pixels) {
      if (!(pixel.dn_per_s > 0.0)) {
        throw StepRefused(fmt::format(
            "view {}: found {:g} DN/s at pixel ({:.1f}, {:.1f}), expected light from the white: is "
            "the lamp on?",
            v, pixel.dn_per_s, pixel.column, pixel.row));
      }
      const auto factor = white_factor(flat, views[v], pixel);
      if (!factor) {
        throw StepRefused(fmt::format(
            "view {}: found no lit front of the sample plane at pixel ({:.1f}, {:.1f}), expected "
            "the white: are the axes where they say?",
            v, pixel.column, pixel.row));
      }
      const double x = factor->lamp_x;
      const double y = factor->lamp_y;
      const double q = factor->camera_q;
      Row row{v,
              pose_of_view[v],
              column_of_channel[static_cast<std::size_t>(views[v].channel)],
              std::log(pixel.dn_per_s / factor->per_constant),
              pixel.sigma_dn_per_s / pixel.dn_per_s,
              {},
              {}};
      row.field << x, y, x * x, x * y, y * y;
      row.lens << q, q * q, q * q * q;
      rows.push_back(row);
    }
  }
  return rows;
}

struct System {
  Eigen::MatrixXd jacobian;  ///< whitened
  Eigen::VectorXd residual;  ///< whitened
};

System linearise(const std::vector<Row>& rows, const Eigen::VectorXd& parameters,
                 Eigen::Index channels) {
  const Eigen::VectorXd field = parameters.segment(channels, kFieldTerms);
  const Eigen::VectorXd lens = parameters.tail(kLensTerms);
  const auto pixels = static_cast<Eigen::Index>(rows.size());
  System system{Eigen::MatrixXd::Zero(pixels + kLensTerms, parameters.size()),
                Eigen::VectorXd(pixels + kLensTerms)};
  for (Eigen::Index term = 0; term < kLensTerms; ++term) {
    const double spread = kLensSpread[static_cast<std::size_t>(term)];
    system.residual[pixels + term] = -lens[term] / spread;
    system.jacobian(pixels + term, channels + kFieldTerms + term) = 1.0 / spread;
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    const double intensity = 1.0 + field.dot(row.field);
    const double response = 1.0 + lens.dot(row.lens);
    if (!(intensity > 0.0) || !(response > 0.0)) {
      throw StepRefused(fmt::format(
          "view {}: the fitted lamp field or falloff is not positive there; expected a smooth "
          "field: is something in the light's way?",
          row.view));
    }
    const auto at = static_cast<Eigen::Index>(i);
    system.residual[at] =
        (row.log_signal - parameters[row.constant] - std::log(intensity) - std::log(response)) /
        row.sigma;
    system.jacobian(at, row.constant) = 1.0 / row.sigma;
    system.jacobian.row(at).segment(channels, kFieldTerms) =
        row.field.transpose() / (intensity * row.sigma);
    system.jacobian.row(at).tail(kLensTerms) = row.lens.transpose() / (response * row.sigma);
  }
  return system;
}

/// With columns scaled to one length, so that units do not count.
Eigen::JacobiSVD<Eigen::MatrixXd> decompose(const Eigen::MatrixXd& jacobian,
                                            Eigen::VectorXd& scale) {
  scale = jacobian.colwise().norm().transpose();
  if ((scale.array() <= 0.0).any()) {
    throw StepRefused(
        "views that hold no light off the lamp's or the camera's axis, expected the whole white");
  }
  return Eigen::JacobiSVD<Eigen::MatrixXd>(jacobian * scale.cwiseInverse().asDiagonal(),
                                           Eigen::ComputeThinU | Eigen::ComputeThinV);
}

/// Largest relative sd of the lens' falloff at the pixels seen.
double falloff_sigma(const Eigen::MatrixXd& whitened_jacobian, const std::vector<Row>& rows,
                     const Eigen::MatrixXd& covariance) {
  const Eigen::MatrixXd lens = covariance.bottomRightCorner(kLensTerms, kLensTerms);
  double largest = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::VectorXd gradient =
        whitened_jacobian.row(static_cast<Eigen::Index>(i)).tail(kLensTerms).transpose() *
        rows[i].sigma;
    largest = std::max(largest, gradient.dot(lens * gradient));
  }
  return std::sqrt(largest);
}

/// Weighted means over each view or pose of relative residuals, and their sds by the pixels' noise.
struct GroupMeans {
  std::vector<double> mean;
  std::vector<double> sigma;  ///< 0: nothing was seen
};

/// `group`  &Row::view or &Row::pose.
GroupMeans means_of(const Eigen::VectorXd& whitened, const std::vector<Row>& rows,
                    std::size_t Row::*group) {
  std::size_t groups = 0;
  for (const Row& row : rows) groups = std::max(groups, row.*group + 1);
  std::vector<double> weight(groups, 0.0);
  std::vector<double> sum(groups, 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double per_sigma = 1.0 / rows[i].sigma;
    weight[rows[i].*group] += per_sigma * per_sigma;
    sum[rows[i].*group] += whitened[static_cast<Eigen::Index>(i)] * per_sigma;
  }
  GroupMeans means{std::vector<double>(groups, 0.0), std::vector<double>(groups, 0.0)};
  for (std::size_t g = 0; g < groups; ++g) {
    if (!(weight[g] > 0.0)) continue;
    means.mean[g] = sum[g] / weight[g];
    means.sigma[g] = 1.0 / std::sqrt(weight[g]);
  }
  return means;
}

/// How the fit follows the geometry.
struct FollowedGeometry {
  Eigen::MatrixXd covariance;  ///< of the parameters
  double squares = 0.0;        ///< of the poses' means, summed: what of it no parameter can follow
};

FollowedGeometry follow_geometry(const instrument::Instrument& instrument,
                                 const std::vector<WhiteView>& views, const Channels& channels,
                                 const std::vector<CalibratedRig>& one_sigma_rigs,
                                 const Eigen::VectorXd& parameters, const System& here,
                                 const Eigen::MatrixXd& normal_inverse) {
  const Eigen::Index count = parameters.size();
  FollowedGeometry followed{Eigen::MatrixXd::Zero(count, count), 0.0};
  instrument::Instrument with = instrument;
  for (const CalibratedRig& other : one_sigma_rigs) {
    with.rig = other.rig;
    with.camera = other.camera;
    const std::vector<Row> rows = rows_of(with, views, channels.column);
    const Eigen::VectorXd change =
        linearise(rows, parameters, channels.count).residual - here.residual;
    const Eigen::VectorXd moved = normal_inverse * here.jacobian.transpose() * change;
    followed.covariance += moved * moved.transpose();
    for (const double mean : means_of(change - here.jacobian * moved, rows, &Row::pose).mean) {
      followed.squares += mean * mean;
    }
  }
  return followed;
}

/// What all rows of a group are off by together, as it shows in the groups' mean residuals beyond
/// the pixels' noise and `known_squares`, carried into the parameters. The fit takes `fitted` of
/// the means.
Eigen::MatrixXd shared_by(std::size_t Row::*group, const GroupMeans& means, const System& system,
                          const std::vector<Row>& rows, Eigen::Index fitted,
                          const Eigen::MatrixXd& normal_inverse, double known_squares) {
  Eigen::MatrixXd by_group =
      Eigen::MatrixXd::Zero(system.jacobian.cols(), static_cast<Eigen::Index>(means.mean.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    by_group.col(static_cast<Eigen::Index>(rows[i].*group)) +=
        system.jacobian.row(static_cast<Eigen::Index>(i)).transpose() / rows[i].sigma;
  }
  double squares = 0.0;
  double noise = 0.0;
  double used = 0.0;
  for (std::size_t g = 0; g < means.mean.size(); ++g) {
    if (!(means.sigma[g] > 0.0)) continue;
    squares += means.mean[g] * means.mean[g];
    noise += means.sigma[g] * means.sigma[g];
    used += 1.0;
  }
  const double free = std::max(1.0, used - static_cast<double>(fitted));
  const double variance =
      std::max(0.0, (squares - known_squares) / free - noise / std::max(1.0, used));
  return variance * normal_inverse * by_group * by_group.transpose() * normal_inverse;
}

/// What pixels are off by together: those of a pose in all colours (where the axes stand, what the
/// white's table is off by there), and beyond that those of a view (the lamp, its monitor). Fields
/// are seen within a view; of the means the constants take most.
Eigen::MatrixXd shared_by_views(const System& system, const std::vector<Row>& rows,
                                Eigen::Index channels, const Eigen::MatrixXd& normal_inverse,
                                double geometry_squares) {
  const GroupMeans poses = means_of(system.residual, rows, &Row::pose);
  GroupMeans within = means_of(system.residual, rows, &Row::view);
  std::vector<bool> done(within.mean.size(), false);
  for (const Row& row : rows) {
    if (done[row.view]) continue;
    within.mean[row.view] -= poses.mean[row.pose];
    done[row.view] = true;
  }
  const auto means_within = static_cast<Eigen::Index>(poses.mean.size()) + channels - 1;
  return shared_by(&Row::pose, poses, system, rows, 1, normal_inverse, geometry_squares) +
         shared_by(&Row::view, within, system, rows, means_within, normal_inverse, 0.0);
}

/// Relative sd of field times falloff, rms over the pixels.
double field_sigma(const Eigen::MatrixXd& whitened_jacobian, const std::vector<Row>& rows,
                   const Eigen::MatrixXd& covariance) {
  constexpr Eigen::Index kTerms = kFieldTerms + kLensTerms;
  const Eigen::MatrixXd fields = covariance.bottomRightCorner(kTerms, kTerms);
  double squares = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::VectorXd gradient =
        whitened_jacobian.row(static_cast<Eigen::Index>(i)).tail(kTerms).transpose() *
        rows[i].sigma;
    squares += gradient.dot(fields * gradient);
  }
  return std::sqrt(squares / static_cast<double>(rows.size()));
}

void refuse_large_residual(const std::vector<Row>& rows, const Eigen::VectorXd& relative,
                           std::size_t views, double rms, double limit) {
  std::vector<double> sum(views, 0.0);
  std::vector<double> count(views, 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double value = relative[static_cast<Eigen::Index>(i)];
    sum[rows[i].view] += value * value;
    count[rows[i].view] += 1.0;
  }
  std::size_t worst = 0;
  for (std::size_t v = 1; v < views; ++v) {
    if (sum[v] / count[v] > sum[worst] / count[worst]) worst = v;
  }
  throw StepRefused(fmt::format(
      "found a residual of {:.2f} % rms, expected at most {:.2f} %; view {} has {:.2f} %: is the "
      "white clean, flat and wholly lit there?",
      100.0 * rms, 100.0 * limit, worst, 100.0 * std::sqrt(sum[worst] / count[worst])));
}

}  // namespace

FieldFit fit_fields(const instrument::Instrument& instrument, const std::vector<WhiteView>& views,
                    const std::vector<CalibratedRig>& one_sigma_rigs, double limit) {
  require_white_views(instrument, views);
  const Channels seen = channels_of(views);
  const auto& [column_of_channel, channels] = seen;
  const std::vector<Row> rows = rows_of(instrument, views, column_of_channel);
  const Eigen::Index count = channels + kFieldTerms + kLensTerms;
  const auto samples = static_cast<Eigen::Index>(rows.size());
  if (samples < 2 * count) {
    throw StepRefused(fmt::format("found {} pixels, expected at least {}", samples, 2 * count));
  }

  FieldFit fit;
  Eigen::VectorXd parameters = Eigen::VectorXd::Zero(count);
  Eigen::VectorXd scale;
  System system;
  Eigen::MatrixXd normal_inverse;
  for (;;) {
    system = linearise(rows, parameters, channels);
    const auto svd = decompose(system.jacobian, scale);
    const auto& values = svd.singularValues();
    if (!(values[count - 1] * kMaxCondition > values[0])) {
      throw StepRefused(fmt::format(
          "found views that cannot tell the lamp's field from the lens' falloff, {}", kAddViews));
    }
    const Eigen::MatrixXd half =
        scale.cwiseInverse().asDiagonal() * svd.matrixV() * values.cwiseInverse().asDiagonal();
    normal_inverse = half * half.transpose();
    const Eigen::VectorXd step = half * (svd.matrixU().transpose() * system.residual);
    if ((step.array() * scale.array()).matrix().norm() <=
            kSmallStep * (1.0 + system.residual.norm()) ||
        ++fit.iterations > kMaxIterations) {
      break;
    }
    parameters += step;
  }
  if (fit.iterations > kMaxIterations) {
    throw StepRefused(fmt::format("the fit has not settled after {} steps, expected a smooth field",
                                  kMaxIterations));
  }

  Eigen::VectorXd relative = system.residual.head(samples);
  for (Eigen::Index i = 0; i < samples; ++i) relative[i] *= rows[static_cast<std::size_t>(i)].sigma;
  fit.residual_rms = std::sqrt(relative.squaredNorm() / static_cast<double>(samples - count));
  fit.chi2_per_dof =
      system.residual.head(samples).squaredNorm() / static_cast<double>(samples - count);
  if (!(fit.residual_rms <= limit)) {
    refuse_large_residual(rows, relative, views.size(), fit.residual_rms, limit);
  }
  const FollowedGeometry geometry =
      follow_geometry(instrument, views, seen, one_sigma_rigs, parameters, system, normal_inverse);
  fit.covariance = normal_inverse * std::max(1.0, fit.chi2_per_dof) + geometry.covariance +
                   shared_by_views(system, rows, channels, normal_inverse, geometry.squares);
  fit.field_sigma = field_sigma(system.jacobian, rows, fit.covariance);
  if (const double sigma = falloff_sigma(system.jacobian, rows, fit.covariance); sigma > limit) {
    throw StepRefused(
        fmt::format("found views that cannot tell the lamp's field from the lens' falloff better "
                    "than {:.1f} %, {}",
                    100.0 * sigma, kAddViews));
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const Eigen::Index at = column_of_channel[c];
    if (at < 0) continue;
    fit.constant[c] = std::exp(parameters[at]);
  }
  fit.lamp_field = {parameters[channels], parameters[channels + 1], parameters[channels + 2],
                    parameters[channels + 3], parameters[channels + 4]};
  fit.vignetting = {parameters[count - 3], parameters[count - 2], parameters[count - 1]};
  return fit;
}

}  // namespace gonio::calibration
