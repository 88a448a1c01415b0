#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "example_instrument.h"
#include "gonio/acquisition/frame_file.h"
#include "gonio/acquisition/reduction.h"
#include "gonio/acquisition/session_archive.h"
#include "gonio/instrument/calibration_file.h"
#include "journal.h"
#include "temporary_folder.h"
#include "trial.h"

namespace {

namespace acquisition = gonio::acquisition;

constexpr int kWidth_px = 4;
constexpr int kHeight_px = 3;
constexpr std::array<std::string_view, 6> kTables{"metadata", "configuration", "frames",
                                                  "points",   "notes",         "finished"};

/// A rig whose camera sees the sample with a few pixels.
gonio::instrument::Instrument small_instrument() {
  gonio::instrument::Instrument instrument = gonio::instrument::example_instrument();
  const double coarser = kWidth_px / static_cast<double>(instrument.camera.width_px);
  instrument.camera = {.width_px = kWidth_px,
                       .height_px = kHeight_px,
                       .fx_px = coarser * instrument.camera.fx_px,
                       .fy_px = coarser * instrument.camera.fy_px,
                       .cx_px = 0.5 * (kWidth_px - 1),
                       .cy_px = 0.5 * (kHeight_px - 1)};
  return instrument;
}

/// An archive's folder with the files of two frames; the journal changes from trial to trial.
class Archive {
 public:
  Archive() {
    std::filesystem::create_directory(folder_ / "frames");
    gonio::devices::Frame frame;
    frame.width_px = kWidth_px;
    frame.height_px = kHeight_px;
    for (int i = 0; i < kWidth_px * kHeight_px; ++i) {
      frame.pixels_dn.push_back(static_cast<std::uint16_t>(1000 + i));
    }
    sha256_ = acquisition::write_frame_file(folder_ / "frames/000001.tiff", frame);
    acquisition::write_frame_file(folder_ / "frames/000002.tiff", frame);
  }

  std::filesystem::path journal() const { return folder_ / "session.sqlite"; }

  /// Rows with right checksums: a line each, digit of the table and values, "|" between them, "@"
  /// for the checksum of a frame.
  void write_rows(std::string_view text) const {
    acquisition::Journal journal = acquisition::Journal::create(this->journal());
    while (!text.empty()) {
      std::string_view line = next(text, '\n');
      if (line.empty()) continue;
      const std::string_view table =
          kTables[static_cast<unsigned char>(line.front()) % kTables.size()];
      line.remove_prefix(1);
      std::vector<std::string> values;
      for (std::size_t i = 0; i < acquisition::columns_of(table).size(); ++i) {
        const std::string_view value = next(line, '|');
        values.emplace_back(value == "@" ? sha256_ : value);
      }
      journal.append(table, values);
    }
    journal.close_log();
  }

  acquisition::SessionReader read() const { return acquisition::SessionReader(folder_.path()); }

  void read_frames() const {
    const acquisition::SessionReader reader = read();
    for (const acquisition::FrameRecord& record : reader.frames()) reader.read_frame(record);
  }

  void reduce() const {
    static const gonio::instrument::Instrument instrument = small_instrument();
    const acquisition::SessionReader reader = read();
    const auto stored = reader.configuration().find("calibration.json");
    acquisition::ReductionOptions options;
    options.grid = 1;
    options.spot_half_width_mm = 20.0;
    // What is read must reduce, or be refused.
    if (stored == reader.configuration().end()) {
      acquisition::reduce(reader, instrument, options);
    } else {
      acquisition::reduce(
          reader, gonio::instrument::instrument_from_json(stored->second, "calibration.json"),
          options);
    }
  }

  void remove_journal() const {
    for (const char* end : {"", "-wal", "-shm", "-journal"}) {
      std::filesystem::remove(journal().string() + end);
    }
  }

 private:
  static std::string_view next(std::string_view& text, char separator) {
    const std::size_t end = std::min(text.find(separator), text.size());
    const std::string_view part = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return part;
  }

  gonio::TemporaryFolder folder_;
  std::string sha256_;
};

/// The bytes of a good journal, of the rows that also stand in the corpus.
std::string good_journal(const Archive& archive) {
  archive.write_rows(
      "0sample_id|A17\n"
      "1rig.toml|[rig]\n"
      "2dark|-1||90 0 0|0 0 0|1000|0|0|1|frames/000001.tiff|@|4|3|mono|4095|64|0\n"
      "3"
      "0|10|20|90|A|90 0 0|measured||5000\n"
      "4"
      "100|warning|lamp is cold\n"
      "5"
      "9000\n");
  std::string bytes = gonio::read_bytes(archive.journal());
  archive.remove_journal();
  return bytes;
}

}  // namespace

/// First byte 0: the rest is the journal. 1: rows as in write_rows(). 2: changes to a good journal,
/// a place of four bytes and a byte each.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Archive archive;
  static const std::string good = good_journal(archive);
  if (size == 0) return 0;
  archive.remove_journal();
  const std::string_view rest(reinterpret_cast<const char*>(data + 1), size - 1);
  if (data[0] == 1) {
    archive.write_rows(rest);
  } else if (data[0] == 2) {
    std::string bytes = good;
    constexpr std::size_t kChange = 5;
    for (std::size_t at = 0; at + kChange <= rest.size(); at += kChange) {
      std::uint32_t place = 0;
      std::memcpy(&place, rest.data() + at, sizeof place);
      bytes[place % bytes.size()] = rest[at + sizeof place];
    }
    gonio::write_bytes(archive.journal(), bytes);
  } else {
    gonio::write_bytes(archive.journal(), rest);
  }
  // Apart, as frames that cannot be read would hide what room is made for them.
  gonio::fuzz::trial(nullptr, 0, [](const auto&) { archive.read_frames(); });
  return gonio::fuzz::trial(nullptr, 0, [](const auto&) { archive.reduce(); });
}
