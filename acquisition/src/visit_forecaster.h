#pragma once

#include "bracket_forecaster.h"
#include "gonio/acquisition/forecast.h"

namespace gonio::acquisition {

/// Half of a 90 % interval, in standard deviations.
constexpr double kNinetyPercent = 1.645;
/// Time and spread about it: both add up over points, the second as squares.
struct Uncertain {
  double seconds = 0.0;
  double low = 0.0;  ///< of the common unknown
  double high = 0.0;
  double variance = 0.0;  ///< of its own
};

/// What single visits of a session take. All that is passed by reference must outlive it.
class VisitForecaster {
 public:
  VisitForecaster(const instrument::Instrument& instrument, const SessionOptions& options,
                  const devices::CameraInfo& camera, const ExpectedLight& light,
                  const RigTimes& times)
      : instrument_(instrument),
        options_(options),
        camera_(camera),
        light_(light),
        times_(times),
        brackets_(instrument.sensor, options, camera),
        frame_s_(devices::to_seconds(camera.readout) + times.frame_s) {}

  struct Point {
    ForecastPoint point;
    Uncertain measuring;
    int frames_high = 0;
  };

  Point point(std::size_t index, const PlannedPoint& planned, const ExpectedSample& sample) const;

  /// The white, or the sentinel.
  struct Target {
    Uncertain seconds;
    int frames = 0;
    int frames_high = 0;
  };

  Target white(const rig::Joints& joints) const;
  /// The first visit finds its exposures by a bracket.
  Target sentinel(const rig::Joints& joints, const ExpectedSample& sample, bool first) const;
  /// One axis after another, from wherever it stands.
  Uncertain homing() const;
  /// Axes that stand at home: one after another they search their marks.
  Uncertain home_check() const;
  Uncertain darks() const;
  Uncertain travel(const PlannedVisit& visit) const;

 private:
  /// Seconds of a point whose regions are `brightness` times as bright as expected, of which
  /// `light` is the light's share: the white tells it before.
  double measure_point(const std::vector<ChannelRegions>& channels, const ExpectedSample& sample,
                       double brightness, double noise, ForecastPoint& point,
                       double light = 1.0) const;

  const instrument::Instrument& instrument_;
  const SessionOptions& options_;
  const devices::CameraInfo& camera_;
  const ExpectedLight& light_;
  const RigTimes& times_;
  BracketForecaster brackets_;
  double frame_s_;
};

}  // namespace gonio::acquisition
