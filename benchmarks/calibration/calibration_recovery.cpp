// Calibrates hidden worlds and compares what was found with what is true: errors against their
// limits, and against the uncertainties that the calibration states.
//
//   calibration_recovery quarter|full FIRST_SEED LAST_SEED FOLDER
//
// What the steps saw stays in FOLDER/SEED: a second run evaluates it again, in seconds.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "hidden_bench.h"
#include "recovery.h"

namespace gonio::calibration::routine::test {
namespace {

constexpr instrument::UtcSeconds kNoon{std::chrono::seconds(1'700'000'000)};
// A quarter of the pixels sees a quarter of the angle.
constexpr double kAnglesAtAQuarter = 3.0;

/// What holds 95.45 % of a normal deviate, and of the length of two.
double two_sigma(int components) {
  return components == 1 ? 2.0 : std::sqrt(-2.0 * std::log(0.0455));
}

std::vector<Recovered> calibrate(std::uint64_t seed, sim::HiddenImage size,
                                 const std::filesystem::path& folder) {
  HiddenBench bench(seed, size);
  Routine routine(HiddenBench::nominal(size), HiddenBench::settings(), {folder},
                  {{"camera", "sim"}}, [] { return kNoon; });
  for (const instrument::CalibrationStep& step : instrument::calibration_steps()) {
    const std::string name(step.name);
    if (routine.state_of(name) == instrument::StepState::valid) continue;
    const auto begin = std::chrono::steady_clock::now();
    routine.take(name, bench.devices, {}, {});
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
    fmt::print(stderr, "seed {}: {} {:.1f} s\n", seed, name, time.count());
  }
  const bool full = size == sim::HiddenImage::full_size;
  return recovered(routine, bench.world.truth(), full ? 1.0 : kAnglesAtAQuarter);
}

/// Rows that share their error nearly whole count once: one of each stands for them. The zeros of
/// azimuth and tilt stand for the sample's normal, which is made from them.
bool is_mode(const std::string& name) {
  if (name.starts_with("sample normal")) return false;
  for (const auto& [rows, stands] : {std::pair<std::string, std::string>{"pixel ray", "0.3 0.3"},
                                     {"wi at", "85"},
                                     {"white constant", "G"}}) {
    if (name.starts_with(rows)) return name.find(stands) != std::string::npos;
  }
  return true;
}

struct Row {
  Recovered any;
  std::vector<Recovered> seeds;
};

void print(const std::vector<Row>& rows) {
  fmt::print("{:<42} {:>5} {:>10} {:>10} {:>10} {:>10} {:>7} {:>7} {:>7}\n", "quantity", "unit",
             "mean", "rms", "worst", "limit", "passed", "rms z", "2sigma");
  for (const Row& row : rows) {
    double mean = 0.0, squares = 0.0, worst = 0.0, z_squares = 0.0;
    int passed = 0, covered = 0;
    for (const Recovered& r : row.seeds) {
      mean += r.error;
      squares += r.error * r.error;
      worst = std::max(worst, std::abs(r.error));
      if (std::abs(r.error) < r.limit) ++passed;
      const double z = r.error / r.sigma;
      z_squares += z * z / r.components;
      if (std::abs(z) < two_sigma(r.components)) ++covered;
    }
    const auto n = static_cast<double>(row.seeds.size());
    const bool stated = row.any.sigma > 0.0;
    fmt::print("{:<42} {:>5} {:>10.5f} {:>10.5f} {:>10.5f} {:>10.5f} {:>4}/{:<2} {:>7} {:>7}\n",
               row.any.name, row.any.unit, mean / n, std::sqrt(squares / n), worst, row.any.limit,
               passed, row.seeds.size(),
               stated ? fmt::format("{:.2f}", std::sqrt(z_squares / n)) : "-",
               stated ? fmt::format("{:.0f} %", 100.0 * covered / n) : "-");
  }
}

int run(sim::HiddenImage size, std::uint64_t first, std::uint64_t last,
        const std::filesystem::path& folder) {
  std::vector<Row> rows;
  std::size_t modes = 0, covered = 0, missed = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const auto begin = std::chrono::steady_clock::now();
    std::vector<Recovered> found;
    try {
      found = calibrate(seed, size, folder / std::to_string(seed));
    } catch (const std::exception& error) {
      fmt::print(stderr, "seed {}: {}\n", seed, error.what());
      ++missed;
      continue;
    }
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
    fmt::print(stderr, "seed {}: {:.0f} s\n", seed, time.count());
    if (rows.empty()) {
      for (const Recovered& r : found) rows.push_back({r, {}});
    }
    for (std::size_t k = 0; k < found.size(); ++k) {
      rows[k].seeds.push_back(found[k]);
      if (!is_mode(found[k].name)) continue;
      ++modes;
      if (std::abs(found[k].error) < two_sigma(found[k].components) * found[k].sigma) ++covered;
    }
  }
  print(rows);
  fmt::print("within 2 sigma, rows of one common error counted once: {} of {}, {:.1f} %\n", covered,
             modes, 100.0 * static_cast<double>(covered) / static_cast<double>(modes));
  return missed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace gonio::calibration::routine::test

int main(int argc, char** argv) {
  using namespace gonio;
  const std::string size = argc == 5 ? argv[1] : "";
  if (size != "quarter" && size != "full") {
    fmt::print(stderr, "usage: {} quarter|full FIRST_SEED LAST_SEED FOLDER\n", argv[0]);
    return EXIT_FAILURE;
  }
  return calibration::routine::test::run(
      size == "full" ? sim::HiddenImage::full_size : sim::HiddenImage::small, std::stoull(argv[2]),
      std::stoull(argv[3]), argv[4]);
}
