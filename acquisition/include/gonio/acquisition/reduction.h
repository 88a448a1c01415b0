#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/part_bridge.h"
#include "gonio/acquisition/session_archive.h"
#include "gonio/errors/errors.h"
#include "gonio/instrument/instrument.h"
#include "gonio/samples/samples.h"

namespace gonio::acquisition {

/// How frames become samples: each is a patch of directions, read in a grid of small spots.
struct ReductionOptions {
  int grid = 5;  ///< grid x grid sub-samples per pose; 1: the centre only
  double sample_half_width_mm = 25.0;
  double edge_margin_mm = 2.0;       ///< kept clear of the sample's edge
  double spot_half_width_mm = 2.0;   ///< pixels within it are averaged to one sub-sample
  double min_usable_fraction = 0.5;  ///< of a spot's pixels, else the sub-sample is dropped
  /// Of the white in the sample plane, which the same margin is kept clear of; none: the sample's.
  std::optional<double> white_half_width_mm;
  bool white_in_frame = false;  ///< the white is a patch beside the sample
  Eigen::Vector2d white_patch_mm{34.0, 0.0};
  double white_patch_half_width_mm = 3.0;

  /// Throws std::invalid_argument naming the field and its value.
  void validate() const;
};

struct SessionOptions;  // session.h

/// Sets what a session's options say of sample and white.
void set_geometry(const SessionOptions& session, ReductionOptions& options);

/// Two points of one direction, which have to agree.
struct PairAgreement {
  int first = 0;  ///< points of the plan, in time
  int second = 0;
  bool exchanged = false;        ///< light and camera: a reciprocal pair; else a repeat
  double change_relative = 0.0;  ///< second over first, minus 1; mean of spots and colours
  double u_relative = 0.0;       ///< k = 1: noise of both, lamp monitor, pose gone to again

  /// What angles and reference explain beyond that is no fault of the session: a part in 200 for
  /// repeats, one in 100 for exchanged ones (the limits of a calibration's verification, less its
  /// longer exposures).
  bool agrees() const;
};

/// Of the white over a session, relative, after the lamp monitor. More is no drift of a warm lamp;
/// its share of u_common then passes that of a good white reference.
inline constexpr double kUsualDrift = 0.02;

/// "9 of 10 points measured twice agree with themselves: ..."; empty: none was.
std::string to_text(const std::vector<PairAgreement>& pairs);

struct Reduction {
  samples::SampleSet samples;
  std::vector<std::string> warnings;  ///< dropped sub-samples, white drift, damage found
  /// Closing over opening white, worst channel, minus 1; none: there is but one.
  std::optional<double> white_drift_relative;
  std::vector<PartBridge> bridges;   ///< of a session that was resumed
  std::vector<PairAgreement> pairs;  ///< where both halves were measured
};

/// Throws DataFormatError when a frame is of another image size or number of axes.
void require_of_instrument(const SessionReader& archive, const instrument::Instrument& instrument);

/// An archive that has not got, or has lost, what a reduction cannot do without.
class NothingToReduce : public DataFormatError {
 public:
  using DataFormatError::DataFormatError;
};

/// Pure function of archive, instrument and options. Signals are those of a straight sensor
/// (response curve, shutter offset); bad pixels are left out of every mean and of the pixels that a
/// spot must have. Independent sigma from the noise model, sigma common to a pose from white, lamp
/// and linearity, angle uncertainty from the instrument's normal. Throws NothingToReduce when
/// the archive has no white or no usable point, DataFormatError when it does not fit the
/// instrument.
Reduction reduce(const SessionReader& archive, const instrument::Instrument& instrument,
                 const ReductionOptions& options = {});

/// Reduction::bridges alone, without reading points. Empty for a session of one part.
std::vector<PartBridge> bridges(const SessionReader& archive,
                                const instrument::Instrument& instrument,
                                const ReductionOptions& options);

}  // namespace gonio::acquisition
