#include "gonio/aravis_camera/counters.h"

#include <utility>

namespace gonio::aravis_camera {

std::string to_text(const CameraCounters& counters) {
  std::string text = "frames " + std::to_string(counters.frames);
  for (const auto& [name, count] : {
           std::pair{"retried", counters.retried},
           std::pair{"timeouts", counters.timeouts},
           std::pair{"incomplete", counters.incomplete},
           std::pair{"unexpected", counters.unexpected},
           std::pair{"out of order", counters.out_of_order},
           std::pair{"missing between", counters.id_gaps},
           std::pair{"time stamp jumps", counters.timestamp_jumps},
           std::pair{"wrong settings", counters.wrong_settings},
           std::pair{"reconnects", counters.reconnects},
       }) {
    if (count != 0) text += std::string(", ") + name + ' ' + std::to_string(count);
  }
  return text;
}

}  // namespace gonio::aravis_camera
