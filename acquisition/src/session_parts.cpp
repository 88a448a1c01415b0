#include "session_parts.h"

#include <algorithm>

namespace gonio::acquisition {

SessionParts::SessionParts(const SessionReader& archive) {
  for (const SessionNote& note : archive.notes()) {
    if (note.kind == kResumedNote) starts_.push_back(note.at);
  }
  std::sort(starts_.begin(), starts_.end());
}

std::size_t SessionParts::at(std::chrono::nanoseconds time) const {
  return static_cast<std::size_t>(std::upper_bound(starts_.begin(), starts_.end(), time) -
                                  starts_.begin());
}

}  // namespace gonio::acquisition
