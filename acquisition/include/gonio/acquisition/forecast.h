#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "gonio/acquisition/itinerary.h"
#include "gonio/acquisition/session.h"
#include "gonio/devices/camera.h"
#include "gonio/instrument/instrument.h"

namespace gonio::acquisition {

/// What is expected of lamp and camera together, before a white has told.
struct ExpectedLight {
  struct Channel {
    std::string name;
    /// C of the measurement equation: DN/s above black of a pixel are the sum over the bands R, G,
    /// B of C * f * factor (instrument::PixelGeometry::factor).
    brdf::Rgb constant;
  };
  std::vector<Channel> channels;
  double sigma_ln = 0.0;  ///< of its logarithm, all together
};

/// What is expected of the sample before it is measured.
struct ExpectedSample {
  /// BRDF in 1/sr that a point of the plan (its index) shows in some directions near its own.
  std::function<brdf::Rgb(std::size_t point, const brdf::DirectionPair&)> brdf;
  double sigma_ln = 0.0;        ///< of its logarithm, the same for all points
  double point_sigma_ln = 0.0;  ///< and of each point's own, beside it
  std::string source;           ///< for people: "gold-satin", "unknown"

  /// Times as bright as expected that a first exposure is chosen for: one that saturates is taken
  /// in vain.
  double margin() const;
};

/// What a rig takes besides travel and exposures. What is unknown beforehand is in the interval.
struct RigTimes {
  double change_s = 20.0;       ///< the target changer, once
  double index_search_s = 2.0;  ///< of homing an axis, beside the way there
  double frame_s = 0.0;         ///< per frame, beside its readout: transfer, encoders, file
  double move_s = 0.0;          ///< per leg, beside the drives' own time: commands on a bus
  double sigma_relative = 0.0;  ///< of all travel and of these times
};

/// A time with its interval of 90 %.
struct Estimate {
  double expected = 0.0;
  double low = 0.0;
  double high = 0.0;
};

/// One channel's bracket.
struct ForecastBracket {
  double shortest_s = 0.0;
  double longest_s = 0.0;
  double exposed_s = 0.0;  ///< of all frames together
  int frames = 0;
};

struct ForecastPoint {
  std::vector<ForecastBracket> channels;  ///< as expected, in the order of the light's channels
  double lamp_off_s = 0.0;
  int frames = 0;               ///< of the brackets, and the lamp-off one
  Estimate measuring_s;         ///< without travel; this point alone
  double travel_s = 0.0;        ///< settling included
  double ends_at_s = 0.0;       ///< since the session began
  bool in_view = true;          ///< the camera sees some of the sample there
  bool saturates = false;       ///< some of it in some channel, even in the shortest exposure
  bool dark = false;            ///< some of it is a bound in some channel, even in the longest
  bool short_of_sigma = false;  ///< some of it stays above the wanted relative sigma
};

/// How long a session takes, of what, and how many frames it writes.
struct Forecast {
  struct Part {
    std::string name;  ///< "home", "dark", "white", "travel", "points", "checks", "closing white",
                       ///< "park"; the sentinel's first reading is of "white"
    Estimate seconds;
  };
  std::vector<Part> parts;  ///< that add up to the expected total
  Estimate total_s;
  std::vector<ForecastPoint> points;  ///< of the plan
  std::vector<double> dwells_s;       ///< of the itinerary's visits, beside their travel_s
  int frames = 0;
  int frames_high = 0;  ///< end of the 90 % interval
};

/// Predicts a session from the moves of `itinerary` and from brackets chosen by the session's own
/// rules on what `light` and `sample` let expect. Retries and pauses are not foreseen.
///
/// Interval  The unknown of light and sample moves all points together, each point's own and
///           homing's unknown start add as squares.
/// Threads   Points are looked at in parallel; the result does not depend on how many threads.
/// Throws    std::invalid_argument for a light without channels.
Forecast forecast_session(const instrument::Instrument& instrument, const Itinerary& itinerary,
                          const MeasurementPlan& plan, const SessionOptions& options,
                          const devices::CameraInfo& camera, const ExpectedLight& light,
                          const ExpectedSample& sample, const RigTimes& times);

}  // namespace gonio::acquisition
