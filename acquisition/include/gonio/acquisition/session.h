#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/acquisition/measurement_plan.h"
#include "gonio/acquisition/session_archive.h"
#include "gonio/acquisition/trust_notes.h"
#include "gonio/devices/camera.h"
#include "gonio/devices/clock.h"
#include "gonio/devices/light_source.h"
#include "gonio/devices/rotation_stage.h"
#include "gonio/devices/target_changer.h"
#include "gonio/instrument/instrument.h"

namespace gonio::acquisition {

class Steering;

/// The devices of a rig, not owned. `stages` stand in the order of the rig's axes.
struct DeviceSet {
  std::vector<devices::RotationStage*> stages;
  devices::Camera* camera = nullptr;
  devices::LightSource* light = nullptr;
  devices::LampMonitor* monitor = nullptr;    ///< optional
  devices::TargetChanger* changer = nullptr;  ///< needed for white placement changer and manual
  devices::Clock* clock = nullptr;
  /// What the devices have to say at the end, for the archive: retries, gaps. Optional.
  std::function<std::vector<std::string>()> remarks;
  /// Told what the moves and frames that follow are for: 0 the darks, 1 the white, 2 + i point i. A
  /// simulated world draws its noise by it, so that it does not matter what came before. Optional.
  std::function<void(std::uint64_t)> begin_subject;
};

/// The pre-run check refused a session: nothing has moved. One line names the device, axis, option
/// or direction, what was found and what is expected.
class PreflightError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Where the white reference is.
enum class WhitePlacement {
  in_frame,  ///< a patch beside the sample, seen in every frame
  changer,   ///< a motorised changer puts it into the sample plane
  manual     ///< a person does, asked through the TargetChanger the application passes in
};

struct SessionOptions {
  WhitePlacement white = WhitePlacement::changer;
  std::chrono::nanoseconds first_exposure = std::chrono::milliseconds(20);
  double bracket_ratio = 4.0;
  int max_exposures = 8;  ///< per channel and point
  /// Wanted of the dimmest sub-sample (a spot of this half width): longer exposures until met.
  double relative_sigma = 0.005;
  double spot_half_width_mm = 2.0;
  std::chrono::nanoseconds max_exposure = std::chrono::seconds(5);
  int white_frames = 4;  ///< per channel, opening and closing
  int dark_frames = 8;
  double sample_half_width_mm = 25.0;
  double edge_margin_mm = 2.0;                ///< see ReductionOptions
  std::optional<double> white_half_width_mm;  ///< in the sample plane; none: the sample's
  Eigen::Vector2d white_patch_mm{34.0, 0.0};  ///< centre of the in-frame patch, sample frame
  double white_patch_half_width_mm = 3.0;     ///< of the part to use, clear of its edge
  /// After so many points, and after such a time: axes are homed again and compared with their
  /// marks, and the sentinel, a fixed pose on the sample, with its reading before. 0: none. A
  /// session that would end before the first has none either.
  int sentinel_every = 20;
  std::chrono::nanoseconds sentinel_interval = std::chrono::minutes(30);
  /// Most time between two whites, new darks with each; 0: opening and closing white alone. A
  /// person who changes the target (WhitePlacement::manual) is asked for no others.
  std::chrono::nanoseconds white_interval = std::chrono::hours(1);
  int retries = 2;  ///< of a failed device call, per point
  std::chrono::milliseconds move_timeout = std::chrono::minutes(2);

  /// Throws PreflightError naming the field and its value.
  void validate() const;
};

/// What a session tells while it runs; called on the session's thread.
struct SessionProgress {
  std::string phase;         ///< "home", "dark", "white", "point", "check", "closing white", "park"
  std::optional<int> point;  ///< of phase "point": which, by its place in the plan, from 0
  int done = 0;              ///< points finished
  int total = 0;
  double elapsed_s = 0.0;    ///< session clock; of this part
  double remaining_s = 0.0;  ///< as foreseen (Forecast), points by what those measured took
};

struct SessionResult {
  int measured = 0;      ///< with those done before
  int suspect = 0;       ///< of those measured now, in the end
  int measured_now = 0;  ///< in this part, also once more
  std::vector<std::string> warnings;
  double duration_s = 0.0;
  int planned = 0;          ///< points, with those added and without those dropped
  std::vector<int> failed;  ///< points at which a device failed twice, to be measured by resuming
  bool finished = false;    ///< came to its end; false: interrupted or with `failed`, to be resumed
  bool complete = false;    ///< and every point was measured, or a decision replaced or dropped it
};

struct Expectation;  // preflight.h

/// A session that does not begin at its beginning, or may not come to its end.
struct SessionPart {
  std::map<int, PointOutcome> done;  ///< points not to be measured again
  std::set<int> replaced;            ///< points that decisions replaced; failed ones are in `done`
  std::set<int> dropped;             ///< points that a decision left out
  bool enough = false;               ///< a decision ended the measuring of points
  rig::Joints last_joints;           ///< read back last before an interruption; empty: none was
  std::vector<int> unchecked;        ///< of `done`, since the axes were last compared with home
  SentinelReading sentinel;          ///< the first of the session; empty: none yet
  /// By which checks between points are placed and first exposures chosen; not owned. Null: by the
  /// plan's times, and SessionOptions::first_exposure.
  const Expectation* expectation = nullptr;
  std::stop_token pause;  ///< asks to end once the point under way is acknowledged
};

/// The points, of so many, that such a part has to measure. After "enough" those remain that were
/// measured and do not count, or have failed.
std::set<int> points_left(const SessionPart& part, std::size_t planned);

/// Runs a whole session: pre-run check (preflight()), home, darks, opening white, every point (axes
/// together, settle, bracket per channel, read back), lamp-off frames, closing white. Nothing moves
/// before the check has passed. Every exit path, also an exception, stops all axes and closes the
/// shutter.
///
/// Trust    Where axes can tell (devices::HomingReport), they are homed again in the course and in
///          the end, and compared with their marks; longer sessions look at a sentinel as well.
///          Points since the last good check are suspect when one fails (a note), and measured
///          again, once. A lamp that goes off by its monitor ends the session with a Fault, to be
///          resumed.
/// Steered  With `steering`, points come behind the plan's, or are left out, as it decides between
///          two points (steering.h): each decision is noted before anything moves for it.
/// Faults   Each has one declared outcome (docs/fault_matrix.csv, docs/adr/0011): a call is
///          repeated, a point is measured again in the end, a device that dropped off is waited for
///          and all axes are homed anew, or the session ends, to be resumed.
/// Again    With points `part` says are done, it does all this but for those points: new darks and
///          an opening white of their own come before the rest (resume_state()).
/// Threads  Blocks; `stop` may be requested from any thread: the point under way is abandoned, the
///          axes stop, the archive stays readable. `part.pause` likewise: the point is finished.
/// Throws   PreflightError (nothing has moved), devices::DeviceError, what `steering` throws;
///          std::logic_error for a decision that is none, with all axes stopped.
SessionResult run_session(const DeviceSet& devices, const instrument::Instrument& instrument,
                          const MeasurementPlan& plan, const SessionOptions& options,
                          SessionWriter& archive,
                          const std::function<void(const SessionProgress&)>& progress = {},
                          std::stop_token stop = {}, const SessionPart& part = {},
                          Steering* steering = nullptr);

}  // namespace gonio::acquisition
