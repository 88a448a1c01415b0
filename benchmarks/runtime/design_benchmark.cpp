// Direction choice on a basis of the real size, loaded, and what comes after a measurement.
//
// `of_floor` as in train_benchmark.cpp. `of_numpy`: time over that of the nearest thing in numpy on
// the same shapes, measured in this run through /usr/bin/python3; absent without numpy there. For
// the exchange it is a greedy choice of as many directions, two products of Q with a vector each;
// for the Xu metric the k-dimensional formula.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "gonio/basis/reconstruct.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/design/condition_search.h"
#include "gonio/design/exchange.h"
#include "gonio/design/expected_noise.h"
#include "gonio/design/image_importance.h"
#include "gonio/design/importance.h"
#include "gonio/design/leave_one_out.h"
#include "gonio/design/xu_search.h"
#include "gonio/random/distributions.h"
#include "gonio/random/key.h"
#include "machine.h"

namespace gonio::design {
namespace {

constexpr int kMaterials = 90;
constexpr Eigen::Index kComponents = 80;
constexpr int kSamples = 10;

/// Smooth random fields over the lattice with the decline of a measured spectrum.
const basis::Basis& some_basis() {
  static const basis::Basis made = [] {
    basis::Basis basis;
    for (int i = 0; i < kMaterials; ++i) basis.materials.push_back({std::to_string(i), "", ""});
    const auto p = static_cast<Eigen::Index>(basis_cell_count());
    basis.mean.resize(p);
    basis.components.resize(p, kComponents);
    const random::Key key = random::make_key(1, "benchmark.design");
    Eigen::ArrayXXf waves(kComponents, 4);
    for (Eigen::Index j = 0; j < waves.size(); ++j) {
      waves(j) = static_cast<float>(4.0 * random::normal(key, static_cast<std::uint64_t>(j)));
    }
    const Eigen::ArrayXf height =
        3.0F / Eigen::ArrayXf::LinSpaced(kComponents, 1.0F, static_cast<float>(kComponents));
    parallel::for_each_block(
        0, static_cast<std::size_t>(p), 4096, [&](std::size_t from, std::size_t to) {
          for (std::size_t i = from; i < to; ++i) {
            const auto row = static_cast<Eigen::Index>(i);
            const brdf::HalfDiff at = direction_of_basis_cell(static_cast<std::uint32_t>(i));
            const auto h = static_cast<float>(std::sqrt(at.theta_h.radians()));
            const auto d = static_cast<float>(at.theta_d.radians());
            const auto a = static_cast<float>(std::cos(2.0 * at.phi_d.radians()));
            basis.mean[row] = -2.0F - 2.0F * h;
            basis.components.row(row) =
                ((waves.col(0) * h + waves.col(1) * d + waves.col(2) * a + waves.col(3)).sin() *
                 height)
                    .matrix()
                    .transpose();
          }
        });
    Eigen::MatrixXd left(3 * kMaterials, kComponents);
    for (Eigen::Index j = 0; j < left.size(); ++j) {
      left(j) =
          random::normal(key, 100000 + static_cast<std::uint64_t>(j)) / std::sqrt(3.0 * kMaterials);
    }
    basis.left_vectors = left.rowwise() - left.colwise().mean();
    basis.singular_values = Eigen::VectorXd::LinSpaced(3 * kMaterials - 1, 3000.0, 1.0);
    return basis;
  }();
  return made;
}

const Eigen::MatrixXd& importance() {
  static const Eigen::MatrixXd matrix =
      importance_matrix(some_basis().components, importance_weights());
  return matrix;
}

const Candidates& candidates() {
  static const Candidates within{cells_within({})};
  return within;
}

/// Seconds that a line of Python prints; empty without numpy.
double numpy_seconds(const std::string& program) {
  const std::string command = "/usr/bin/python3 -c '" + program + "' 2>/dev/null";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::array<char, 64> line{};
  if (!pipe || std::fgets(line.data(), line.size(), pipe.get()) == nullptr) return 0.0;
  return std::strtod(line.data(), nullptr);
}

void compare(benchmark::State& state, double numpy, const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) work();
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  if (numpy > 0.0) {
    state.counters["of_numpy"] = time.count() / static_cast<double>(state.iterations()) / numpy;
  }
}

double numpy_greedy() {
  static const double seconds = numpy_seconds(
      "import numpy as np, time; q=np.ones((1096216,80),np.float32); v=np.ones(80,np.float32); "
      "q@v; t=time.time(); [(q@v, q@v) for i in range(10)]; print(time.time()-t)");
  return seconds;
}

double numpy_xu() {
  static const double seconds = numpy_seconds(
      "import numpy as np, time; r=np.random.RandomState(1); a=r.randn(10,80); u=r.randn(270,80); "
      "s=np.linspace(3000,1,80); f=lambda: np.linalg.norm((u-(u@a.T)@np.linalg.solve(a@a.T+40*"
      "np.eye(10),a))*s,axis=1).mean(); f(); t=time.time(); [f() for i in range(100)]; "
      "print((time.time()-t)/100)");
  return seconds;
}

Design chosen() {
  ExchangeOptions options;
  options.sample_count = kSamples;
  return exchange(some_basis().components, importance(), candidates(), options);
}

void exchange_ten(benchmark::State& state) {
  importance();
  compare(state, numpy_greedy(), [] { benchmark::DoNotOptimize(chosen()); });
}

void importance_of_cells(benchmark::State& state) {
  const Eigen::VectorXf weights = importance_weights();
  bench::measure(
      state, 0.5 * kComponents * kComponents * static_cast<double>(basis_cell_count()), 0.0,
      [&] { benchmark::DoNotOptimize(importance_matrix(some_basis().components, weights)); });
}

void importance_of_images(benchmark::State& state) {
  compare(state, 0.0, [] {
    benchmark::DoNotOptimize(image_importance(some_basis(), some_basis().left_vectors));
  });
}

void leave_one_out_ten(benchmark::State& state) {
  const Design start = chosen();
  compare(state, 0.0, [&] {
    benchmark::DoNotOptimize(leave_one_out_exchange(some_basis().components,
                                                    some_basis().left_vectors, importance(),
                                                    candidates(), start.cells, {}));
  });
}

void condition_number_ten(benchmark::State& state) {
  compare(state, 0.0, [] {
    benchmark::DoNotOptimize(condition_search(some_basis().components, candidates(), {}));
  });
}

void xu_search_ten(benchmark::State& state) {
  compare(state, 0.0, [] {
    benchmark::DoNotOptimize(xu_search(some_basis().components, some_basis().singular_values,
                                       some_basis().left_vectors, candidates(), {}));
  });
}

void xu_metric_ten(benchmark::State& state) {
  Eigen::MatrixXd rows(kSamples, kComponents);
  for (Eigen::Index i = 0; i < kSamples; ++i) {
    rows.row(i) = some_basis().components.row(100000 * i + 77).cast<double>();
  }
  compare(state, numpy_xu(), [&] {
    benchmark::DoNotOptimize(
        xu_metric(rows, some_basis().singular_values, some_basis().left_vectors, kXuEta));
  });
}

/// A fit, the whole BRDF, and the file on the disk; the basis is in memory.
void reconstruct_to_file(benchmark::State& state) {
  samples::SampleSet set;
  set.scale = some_basis().scale;
  for (int i = 0; i < kSamples; ++i) {
    samples::Sample sample;
    sample.direction = {Angle::from_degrees(2.0 + 4 * i), Angle::from_degrees(5.0 + 3 * i),
                        Angle::from_degrees(80.0), Angle()};
    sample.value_per_sr = brdf::Rgb::Constant(0.1 + 0.01 * i);
    sample.sigma_per_sr = 0.02 * sample.value_per_sr;
    set.samples.push_back(sample);
  }
  const std::filesystem::path out = std::filesystem::temp_directory_path() /
                                    ("gonio_design_benchmark_" + std::to_string(::getpid()));
  // Q read once, the table written twice: in memory and to the file.
  const double bytes = (static_cast<double>(basis_cell_count() * kComponents * sizeof(float)) +
                        2.0 * 3.0 * brdf::lattice::kCells * sizeof(double)) /
                       2.0;
  bench::measure(state, 0.0, bytes, [&] {
    const basis::Fit fit = basis::fit(some_basis(), set);
    brdf::write_merl(out, basis::expand(some_basis(), fit.coefficients), files::Overwrite::Yes);
  });
  std::filesystem::remove(out);
  std::filesystem::remove(out.string() + ".json");
}

void register_all() {
  const auto add = [](const char* name, void (*function)(benchmark::State&)) {
    benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMillisecond)->UseRealTime();
  };
  add("exchange_10", exchange_ten);
  add("leave_one_out_10", leave_one_out_ten);
  add("condition_number_10", condition_number_ten);
  add("xu_search_10", xu_search_ten);
  add("xu_metric_10", xu_metric_ten);
  add("importance_of_cells", importance_of_cells);
  add("importance_of_images", importance_of_images);
  add("reconstruct_to_file", reconstruct_to_file);
}

}  // namespace
}  // namespace gonio::design

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  gonio::design::register_all();
  gonio::bench::add_context();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
