#include "gonio/setup/white_certificate.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return gonio::fuzz::trial(data, size,
                            [](const auto& path) { gonio::cli::read_white_certificate(path); });
}
