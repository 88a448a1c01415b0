#include "gonio/acquisition/session_archive.h"

namespace gonio::acquisition {

std::string_view to_string(FrameKind kind) {
  switch (kind) {
    case FrameKind::dark:
      return "dark";
    case FrameKind::lamp_off:
      return "lamp_off";
    case FrameKind::white:
      return "white";
    case FrameKind::sample:
      return "sample";
    case FrameKind::sentinel:
      return "sentinel";
  }
  return "unknown";
}

std::string_view to_string(PointOutcome outcome) {
  switch (outcome) {
    case PointOutcome::Measured:
      return "measured";
    case PointOutcome::Saturated:
      return "saturated";
    case PointOutcome::TooDark:
      return "too_dark";
    case PointOutcome::Failed:
      return "failed";
  }
  return "unknown";
}

}  // namespace gonio::acquisition
