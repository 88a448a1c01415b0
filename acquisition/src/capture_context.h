#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ambient_watch.h"
#include "exposure_prediction.h"
#include "gonio/acquisition/guarded_devices.h"
#include "trust_checks.h"

namespace gonio::acquisition {

/// What the visits of a session work with. The session owns all of it.
struct CaptureContext {
  GuardedDevices& devices;
  const instrument::Instrument& instrument;
  const SessionOptions& options;
  SessionWriter& archive;
  TrustChecks& checks;
  AmbientWatch& ambient;
  std::optional<ExposurePrediction>& exposures;  ///< none where nothing is expected
  std::vector<devices::LightChannel> channels;
  std::function<void(std::string)> warn;  ///< into the archive and what the session returns
};

/// DeviceSet::begin_subject
inline void begin_subject(const CaptureContext& context, std::uint64_t subject) {
  const DeviceSet& devices = context.devices.devices();
  if (devices.begin_subject) devices.begin_subject(subject);
}

}  // namespace gonio::acquisition
