#include "gonio/brdf/cornell_file.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return gonio::fuzz::trial(data, size, [](const auto& path) {
    const auto samples = gonio::brdf::read_cornell(path);
    if (samples.size() < gonio::brdf::ScatteredBrdf::kFewestSamples) return;
    const gonio::brdf::ScatteredBrdf brdf(samples);
    for (const auto& sample : samples) brdf.evaluate({sample.pair.wo, sample.pair.wi});
  });
}
