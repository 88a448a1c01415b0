#include "gonio/acquisition/reduction.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "gonio/acquisition/session.h"
#include "gonio/acquisition/trust_notes.h"
#include "gonio/errors/errors.h"
#include "gonio/instrument/measurement_equation.h"
#include "merged_frames.h"
#include "pair_agreement.h"
#include "white_level.h"

namespace gonio::acquisition {
namespace {

/// A spot whose value is below this many of its sigmas is marked dark.
constexpr double kDarkSigmas = 3.0;

/// One pixel inside a spot.
struct SpotPixel {
  std::size_t index;
  int column;
  int row;
  instrument::PixelGeometry geometry;
};

struct Spot {
  std::vector<SpotPixel> pixels;
  double expected_pixels = 0.0;  ///< that a whole spot would have
};

/// Frames of one point.
struct FramesOfPoint {
  std::size_t part = 0;
  std::map<std::string, std::vector<const FrameRecord*>> lit;
  const FrameRecord* lamp_off = nullptr;
};

/// Frames of the points that ended as measured; the others are named in `warnings`. Of a point that
/// was measured again after a kill, the last time counts.
std::map<int, FramesOfPoint> frames_of_measured_points(const SessionReader& archive,
                                                       const SessionParts& parts,
                                                       std::vector<std::string>& warnings) {
  /// When the point's last row lies, and the one before.
  struct Span {
    std::chrono::nanoseconds after{-1};
    std::chrono::nanoseconds until{-1};
  };
  std::map<int, PointOutcome> outcomes;
  std::map<int, std::size_t> part_of_point;
  std::map<int, Span> spans;
  for (const PointRecord& point : archive.points()) {
    outcomes[point.point] = point.outcome;
    part_of_point[point.point] = parts.of(point);
    Span& span = spans[point.point];
    span = {span.until, point.finished_at};
  }
  std::map<int, FramesOfPoint> points;
  std::set<int> left_out;
  for (const FrameRecord& record : archive.frames()) {
    if (record.point < 0) continue;
    const auto outcome = outcomes.find(record.point);
    if (outcome == outcomes.end() || outcome->second != PointOutcome::Measured) {
      if (left_out.insert(record.point).second) {
        warnings.push_back(
            fmt::format("point {}: {}, left out", record.point,
                        outcome == outcomes.end() ? "never finished" : to_string(outcome->second)));
      }
      continue;
    }
    if (parts.of(record) != part_of_point[record.point]) continue;
    // A suspect was measured again in the same part.
    const Span& span = spans[record.point];
    if (record.exposure_start < span.after || record.exposure_start > span.until) continue;
    FramesOfPoint& frames = points[record.point];
    frames.part = parts.of(record);
    if (record.kind == FrameKind::sample) frames.lit[record.channel].push_back(&record);
    if (record.kind == FrameKind::lamp_off) frames.lamp_off = &record;
  }
  for (const auto& [point, outcome] : outcomes) {
    if (outcome != PointOutcome::Measured || points.contains(point)) continue;
    warnings.push_back(fmt::format("point {}: its row has no frames, left out", point));
  }
  return points;
}

/// Centres of the grid over the usable sample; one spot lies in the middle.
std::vector<Eigen::Vector2d> spot_centres(const ReductionOptions& options) {
  std::vector<Eigen::Vector2d> centres;
  const double reach =
      options.sample_half_width_mm - options.edge_margin_mm - options.spot_half_width_mm;
  const auto place = [&](int i) {
    return options.grid == 1 ? 0.0 : reach * (2.0 * i / (options.grid - 1) - 1.0);
  };
  for (int row = 0; row < options.grid; ++row) {
    for (int column = 0; column < options.grid; ++column) {
      centres.emplace_back(place(column), place(row));
    }
  }
  return centres;
}

/// The good pixels of a square of the sample plane; `bad_pixels` as bad_pixel_mask().
Spot spot_at(const instrument::Instrument& instrument, const rig::RigPose& pose,
             const Eigen::Vector2d& centre_mm, double half_width_mm,
             const std::vector<std::uint8_t>& bad_pixels) {
  Spot spot;
  double first_column = 1e9, last_column = -1e9, first_row = 1e9, last_row = -1e9;
  std::vector<Eigen::Vector2d> corners;
  for (const auto& [sx, sy] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    const Eigen::Vector2d corner = centre_mm + half_width_mm * Eigen::Vector2d(sx, sy);
    const auto pixel = instrument::pixel_of_point(instrument, pose, {corner.x(), corner.y(), 0.0});
    if (!pixel) return spot;
    corners.push_back(*pixel);
    first_column = std::min(first_column, pixel->x());
    last_column = std::max(last_column, pixel->x());
    first_row = std::min(first_row, pixel->y());
    last_row = std::max(last_row, pixel->y());
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {  // shoelace
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d& b = corners[(i + 1) % corners.size()];
    spot.expected_pixels += 0.5 * (a.x() * b.y() - b.x() * a.y());
  }
  spot.expected_pixels = std::abs(spot.expected_pixels);
  const int width = instrument.camera.width_px;
  // Clamped first: a point beside the camera may have a pixel beyond any whole number.
  const auto whole = [](double pixel, int size_px) {
    return static_cast<int>(std::clamp(pixel, -1.0, static_cast<double>(size_px)));
  };
  const int height = instrument.camera.height_px;
  const int from_row = std::max(0, whole(std::floor(first_row), height));
  const int to_row = std::min(height - 1, whole(std::ceil(last_row), height));
  const int from_column = std::max(0, whole(std::floor(first_column), width));
  const int to_column = std::min(width - 1, whole(std::ceil(last_column), width));
  for (int row = from_row; row <= to_row; ++row) {
    for (int column = from_column; column <= to_column; ++column) {
      const std::size_t index = static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(column);
      if (bad_pixels[index] != 0) continue;
      auto geometry = instrument::pixel_geometry(instrument, pose, column, row);
      if (!geometry) continue;
      const Eigen::Vector2d offset = geometry->point_in_sample_mm.head<2>() - centre_mm;
      if (offset.cwiseAbs().maxCoeff() > half_width_mm) continue;
      spot.pixels.push_back({index, column, row, std::move(*geometry)});
    }
  }
  return spot;
}

/// Mean direction of a spot and how far theta_h spreads over it.
void set_direction(const Spot& spot, samples::Sample& sample) {
  Eigen::Vector3d wi = Eigen::Vector3d::Zero();
  Eigen::Vector3d wo = Eigen::Vector3d::Zero();
  for (const SpotPixel& pixel : spot.pixels) {
    wi += pixel.geometry.directions.wi;
    wo += pixel.geometry.directions.wo;
  }
  sample.direction = brdf::half_diff_from_directions({wi.normalized(), wo.normalized()});
  double sum = 0.0;
  double sum_of_squares = 0.0;
  for (const SpotPixel& pixel : spot.pixels) {
    const double theta_h =
        brdf::half_diff_from_directions(pixel.geometry.directions).theta_h.radians();
    sum += theta_h;
    sum_of_squares += theta_h * theta_h;
  }
  const auto count = static_cast<double>(spot.pixels.size());
  const double mean = sum / count;
  sample.kernel =
      Angle::from_radians(std::sqrt(std::max(0.0, sum_of_squares / count - mean * mean)));
}

void add_flag(samples::Sample& sample, const char* flag) {
  if (sample.flags.find(flag) != std::string::npos) return;
  sample.flags += (sample.flags.empty() ? "" : ";") + std::string(flag);
}

}  // namespace

void ReductionOptions::validate() const {
  const auto require = [](bool ok, const char* field, double value, const char* expected) {
    if (!ok) {
      throw std::invalid_argument(
          fmt::format("reduction: {} is {}, expected {}", field, value, expected));
    }
  };
  require(grid >= 1 && grid <= 99, "grid", grid, "1 to 99");
  require(spot_half_width_mm > 0.0, "spot_half_width_mm", spot_half_width_mm, "above 0");
  require(edge_margin_mm >= 0.0, "edge_margin_mm", edge_margin_mm, "0 or more");
  require(sample_half_width_mm > edge_margin_mm + spot_half_width_mm, "sample_half_width_mm",
          sample_half_width_mm, "more than edge_margin_mm + spot_half_width_mm");
  require(min_usable_fraction > 0.0 && min_usable_fraction <= 1.0, "min_usable_fraction",
          min_usable_fraction, "above 0, at most 1");
  const double white_mm = white_half_width_mm.value_or(sample_half_width_mm);
  require(white_mm > edge_margin_mm, "white_half_width_mm", white_mm, "more than edge_margin_mm");
  require(white_patch_half_width_mm > 0.0, "white_patch_half_width_mm", white_patch_half_width_mm,
          "above 0");
}

void set_geometry(const SessionOptions& session, ReductionOptions& options) {
  options.sample_half_width_mm = session.sample_half_width_mm;
  options.edge_margin_mm = session.edge_margin_mm;
  options.spot_half_width_mm = session.spot_half_width_mm;
  options.white_half_width_mm = session.white_half_width_mm;
  options.white_in_frame = session.white == WhitePlacement::in_frame;
  options.white_patch_mm = session.white_patch_mm;
  options.white_patch_half_width_mm = session.white_patch_half_width_mm;
}

Reduction reduce(const SessionReader& archive, const instrument::Instrument& instrument,
                 const ReductionOptions& options) {
  options.validate();
  Reduction reduction;
  reduction.samples.scale = brdf::RadiometricScale::si;
  reduction.warnings = archive.damage();
  const std::filesystem::path place = archive.folder();
  require_of_instrument(archive, instrument);
  const ColourLayout colours(archive, place);
  const SessionParts parts(archive);
  const std::vector<MeanDark> darks = mean_darks(archive, parts, instrument);
  const std::set<std::string> monitored = monitored_channels(archive);
  const WhiteLevel white =
      white_level(archive, instrument, options, colours, parts, darks, monitored);
  reduction.warnings.insert(reduction.warnings.end(), white.warnings.begin(), white.warnings.end());
  if (white.visits.size() > 1) reduction.white_drift_relative = white.drift();
  if (std::abs(white.drift()) > kUsualDrift) {
    reduction.warnings.push_back(
        fmt::format("white drift: the closing white is {:+.1f} % off the opening one, expected "
                    "within {:g} %; lamp or camera changed during the session",
                    100.0 * white.drift(), 100.0 * kUsualDrift));
  }
  const std::vector<std::uint8_t> bad_pixels = instrument::bad_pixel_mask(
      instrument.sensor, instrument.camera.width_px, instrument.camera.height_px);
  reduction.bridges = white.bridges;
  for (const PartBridge& bridge : white.bridges) {
    if (bridge.is_applied() || bridge.is_refused()) reduction.warnings.push_back(to_text(bridge));
  }
  const std::map<int, std::string> suspects = suspect_points(archive);
  for (const auto& [point, why] : suspects) {
    reduction.warnings.push_back(fmt::format("point {}: suspect: {}", point, why));
  }
  std::vector<int> unjudged = unjudged_points(archive);
  std::erase_if(unjudged, [&](int point) { return suspects.contains(point); });
  if (!unjudged.empty()) {
    reduction.warnings.push_back(fmt::format(
        "points {}: an axis that was homed after them could not tell whether it had been in order",
        fmt::join(unjudged, " ")));
  }
  const double u_drift = white.u_unseen();
  std::vector<int> without_level;

  for (const auto& [index, frames] :
       frames_of_measured_points(archive, parts, reduction.warnings)) {
    if (frames.lit.size() != colours.channels().size()) {
      reduction.warnings.push_back(fmt::format("point {}: {} of {} channels were taken, left out",
                                               index, frames.lit.size(),
                                               colours.channels().size()));
      continue;
    }
    const BackgroundMaps background =
        background_maps(archive, instrument.sensor, darks[frames.part], frames.lamp_off);
    std::vector<ChannelSignal> signals;
    for (const std::string& channel : colours.channels()) {
      signals.push_back(
          merge_frames(archive, instrument, frames.lit.at(channel), background, monitored));
    }
    if (std::any_of(signals.begin(), signals.end(),
                    [](const ChannelSignal& signal) { return signal.monitor_failed; })) {
      reduction.warnings.push_back(
          fmt::format("point {}: the lamp monitor read nothing, left out", index));
      continue;
    }
    const bool unbridged = white.is_unbridged(frames.part);
    if (unbridged && !white.has_white(frames.part)) without_level.push_back(index);
    const rig::RigPose pose =
        rig::forward(instrument.rig, frames.lit.begin()->second.front()->joints);
    int dropped = 0;
    int number = 0;
    for (const Eigen::Vector2d& centre : spot_centres(options)) {
      const Spot spot = spot_at(instrument, pose, centre, options.spot_half_width_mm, bad_pixels);
      samples::Sample sample;
      sample.pose = index;
      sample.spot = number++;
      bool usable = static_cast<double>(spot.pixels.size()) >=
                        options.min_usable_fraction * spot.expected_pixels &&
                    !spot.pixels.empty();
      for (int colour = 0; colour < 3 && usable; ++colour) {
        const ChannelSignal& signal = signals[colours.channel_of(colour)];
        double sum = 0.0, variance = 0.0, factor = 0.0, stray_factor = 0.0;
        std::size_t used = 0, bad = 0;
        for (const SpotPixel& pixel : spot.pixels) {
          if (!ColourLayout::carries(signal.pixel_format, pixel.column, pixel.row, colour))
            continue;
          if (signal.merged.state[pixel.index] != instrument::PixelState::measured) {
            ++bad;
            continue;
          }
          sum += signal.merged.dn_per_s[pixel.index];
          variance += signal.merged.variance[pixel.index];
          factor += pixel.geometry.factor;
          stray_factor += pixel.geometry.stray_factor;
          ++used;
        }
        if (used == 0 ||
            static_cast<double>(bad) > kMaxBadFraction * static_cast<double>(used + bad)) {
          usable = false;
          break;
        }
        const double constant = white.at(signal.time_s, frames.part)[colour] * signal.monitor;
        const double value =
            sum / (constant * factor) - instrument.stray.fraction * stray_factor / factor;
        const double prnu = instrument.sensor.prnu / std::sqrt(static_cast<double>(used));
        sample.value_per_sr[colour] = value;
        sample.sigma_per_sr[colour] =
            std::hypot(std::sqrt(variance) / (constant * factor), value * prnu);
        const double u_white =
            std::hypot(instrument.white.u_relative, white.visits.front().relative_sigma[colour]);
        const double u_rest =
            std::hypot(instrument.u_lamp_relative, instrument.u_linearity_relative, u_drift);
        const double u_stray = instrument.stray.u_fraction * stray_factor / factor;
        sample.u_common_per_sr[colour] = std::hypot(value * std::hypot(u_white, u_rest), u_stray);
        if (value < kDarkSigmas * sample.sigma_per_sr[colour]) add_flag(sample, "dark");
        if (colours.single(signal.pixel_format)) add_flag(sample, "single_channel");
      }
      if (!usable) {
        ++dropped;
        continue;
      }
      set_direction(spot, sample);
      if (suspects.contains(index)) add_flag(sample, "suspect");
      if (unbridged) add_flag(sample, "unbridged");
      sample.u_tilt = instrument::half_vector_sigma(instrument, sample.direction.theta_d);
      reduction.samples.samples.push_back(std::move(sample));
    }
    if (dropped > 0) {
      reduction.warnings.push_back(
          fmt::format("point {}: {} of {} sub-samples saturated or out of view, left out", index,
                      dropped, options.grid * options.grid));
    }
  }
  if (!without_level.empty()) {
    reduction.warnings.push_back(fmt::format(
        "unbridged: points {} were measured between interruptions without a usable white, and no "
        "sentinel says how bright the light was; they are taken with the white nearest before",
        fmt::join(without_level, " ")));
  }
  reduction.pairs =
      pair_agreements(archive, reduction.samples, options.grid, instrument.u_lamp_relative);
  for (const PairAgreement& pair : reduction.pairs) {
    if (!pair.agrees()) reduction.warnings.push_back(disagreement_text(pair));
  }
  if (reduction.samples.samples.empty()) {
    throw NothingToReduce(place, "sample frames", "found no usable point, expected at least one");
  }
  return reduction;
}

}  // namespace gonio::acquisition
