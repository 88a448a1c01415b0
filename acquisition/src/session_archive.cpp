#include "gonio/acquisition/session_archive.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <type_traits>

#include "gonio/acquisition/archive_observer.h"
#include "gonio/acquisition/frame_file.h"
#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "gonio/files/sha256.h"
#include "journal.h"
#include "session_parts.h"

namespace gonio::acquisition {
namespace {

constexpr const char* kJournalName = "session.sqlite";
constexpr std::string_view kFrames = "frames";  ///< the table
constexpr int kMaxFramePixels_px = 65536;
constexpr int kMostPoints = 10'000'000;
/// With all that its parts waited for each other: thirty years.
constexpr std::chrono::nanoseconds kLongestSession = std::chrono::hours(24 * 365 * 30);

std::string frame_file_name(std::int64_t id) { return fmt::format("frames/{:06}.tiff", id); }

std::string degrees_text(const std::vector<Angle>& angles) {
  std::string text;
  for (const Angle angle : angles) {
    if (!text.empty()) text += ' ';
    text += fmt::format("{}", angle.degrees());
  }
  return text;
}

/// Reads the values of one row in order; anything that is no number becomes a DataFormatError.
class RowFields {
 public:
  RowFields(const std::filesystem::path& path, std::string_view table, const Journal::Row& row)
      : path_(path), table_(table), row_(row) {}

  const std::string& text() { return row_.values.at(next_++); }
  template <class Number>
  Number number() {
    return parse<Number>(text());
  }
  /// Of the session's clock, or an exposure: sums of a few stay within 64 bits.
  std::chrono::nanoseconds nanoseconds() {
    const std::chrono::nanoseconds time(number<std::int64_t>());
    if (time < std::chrono::nanoseconds(0) || time > kLongestSession) {
      fail(fmt::format("found a time of {} ns, expected 0 to {}", time.count(),
                       kLongestSession.count()));
    }
    return time;
  }
  /// Of a plan; `lowest` -1: or of none.
  int point(int lowest) {
    const int point = number<int>();
    if (point < lowest || point > kMostPoints) {
      fail(fmt::format("found point {}, expected {} to {}", point, lowest, kMostPoints));
    }
    return point;
  }
  std::vector<Angle> angles() {
    const std::string& all = text();
    std::vector<Angle> result;
    std::size_t at = 0;
    while (at < all.size()) {
      const std::size_t end = std::min(all.find(' ', at), all.size());
      result.push_back(Angle::from_degrees(parse<double>(all.substr(at, end - at))));
      at = end + 1;
    }
    return result;
  }
  template <class Enum>
  Enum name(std::initializer_list<Enum> known) {
    const std::string& word = text();
    for (const Enum value : known) {
      if (to_string(value) == word) return value;
    }
    fail(fmt::format("unknown word {:?}", word));
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw DataFormatError(path_, fmt::format("{} row {}", table_, row_.number), why);
  }

 private:
  template <class Number>
  Number parse(const std::string& text) const {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
      fail(fmt::format("found {:?}, expected a number", text));
    }
    if constexpr (std::is_floating_point_v<Number>) {
      if (!std::isfinite(value)) fail(fmt::format("found {:?}, expected a finite number", text));
    }
    return value;
  }

  const std::filesystem::path& path_;
  std::string_view table_;
  const Journal::Row& row_;
  std::size_t next_ = 0;
};

/// What is wrong with a frame's file against its journal entry; empty when nothing is. Who reads
/// frames makes room for all pixels of the entry before the first is read.
std::string fault_of(const std::filesystem::path& path, const std::string& sha256,
                     const devices::Frame& shape) {
  if (!std::filesystem::is_regular_file(path)) return "is missing";
  const std::uintmax_t pixel_bytes =
      sizeof(std::uint16_t) * std::uintmax_t(shape.width_px) * std::uintmax_t(shape.height_px);
  if (std::filesystem::file_size(path) < pixel_bytes) return "is smaller than its pixels";
  return files::sha256_of_file(path) == sha256 ? "" : "does not have its checksum";
}

devices::Frame shape_of(RowFields& fields) {
  devices::Frame shape;
  shape.width_px = fields.number<int>();
  shape.height_px = fields.number<int>();
  shape.pixel_format =
      fields.name({devices::PixelFormat::mono, devices::PixelFormat::bayer_rggb,
                   devices::PixelFormat::bayer_grbg, devices::PixelFormat::bayer_gbrg,
                   devices::PixelFormat::bayer_bggr});
  shape.saturation_level_dn = fields.number<std::uint16_t>();
  shape.black_level_dn = fields.number<double>();
  shape.gain_db = fields.number<double>();
  if (shape.width_px < 1 || shape.height_px < 1 || shape.width_px > kMaxFramePixels_px ||
      shape.height_px > kMaxFramePixels_px) {
    fields.fail(fmt::format("a frame of {} x {} px", shape.width_px, shape.height_px));
  }
  return shape;
}

FrameRecord frame_record(RowFields& fields, std::int64_t number) {
  FrameRecord record;
  record.id = number;
  record.kind = fields.name({FrameKind::dark, FrameKind::lamp_off, FrameKind::white,
                             FrameKind::sample, FrameKind::sentinel});
  record.point = fields.point(-1);
  record.channel = fields.text();
  record.joints = fields.angles();
  record.joints_spread = fields.angles();
  record.exposure = fields.nanoseconds();
  if (record.exposure.count() <= 0) fields.fail("an exposure that is not positive");
  record.exposure_start = fields.nanoseconds();
  record.monitor = fields.number<double>();
  record.camera_frame_id = fields.number<std::uint64_t>();
  record.file = fields.text();
  if (record.file != frame_file_name(number)) {
    fields.fail(
        fmt::format("frame file {:?}, expected {:?}", record.file, frame_file_name(number)));
  }
  record.sha256 = fields.text();
  return record;
}

PointRecord point_record(RowFields& fields) {
  PointRecord record;
  record.point = fields.point(0);
  record.commanded.theta_h = Angle::from_degrees(fields.number<double>());
  record.commanded.theta_d = Angle::from_degrees(fields.number<double>());
  record.commanded.phi_d = Angle::from_degrees(fields.number<double>());
  const std::string& branch = fields.text();
  if (branch.size() != 1) fields.fail(fmt::format("branch {:?}", branch));
  record.branch = branch.front();
  record.joints = fields.angles();
  record.outcome = fields.name({PointOutcome::Measured, PointOutcome::Saturated,
                                PointOutcome::TooDark, PointOutcome::Failed});
  record.note = fields.text();
  record.finished_at = fields.nanoseconds();
  return record;
}

/// Removes what a killed writer left in frames/ from a frame without a row on. Returns their names.
std::vector<std::string> remove_unacknowledged(const std::filesystem::path& folder,
                                               std::int64_t next_frame) {
  std::vector<std::string> removed;
  const std::filesystem::path next = folder / frame_file_name(next_frame);
  for (const auto& entry : std::filesystem::directory_iterator(folder / "frames")) {
    const std::string name = entry.path().filename().string();
    const bool hidden = name.starts_with(".") && name.ends_with(".part");
    if (!hidden && entry.path() != next) continue;
    removed.push_back("frames/" + name);
  }
  std::sort(removed.begin(), removed.end());
  for (const std::string& name : removed) std::filesystem::remove(folder / name);
  return removed;
}

}  // namespace

struct SessionWriter::State {
  std::filesystem::path folder;
  files::ProcessLock lock;
  Journal journal;
  std::int64_t next_frame = 1;
  std::chrono::nanoseconds ahead{0};  ///< of the session's clock before the devices'
  ArchiveObserver* observer = nullptr;
};

std::filesystem::path session_lock(const std::filesystem::path& folder) {
  return folder / "session.lock";
}

std::filesystem::path disk_reserve_file(const std::filesystem::path& folder) {
  return folder / "frames" / ".reserve.part";
}

SessionWriter::SessionWriter(const std::filesystem::path& folder, const SessionMetadata& metadata,
                             const std::map<std::string, std::string>& configuration) {
  files::require_creatable(folder);
  // Another process may have been quicker: what it made is its own.
  if (!std::filesystem::create_directory(folder)) {
    throw FileError(folder, "create", "it exists");
  }
  try {
    std::filesystem::create_directory(folder / "frames");
    state_.reset(new State{folder, files::ProcessLock(session_lock(folder)),
                           Journal::create(folder / kJournalName)});
    state_->journal.begin();
    for (const auto& [key, value] : metadata) state_->journal.append("metadata", {key, value});
    for (const auto& [name, text] : configuration) {
      state_->journal.append("configuration", {name, text});
    }
    state_->journal.commit();
    // SQLite looks after the names in the folder; ours is that of the folder itself.
    files::sync_folder(std::filesystem::absolute(folder).lexically_normal().parent_path());
  } catch (...) {
    // What does not say what is to be done is no session that could be gone on with.
    state_.reset();
    std::error_code left_there;
    std::filesystem::remove_all(folder, left_there);
    throw;
  }
}

SessionWriter::SessionWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}

SessionWriter SessionWriter::resume(const std::filesystem::path& folder, files::ProcessLock lock,
                                    std::chrono::nanoseconds begins_at,
                                    std::chrono::nanoseconds now, const std::string& text) {
  if (Journal::open(folder / kJournalName).last_number("finished") > 0) {
    throw std::logic_error(folder.string() + ": the session is finished");
  }
  Journal journal = Journal::reopen(folder / kJournalName);
  std::unique_ptr<State> state(
      new State{folder, std::move(lock), std::move(journal), 1, begins_at - now});
  state->next_frame = state->journal.last_number("frames") + 1;
  SessionWriter writer(std::move(state));
  writer.note(now, kResumedNote, text);
  // Space that was set aside is no frame that was lost.
  std::filesystem::remove(disk_reserve_file(folder));
  for (const std::string& name : remove_unacknowledged(folder, writer.state_->next_frame)) {
    writer.note(now, "cut back", name + " was never acknowledged, removed");
  }
  return writer;
}

SessionWriter::~SessionWriter() = default;
SessionWriter::SessionWriter(SessionWriter&& other) noexcept = default;

FrameRecord SessionWriter::append(FrameRecord record, const devices::Frame& frame) {
  record.id = state_->next_frame;
  record.file = frame_file_name(record.id);
  record.exposure = frame.exposure;
  record.exposure_start = frame.exposure_start + state_->ahead;
  record.camera_frame_id = frame.frame_id;
  record.sha256 = write_frame_file(state_->folder / record.file, frame);
  state_->journal.append(
      "frames",
      {std::string(to_string(record.kind)), fmt::format("{}", record.point), record.channel,
       degrees_text(record.joints), degrees_text(record.joints_spread),
       fmt::format("{}", record.exposure.count()), fmt::format("{}", record.exposure_start.count()),
       fmt::format("{}", record.monitor), fmt::format("{}", record.camera_frame_id), record.file,
       record.sha256, fmt::format("{}", frame.width_px), fmt::format("{}", frame.height_px),
       std::string(devices::to_string(frame.pixel_format)),
       fmt::format("{}", frame.saturation_level_dn), fmt::format("{}", frame.black_level_dn),
       fmt::format("{}", frame.gain_db)});
  ++state_->next_frame;
  if (state_->observer != nullptr) state_->observer->on_frame(record, frame);
  return record;
}

void SessionWriter::append(const PointRecord& record) {
  state_->journal.append(
      "points",
      {fmt::format("{}", record.point), fmt::format("{}", record.commanded.theta_h.degrees()),
       fmt::format("{}", record.commanded.theta_d.degrees()),
       fmt::format("{}", record.commanded.phi_d.degrees()), std::string(1, record.branch),
       degrees_text(record.joints), std::string(to_string(record.outcome)), record.note,
       fmt::format("{}", (record.finished_at + state_->ahead).count())});
  if (state_->observer == nullptr) return;
  PointRecord told = record;
  told.finished_at += state_->ahead;
  state_->observer->on_point(told);
}

void SessionWriter::note(std::chrono::nanoseconds at, const std::string& kind,
                         const std::string& text) {
  state_->journal.append("notes", {fmt::format("{}", (at + state_->ahead).count()), kind, text});
  if (state_->observer != nullptr) state_->observer->on_note({at + state_->ahead, kind, text});
}

void SessionWriter::together(const std::function<void()>& rows) {
  state_->journal.begin();
  try {
    rows();
    state_->journal.commit();
  } catch (...) {
    try {
      state_->journal.roll_back();
    } catch (const std::exception&) {
      // A disk that fails has ended it already: SQLite rolls back by itself then.
    }
    throw;
  }
}

void SessionWriter::finish(std::chrono::nanoseconds at) {
  state_->journal.append("finished", {fmt::format("{}", (at + state_->ahead).count())});
  state_->journal.close_log();
}

const std::filesystem::path& SessionWriter::folder() const { return state_->folder; }

void SessionWriter::observe(ArchiveObserver* observer) { state_->observer = observer; }

SessionReader::SessionReader(const std::filesystem::path& folder) : folder_(folder) {
  const std::filesystem::path path = folder / kJournalName;
  const Journal journal = Journal::open(path);
  const auto each_intact = [&](std::string_view table, auto&& read) {
    std::int64_t expected = 1;
    for (const Journal::Row& row : journal.rows(table)) {
      if (row.number != expected) {
        damage_.push_back(
            fmt::format("{} rows {} to {} are missing", table, expected, row.number - 1));
        if (table == kFrames) lost_frames_.push_back({expected, row.number - 1, std::nullopt});
      }
      expected = row.number + 1;
      if (!row.intact) {
        damage_.push_back(
            fmt::format("{} row {}: checksum does not fit, left out", table, row.number));
        if (table == kFrames) lost_frames_.push_back({row.number, row.number, std::nullopt});
        continue;
      }
      RowFields fields(path, table, row);
      read(fields, row);
    }
  };
  each_intact("metadata", [&](RowFields& fields, const Journal::Row&) {
    const std::string key = fields.text();
    metadata_[key] = fields.text();
  });
  each_intact("configuration", [&](RowFields& fields, const Journal::Row&) {
    const std::string name = fields.text();
    configuration_[name] = fields.text();
  });
  each_intact(kFrames, [&](RowFields& fields, const Journal::Row& row) {
    FrameRecord record = frame_record(fields, row.number);
    shapes_[record.id] = shape_of(fields);
    const std::string fault = fault_of(folder_ / record.file, record.sha256, shapes_[record.id]);
    if (!fault.empty()) {
      damage_.push_back(fmt::format("frame {}: {} {}, left out", record.id, record.file, fault));
      lost_frames_.push_back({record.id, record.id, record.point});
      return;
    }
    frames_.push_back(std::move(record));
  });
  each_intact("points", [&](RowFields& fields, const Journal::Row&) {
    points_.push_back(point_record(fields));
  });
  each_intact("notes", [&](RowFields& fields, const Journal::Row&) {
    SessionNote note;
    note.at = fields.nanoseconds();
    note.kind = fields.text();
    note.text = fields.text();
    notes_.push_back(std::move(note));
  });
  each_intact("finished", [&](RowFields&, const Journal::Row&) { finished_ = true; });
}

SessionReader SessionReader::before_note(std::size_t index) const {
  const std::chrono::nanoseconds at = notes_.at(index).at;
  SessionReader earlier = *this;
  earlier.notes_.resize(index);
  std::erase_if(earlier.frames_, [&](const FrameRecord& frame) {
    return frame.exposure_start + frame.exposure > at;
  });
  std::erase_if(earlier.points_, [&](const PointRecord& point) { return point.finished_at > at; });
  earlier.finished_ = false;
  return earlier;
}

std::pair<int, int> SessionReader::frame_size(const FrameRecord& record) const {
  const devices::Frame& shape = shapes_.at(record.id);
  return {shape.width_px, shape.height_px};
}

devices::Frame SessionReader::read_frame(const FrameRecord& record) const {
  const std::filesystem::path path = folder_ / record.file;
  const std::string found = files::sha256_of_file(path);
  if (found != record.sha256) {
    throw DataFormatError(path, "contents",
                          fmt::format("SHA-256 is {}, the journal says {}", found, record.sha256));
  }
  devices::Frame frame = shapes_.at(record.id);
  frame.exposure = record.exposure;
  frame.exposure_start = record.exposure_start;
  frame.frame_id = record.camera_frame_id;
  frame.pixels_dn = read_frame_file(path, frame.width_px, frame.height_px);
  return frame;
}

}  // namespace gonio::acquisition
