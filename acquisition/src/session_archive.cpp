#include "gonio/acquisition/session_archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "archive_rows.h"
#include "frame_folder.h"
#include "gonio/acquisition/archive_observer.h"
#include "gonio/acquisition/frame_file.h"
#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "gonio/files/sha256.h"
#include "journal.h"

namespace gonio::acquisition {
namespace {

constexpr const char* kJournalName = "session.sqlite";
constexpr std::string_view kFrames = "frames";  ///< the table
/// Whose rows the end of a session counts.
constexpr std::array<std::string_view, 5> kCounted{"metadata", "configuration", kFrames, "points",
                                                   "notes"};

double years(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::ratio<3600 * 24 * 365>>(time).count();
}

std::string degrees_text(const std::vector<Angle>& angles) {
  std::string text;
  for (const Angle angle : angles) {
    if (!text.empty()) text += ' ';
    text += fmt::format("{}", angle.degrees());
  }
  return text;
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
  if (begins_at > kLatestPart) {
    throw FileError(
        folder, "go on",
        fmt::format("it was begun {:.0f} years ago by the clock of this computer, or by "
                    "its journal: expected {:.0f} at most",
                    years(begins_at), years(kLatestPart)));
  }
  Journal journal = Journal::reopen(folder / kJournalName);
  std::unique_ptr<State> state(
      new State{folder, std::move(lock), std::move(journal), 1, begins_at - now});
  state->next_frame = state->journal.last_number(kFrames) + 1;
  // What cannot be written to has no new part begun in it. A frame without a row may stand there.
  files::require_creatable(folder / frame_file_name(state->next_frame), files::Overwrite::Yes);
  SessionWriter writer(std::move(state));
  writer.note(now, kResumedNote, text);
  // Space that was set aside is no frame that was lost.
  std::filesystem::remove(disk_reserve_file(folder));
  for (const std::string& done : cut_back(folder, writer.state_->next_frame - 1)) {
    writer.note(now, "cut back", done);
  }
  return writer;
}

SessionWriter::~SessionWriter() = default;
SessionWriter::SessionWriter(SessionWriter&& other) noexcept = default;

void SessionWriter::require_in_place() const {
  if (!files::names_open_file(session_lock(state_->folder), state_->lock.descriptor())) {
    throw FolderMoved(state_->folder);
  }
}

FrameRecord SessionWriter::append(FrameRecord record, const devices::Frame& frame) {
  // Rows go to the file that is open; frames go by name, and would go to another session.
  require_in_place();
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
  std::vector<std::string> values{fmt::format("{}", (at + state_->ahead).count())};
  if (state_->journal.counts_its_rows()) {
    std::string counts;
    for (const std::string_view table : kCounted) {
      counts += fmt::format("{}{}", counts.empty() ? "" : " ", state_->journal.last_number(table));
    }
    values.push_back(std::move(counts));
  }
  state_->journal.append("finished", values);
  state_->journal.close_log();
}

const std::filesystem::path& SessionWriter::folder() const { return state_->folder; }

void SessionWriter::observe(ArchiveObserver* observer) { state_->observer = observer; }

SessionReader::SessionReader(const std::filesystem::path& folder) : folder_(folder) {
  // Before the rows: a session that goes on meanwhile adds files first.
  const std::vector<std::int64_t> files = numbers_of_frame_files(folder);
  const std::int64_t last_frame = read_rows();
  // Behind them: as long as that takes, the journal must not be held.
  leave_out_faulty_frames();
  const std::vector<std::int64_t> left = without_rows(files, last_frame);
  lost_rows_ = left.size() > 1;
  if (lost_rows_) {
    damage_.push_back(fmt::format(
        "frames {} to {} have files and no rows: the journal has lost its end, and with it what "
        "was measured since frame {}",
        left.front(), left.back(), last_frame));
  }
}

std::int64_t SessionReader::read_rows() {
  const std::filesystem::path path = folder_ / kJournalName;
  Journal journal = Journal::open(path);
  // All tables as they are at one instant of a session that goes on, and may finish, meanwhile.
  journal.begin();
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
  const auto keep_once = [](std::map<std::string, std::string>& texts) {
    return [&texts](RowFields& fields, const Journal::Row&) {
      const std::string key = fields.text();
      if (!texts.try_emplace(key, fields.text()).second) fields.fail("its key stands there twice");
    };
  };
  each_intact("metadata", keep_once(metadata_));
  each_intact("configuration", keep_once(configuration_));
  each_intact(kFrames, [&](RowFields& fields, const Journal::Row& row) {
    frames_.push_back(frame_record(fields, row.number));
    shapes_[row.number] = shape_of(fields);
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
  each_intact("finished", [&](RowFields& fields, const Journal::Row&) {
    finished_at_ = fields.nanoseconds();
    if (!journal.counts_its_rows()) return;
    const std::vector<std::int64_t> counts = fields.counts(kCounted.size());
    for (std::size_t i = 0; i < kCounted.size(); ++i) {
      const std::int64_t found = journal.last_number(kCounted[i]);
      if (found == counts[i]) continue;
      damage_.push_back(fmt::format("{}: found {} rows, there were {} when the session finished",
                                    kCounted[i], found, counts[i]));
    }
  });
  const std::int64_t last_frame = journal.last_number(kFrames);
  journal.commit();
  return last_frame;
}

void SessionReader::leave_out_faulty_frames() {
  std::vector<FrameRecord> whole;
  for (FrameRecord& record : frames_) {
    const std::string fault = fault_of(folder_ / record.file, record.sha256, shapes_.at(record.id));
    if (fault.empty()) {
      whole.push_back(std::move(record));
      continue;
    }
    damage_.push_back(fmt::format("frame {}: {} {}, left out", record.id, record.file, fault));
    lost_frames_.push_back({record.id, record.id, record.point});
  }
  frames_ = std::move(whole);
}

SessionReader SessionReader::before_note(std::size_t index) const {
  const std::chrono::nanoseconds at = notes_.at(index).at;
  SessionReader earlier = *this;
  earlier.notes_.resize(index);
  std::erase_if(earlier.frames_, [&](const FrameRecord& frame) {
    return frame.exposure_start + frame.exposure > at;
  });
  std::erase_if(earlier.points_, [&](const PointRecord& point) { return point.finished_at > at; });
  earlier.finished_at_.reset();
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
