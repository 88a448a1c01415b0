#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gonio/devices/frame.h"
#include "gonio/errors/errors.h"
#include "gonio/files/process_lock.h"
#include "gonio/rig/kinematics.h"

namespace gonio::acquisition {

/// What a frame was taken for.
///   dark      shutter closed, shortest exposure: offset map
///   lamp_off  shutter closed at a point's own pose and exposure: ambient light and dark current
///   white     white reference in the sample plane (or its in-frame patch) at a reference pose
///   sample    the sample
///   sentinel  the sample at one pose of its own, again and again; without channel: its background
enum class FrameKind { dark, lamp_off, white, sample, sentinel };

std::string_view to_string(FrameKind kind);

/// One acknowledged frame: the unit of the archive. A frame has its own exposure interval and its
/// own joint angles (mean and spread over the interval, measured); a stop is a frame whose spread
/// is zero.
struct FrameRecord {
  std::int64_t id = 0;  ///< row id, ascending in the order of acknowledgement
  FrameKind kind = FrameKind::sample;
  int point = -1;                    ///< index of the point it belongs to; -1: session-wide
  std::string channel;               ///< lamp channel; empty when the shutter was closed
  std::vector<Angle> joints;         ///< encoder readings, order of the rig's axes
  std::vector<Angle> joints_spread;  ///< half range over the exposure
  std::chrono::nanoseconds exposure{0};
  std::chrono::nanoseconds exposure_start{0};  ///< session clock
  double monitor = 0.0;                        ///< lamp monitor; 0 when the shutter was closed
  std::uint64_t camera_frame_id = 0;
  std::string file;    ///< relative to the archive, "frames/000012.tiff"
  std::string sha256;  ///< of that file
};

/// How a point ended.
enum class PointOutcome { Measured, Saturated, TooDark, Failed };
std::string_view to_string(PointOutcome outcome);

struct PointRecord {
  int point = 0;             ///< index into the plan
  brdf::HalfDiff commanded;  ///< direction of the plan
  char branch = 'A';
  std::vector<Angle> joints;  ///< read back; empty when never reached
  PointOutcome outcome = PointOutcome::Failed;
  std::string note;
  std::chrono::nanoseconds finished_at{0};
};

/// Everything known before the first frame. Values are text so that any reader can show them.
using SessionMetadata = std::map<std::string, std::string>;

/// By the session's clock: when a part may begin at the latest. One that begins later could come to
/// times that no reader takes.
inline constexpr std::chrono::nanoseconds kLatestPart = std::chrono::hours(24 * 365 * 29);

class ArchiveObserver;

/// The folder of a session was moved, replaced or deleted while it was written to. What was
/// acknowledged is where the folder is now.
class FolderMoved : public FileError {
 public:
  explicit FolderMoved(const std::filesystem::path& folder)
      : FileError(folder, "go on with the session",
                  "the folder was moved, replaced or deleted meanwhile") {}
};

/// Creates and appends to a session archive: a folder with `session.sqlite` (WAL, synchronous FULL,
/// rows never updated or deleted, each with its own checksum: the truth) and `frames/*.tiff` (16
/// bit, written under a temporary name, synced, renamed, checksummed, then committed).
///
/// State    What a call acknowledged survives a kill or a power cut at any later instant
///          (docs/adr/0006). Locked against other writers while the object lives: `session.lock`.
/// Threads  One.
/// Errors   std::system_error / DataFormatError with path; the archive stays readable.
class SessionWriter {
 public:
  /// Refuses an existing path. What is given is written whole or not at all. `configuration` files
  /// (resolved rig, plan, calibration) are stored as text under their names.
  SessionWriter(const std::filesystem::path& folder, const SessionMetadata& metadata,
                const std::map<std::string, std::string>& configuration);
  /// Goes on with a session that was not finished. A frame's file that no row tells of, left by a
  /// kill, is removed; more of them are of rows that were lost, and are kept under another name.
  /// Notes of kind "cut back" name them. A note of kind "resumed"
  /// with `text` begins the new part at `begins_at`, which becomes the session's time of `now`,
  /// device clock. `lock` is that of session_lock(), taken before the archive was read. Throws
  /// std::logic_error for a finished session, FileError before anything is written for a part that
  /// would begin after kLatestPart or has no place for its frames.
  static SessionWriter resume(const std::filesystem::path& folder, files::ProcessLock lock,
                              std::chrono::nanoseconds begins_at, std::chrono::nanoseconds now,
                              const std::string& text);
  ~SessionWriter();
  SessionWriter(SessionWriter&& other) noexcept;
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  /// Writes, syncs and acknowledges a frame; fills in id, file and sha256. Throws FolderMoved
  /// before anything is written to a folder that is another one by now.
  FrameRecord append(FrameRecord record, const devices::Frame& frame);
  void append(const PointRecord& record);
  /// An event worth a line: retry, warning, home delta, operator's note.
  void note(std::chrono::nanoseconds at, const std::string& kind, const std::string& text);
  /// What `rows` appends of points and notes becomes acknowledged at once: all of it or, when it
  /// throws, nothing. For what must not be believed without what is said of it.
  void together(const std::function<void()>& rows);
  /// Marks the session complete. Without it a reader reports an interrupted session.
  void finish(std::chrono::nanoseconds at);

  const std::filesystem::path& folder() const;
  /// Throws FolderMoved when what stands at folder() is no longer what is written to: what was read
  /// there by its name may be another session's.
  void require_in_place() const;

  /// Tells of every frame, point and note from here on. Not owned, must outlive the writer; null:
  /// nobody.
  void observe(ArchiveObserver* observer);

 private:
  struct State;
  explicit SessionWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// The file in an archive that its writer holds (files::lock_holder()).
std::filesystem::path session_lock(const std::filesystem::path& folder);

/// Where DiskReserve sets space aside in an archive.
std::filesystem::path disk_reserve_file(const std::filesystem::path& folder);

/// Kind of the note that begins every part of a session but its first.
inline constexpr const char* kResumedNote = "resumed";
/// Kind of the note that ends a part of a session which was asked to pause.
inline constexpr const char* kPausedNote = "paused";

struct SessionNote {
  std::chrono::nanoseconds at{0};
  std::string kind;
  std::string text;
};

/// Reads an archive, also that of a killed run: rows whose checksum fails or whose frame file is
/// missing or altered are left out, and they and missing rows are reported in `damage`. Of a
/// session that is being written to: as it was at one instant.
class SessionReader {
 public:
  explicit SessionReader(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  const SessionMetadata& metadata() const { return metadata_; }
  const std::map<std::string, std::string>& configuration() const { return configuration_; }
  const std::vector<FrameRecord>& frames() const { return frames_; }
  const std::vector<PointRecord>& points() const { return points_; }
  const std::vector<SessionNote>& notes() const { return notes_; }
  const std::vector<std::string>& damage() const { return damage_; }
  bool finished() const { return finished_at_.has_value(); }
  /// When its last part came to its end, on the clock of its rows; nothing: it has not.
  std::optional<std::chrono::nanoseconds> finished_at() const { return finished_at_; }

  /// The archive as it was when notes()[index] was about to be written: without that note and what
  /// came later. Throws std::out_of_range.
  SessionReader before_note(std::size_t index) const;

  /// Frames named in damage(): rows `first` to `last`. Whose they were, where the row still tells.
  struct LostFrames {
    std::int64_t first = 0;
    std::int64_t last = 0;
    std::optional<int> point;
  };
  const std::vector<LostFrames>& lost_frames() const { return lost_frames_; }
  /// Whether the journal has lost rows at its end (a log that was damaged or not copied): points,
  /// checks and notes that were acknowledged may be missing.
  bool lost_rows() const { return lost_rows_; }

  /// Width and height in px of a frame of frames().
  std::pair<int, int> frame_size(const FrameRecord& record) const;
  /// Reads a frame's pixels and verifies its checksum. Throws DataFormatError.
  devices::Frame read_frame(const FrameRecord& record) const;

 private:
  /// All tables at one instant; returns the number of the last frame's row, 0 without one.
  std::int64_t read_rows();
  void leave_out_faulty_frames();

  std::filesystem::path folder_;
  SessionMetadata metadata_;
  std::map<std::string, std::string> configuration_;
  std::vector<FrameRecord> frames_;
  std::vector<PointRecord> points_;
  std::vector<SessionNote> notes_;
  std::vector<std::string> damage_;
  std::vector<LostFrames> lost_frames_;
  std::map<std::int64_t, devices::Frame> shapes_;  ///< per frame id, without pixels
  std::optional<std::chrono::nanoseconds> finished_at_;
  bool lost_rows_ = false;
};

}  // namespace gonio::acquisition
