#include "session_teller.h"

#include <exception>
#include <utility>

#include "gonio/acquisition/trust_notes.h"

namespace gonio::cli {

void SessionTeller::on_frame(const acquisition::FrameRecord& record,
                             const devices::Frame& frame) noexcept {
  if (next_ != nullptr) next_->on_frame(record, frame);
}

void SessionTeller::on_point(const acquisition::PointRecord& record) noexcept {
  if (next_ != nullptr) next_->on_point(record);
}

void SessionTeller::on_note(const acquisition::SessionNote& note) noexcept {
  try {
    tell(note);
  } catch (const std::exception&) {
    // What cannot be said is in the archive.
  }
  if (next_ != nullptr) next_->on_note(note);
}

void SessionTeller::tell(const acquisition::SessionNote& note) {
  if (note.kind == acquisition::kHomeDeltaNote) {
    if (std::exchange(tells_homes_, false)) console_.say("axes " + note.text);
  } else if (note.kind == acquisition::kBridgeNote) {
    console_.say(note.text);
  } else if (note.kind == acquisition::kDroppedOffNote) {
    console_.say("a device dropped off in " + note.text + "; waiting for it");
  } else if (note.kind == acquisition::kCameBackNote) {
    console_.say("it is back; all axes were homed anew and what was begun is taken again");
  } else if (note.kind == acquisition::kSuspectNote) {
    console_.say("suspect: " + note.text);
  }
}

}  // namespace gonio::cli
