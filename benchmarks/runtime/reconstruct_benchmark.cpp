// What comes after a measurement, on a basis of the real size, loaded. `of_floor` as in
// train_benchmark.cpp.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "gonio/basis/reconstruct.h"
#include "gonio/basis/uncertainty.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/design/candidates.h"
#include "machine.h"
#include "some_basis.h"

namespace gonio::basis {
namespace {

using bench::some_basis;

/// Samples at cells spread over the lattice, of `per_pose` sub-samples a pose.
samples::SampleSet some_samples(int count, int per_pose) {
  samples::SampleSet set;
  set.scale = some_basis().scale;
  const auto step =
      static_cast<std::uint32_t>(design::basis_cell_count() / static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    samples::Sample sample;
    sample.direction = design::direction_of_basis_cell(step * static_cast<std::uint32_t>(i));
    sample.value_per_sr = brdf::Rgb::Constant(0.1 + 0.01 * (i % 11));
    sample.sigma_per_sr = 0.02 * sample.value_per_sr;
    sample.u_common_per_sr = 0.02 * sample.value_per_sr;
    sample.u_theta_h = Angle::from_degrees(0.05);
    sample.pose = i / per_pose;
    set.samples.push_back(sample);
  }
  return set;
}

void fit_samples(benchmark::State& state, int count, int per_pose) {
  const samples::SampleSet set = some_samples(count, per_pose);
  bench::measure(state, 0.0, 0.0, [&] { benchmark::DoNotOptimize(fit(some_basis(), set)); });
}

/// Bytes of Q read once and a table written once, as copied bytes.
double expanded_bytes() {
  return (static_cast<double>(some_basis().components.size() * sizeof(float)) +
          3.0 * brdf::lattice::kCells * sizeof(double)) /
         2.0;
}

void expand_coefficients(benchmark::State& state) {
  const Fit found = fit(some_basis(), some_samples(10, 1));
  bench::measure(state, 0.0, expanded_bytes(),
                 [&] { benchmark::DoNotOptimize(expand(some_basis(), found.coefficients)); });
}

void bands(benchmark::State& state) {
  const Fit found = fit(some_basis(), some_samples(10, 1));
  bench::measure(state, 0.0, expanded_bytes(),
                 [&] { benchmark::DoNotOptimize(uncertainty(some_basis(), found)); });
}

/// A fit, the whole BRDF, and the file on the disk.
void reconstruct_to_file(benchmark::State& state) {
  const samples::SampleSet set = some_samples(10, 1);
  const std::filesystem::path out = std::filesystem::temp_directory_path() /
                                    ("gonio_reconstruct_benchmark_" + std::to_string(::getpid()));
  // The table is written once more, to the file.
  const double bytes = expanded_bytes() + 3.0 * brdf::lattice::kCells * sizeof(double) / 2.0;
  bench::measure(state, 0.0, bytes, [&] {
    const Fit found = fit(some_basis(), set);
    brdf::write_merl(out, expand(some_basis(), found.coefficients), files::Overwrite::Yes);
  });
  std::filesystem::remove(out);
  std::filesystem::remove(out.string() + ".json");
}

void register_all() {
  const auto add = [](const char* name, auto function) {
    benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMillisecond)->UseRealTime();
  };
  add("fit_10_points", [](benchmark::State& state) { fit_samples(state, 10, 1); });
  add("fit_10_patches_of_25", [](benchmark::State& state) { fit_samples(state, 250, 25); });
  add("fit_8000_points", [](benchmark::State& state) { fit_samples(state, 8000, 1); });
  add("expand", expand_coefficients);
  add("bands", bands);
  add("reconstruct_to_file", reconstruct_to_file);
}

}  // namespace
}  // namespace gonio::basis

int main(int argc, char** argv) {
  return gonio::bench::run(argc, argv, gonio::basis::register_all);
}
