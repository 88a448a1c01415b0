#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "expected_regions.h"
#include "gonio/acquisition/preflight.h"

namespace gonio::acquisition {

/// The first exposure of a bracket on regions that are expected to be like this, or `brightness`
/// times as bright: the brightest place comes near, not into, saturation. Shorter where that is
/// longer than a readout and the dimmest region needs less for the wanted sigma.
std::chrono::nanoseconds predicted_exposure(const std::vector<ExpectedRegion>& regions,
                                            const instrument::SensorModel& sensor,
                                            const SessionOptions& options,
                                            const devices::CameraInfo& camera, double brightness);

/// Predicts the first exposures of a session's points from what is expected of the sample and from
/// how bright its whites were. All that is passed by reference must outlive it.
class ExposurePrediction {
 public:
  ExposurePrediction(const instrument::Instrument& instrument, const SessionOptions& options,
                     const devices::CameraInfo& camera, const Expectation& expectation);

  /// What a bracket found at the white (BracketResult::brightest_dn_per_s): from here on the light
  /// of a channel counts as bright as that says.
  void see_white(const std::string& channel, const rig::Joints& joints, double brightest_dn_per_s);

  /// By channel; none of channels whose white was not seen, or where the camera sees no sample.
  /// `sample`: what is expected of it now, if more is known than in the beginning.
  std::map<std::string, std::chrono::nanoseconds> at(
      std::size_t point, const rig::Joints& joints,
      const std::optional<ExpectedSample>& sample = std::nullopt) const;

 private:
  const instrument::Instrument& instrument_;
  const SessionOptions& options_;
  devices::CameraInfo camera_;
  const Expectation& expectation_;
  std::map<std::string, double> light_;  ///< times as bright as expected
};

}  // namespace gonio::acquisition
