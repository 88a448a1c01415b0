#include "gonio/acquisition/frame_file.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return gonio::fuzz::trial(
      data, size, [](const auto& path) { gonio::acquisition::read_frame_file(path, 4, 3); });
}
