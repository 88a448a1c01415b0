#include "gonio/brdf/convention_check.h"
#include "gonio/brdf/rgl_file.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return gonio::fuzz::trial(data, size, [](const auto& path) {
    const gonio::brdf::RglBrdf brdf(gonio::brdf::read_rgl(path));
    // What is read must evaluate, anywhere.
    gonio::brdf::check_conventions(
        [&](const gonio::brdf::DirectionPair& pair) { return brdf.one_way(pair); },
        [](const gonio::brdf::DirectionPair& pair) { return pair.wi.x() > 0.9; });
  });
}
