#include "gonio/instrument/alignment.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return gonio::fuzz::trial(data, size,
                            [](const auto& path) { gonio::instrument::read_alignment(path); });
}
