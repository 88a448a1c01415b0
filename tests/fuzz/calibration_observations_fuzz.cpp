#include "gonio/calibration/routine/observations.h"
#include "gonio/files/text_file.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return gonio::fuzz::trial(data, size, [](const auto& path) {
    gonio::calibration::routine::observations_from_json(
        gonio::files::read_text_file(path, 1U << 24U), "darks", path);
  });
}
