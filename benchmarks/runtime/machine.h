#pragma once

#include <benchmark/benchmark.h>
#include <cblas.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gonio/parallel/parallel.h"
#include "gonio/version/version.h"

/// What the machine can do at best, measured in the same run as what is compared with it.
namespace gonio::bench {

/// Best of five.
inline double seconds_of(const std::function<void()>& work) {
  double best = 1e9;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
    best = std::min(best, time.count());
  }
  return best;
}

/// The machine's rates with as many threads as the library uses.
struct Machine {
  double multiply_adds_per_s = 0.0;
  double copied_bytes_per_s = 0.0;

  Machine() {
    const std::size_t threads = parallel::thread_count();
    constexpr int kSize = 768;
    std::vector<std::vector<float>> matrices(3 * threads);
    for (auto& matrix : matrices) matrix.assign(kSize * kSize, 0.5f);
    const double product = seconds_of([&] {
      parallel::for_each_block(0, threads, 1, [&](std::size_t i, std::size_t) {
        cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, kSize, kSize, kSize, 1.0f,
                    matrices[3 * i].data(), kSize, matrices[3 * i + 1].data(), kSize, 0.0f,
                    matrices[3 * i + 2].data(), kSize);
      });
    });
    multiply_adds_per_s = static_cast<double>(threads) * std::pow(kSize, 3) / product;

    constexpr std::size_t kBytes = std::size_t{64} << 20;
    std::vector<char> from(kBytes * threads, 1), to(kBytes * threads, 2);
    const double copy = seconds_of([&] {
      parallel::for_each_block(0, from.size(), kBytes, [&](std::size_t begin, std::size_t end) {
        std::memcpy(to.data() + begin, from.data() + begin, end - begin);
      });
    });
    copied_bytes_per_s = static_cast<double>(from.size()) / copy;
  }
};

inline const Machine& machine() {
  static const Machine measured;
  return measured;
}

/// Runs `work` for the benchmark's iterations and sets `of_floor`: its time over that of the
/// multiply-adds and copied bytes it cannot do without. 1 would be perfect.
inline void measure(benchmark::State& state, double multiply_adds, double bytes,
                    const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) work();
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  const double floor =
      std::max(multiply_adds / machine().multiply_adds_per_s, bytes / machine().copied_bytes_per_s);
  if (floor > 0.0) {
    state.counters["of_floor"] = time.count() / static_cast<double>(state.iterations()) / floor;
  }
}

/// Seconds that a line of Python prints; empty without numpy.
inline double numpy_seconds(const std::string& program) {
  const std::string command = "/usr/bin/python3 -c '" + program + "' 2>/dev/null";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::array<char, 64> line{};
  if (!pipe || std::fgets(line.data(), line.size(), pipe.get()) == nullptr) return 0.0;
  return std::strtod(line.data(), nullptr);
}

/// Runs `work` and sets `of_numpy`: its time over `numpy` seconds, absent for 0.
inline void compare(benchmark::State& state, double numpy, const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) work();
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  if (numpy > 0.0) {
    state.counters["of_numpy"] = time.count() / static_cast<double>(state.iterations()) / numpy;
  }
}

/// main() of a benchmark program: registers its benchmarks and runs those the arguments choose,
/// below revision, threads and the machine's rates.
inline int run(int argc, char** argv, void (*register_all)()) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  register_all();
  benchmark::AddCustomContext("revision", gonio::revision());
  benchmark::AddCustomContext("threads", std::to_string(parallel::thread_count()));
  benchmark::AddCustomContext("sgemm_gflops", std::to_string(2e-9 * machine().multiply_adds_per_s));
  benchmark::AddCustomContext("copy_gb_per_s", std::to_string(1e-9 * machine().copied_bytes_per_s));
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace gonio::bench
