#pragma once

#include <array>
#include <set>
#include <string>
#include <vector>

#include "gonio/acquisition/session_archive.h"
#include "gonio/instrument/hdr_merge.h"
#include "session_parts.h"

namespace gonio::acquisition {

/// Share of an area's pixels that may be saturated or clipped. Leaving out only the brightest would
/// bend the mean: above this the whole area is a bound, not a value.
constexpr double kMaxBadFraction = 0.02;

/// What to take off every frame, per pixel, in DN of a straight sensor but for the offset: offset
/// from the dark frames, rate from a lamp-off frame.
struct BackgroundMaps {
  std::vector<double> offset_dn;
  std::vector<double> rate_dn_per_s;
  double offset_variance_dn2 = 0.0;  ///< of one pixel of the mean dark
  double rate_variance_dn2_per_s2 = 0.0;
};

/// Mean of dark frames.
struct MeanDark {
  std::vector<double> offset_dn;  ///< per pixel
  int frames = 0;
};

/// That of each part of the session (SessionParts). In a part without dark frames that of all
/// parts; the sensor's black level when there is none at all.
std::vector<MeanDark> mean_darks(const SessionReader& archive, const SessionParts& parts,
                                 const instrument::Instrument& instrument);

BackgroundMaps background_maps(const SessionReader& archive, const instrument::SensorModel& sensor,
                               const MeanDark& dark, const FrameRecord* lamp_off);

/// Signal of one lit channel in one pose.
struct ChannelSignal {
  instrument::MergedSignal merged;
  double monitor = 0.0;         ///< mean over the frames; 1 in a channel without one
  bool monitor_failed = false;  ///< the channel has a monitor, and it read nothing in some frame
  double time_s = 0.0;          ///< mean start of exposure, session clock
  double longest_exposure_s = 0.0;
  devices::PixelFormat pixel_format = devices::PixelFormat::mono;
};

/// The lamp channels that were monitored: with one reading above 0. Decided for the whole archive,
/// since a reading of 0 elsewhere then is a monitor that failed, not one that is blind or not
/// there.
std::set<std::string> monitored_channels(const SessionReader& archive);

/// How long the light of a frame fell: its exposure and the shutter offset. Throws DataFormatError
/// for a frame whose exposure does not outlast the offset.
double exposed_s(const SessionReader& archive, const instrument::SensorModel& sensor,
                 const FrameRecord& record);

/// Reads, checks and merges the frames of a bracket. `monitored`: see monitored_channels().
ChannelSignal merge_frames(const SessionReader& archive, const instrument::Instrument& instrument,
                           const std::vector<const FrameRecord*>& frames,
                           const BackgroundMaps& background,
                           const std::set<std::string>& monitored);

/// Which lamp channel and which pixels make each of R, G, B.
class ColourLayout {
 public:
  /// From the channel names of the lit frames: R, G, B in turn, or one channel (colour from a Bayer
  /// sensor; a mono sensor gives one value for all three, `single()`).
  /// Throws DataFormatError for any other set of names.
  ColourLayout(const SessionReader& archive, const std::filesystem::path& place);

  const std::vector<std::string>& channels() const { return channels_; }
  /// Index into channels() of a colour.
  std::size_t channel_of(int colour) const {
    return channel_of_.at(static_cast<std::size_t>(colour));
  }
  bool single(devices::PixelFormat format) const {
    return channels_.size() == 1 && format == devices::PixelFormat::mono;
  }
  /// Whether a pixel carries a colour: always on a mono sensor, by its phase on a Bayer sensor.
  static bool carries(devices::PixelFormat format, int column, int row, int colour);

 private:
  std::vector<std::string> channels_;
  std::array<std::size_t, 3> channel_of_{};
};

}  // namespace gonio::acquisition
