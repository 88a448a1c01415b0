// Training and expansion of a basis against what the machine can do at best.
//
// Every figure carries `of_floor`: its time over the time the unavoidable work would take at the
// rates measured just before, in this run, with the same number of threads: multiply-adds at the
// rate of a large sgemm, bytes at the rate of a copy. 1 would be perfect.
//
// GONIO_MERL_DIR=folder adds training end to end on the .binary files in it, read and written.

#include <benchmark/benchmark.h>
#include <cblas.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "gonio/basis/basis_file.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/parallel/parallel.h"
#include "gonio/version/version.h"

namespace gonio::basis {
namespace {

constexpr int kMaterials = 40;
constexpr int kComponents = 80;

class Lobe final : public brdf::BrdfModel {
 public:
  explicit Lobe(int index) : index_(index) {}

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry& geometry) const override {
    const double slope = geometry.sin_theta_h * (3.0 + 0.7 * index_);
    const double lobe =
        std::exp(-slope * slope) * (1.0 + index_ % 7) * (2.0 - geometry.cos_theta_d);
    return {0.05 + lobe, 0.1 + 0.7 * lobe, 0.02 * (1 + index_ % 5) + 0.5 * lobe};
  }
  int index_;
};

double seconds_of(const std::function<void()>& work) {
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
struct Floor {
  double multiply_adds_per_s = 0.0;
  double copied_bytes_per_s = 0.0;

  Floor() {
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

const Floor& machine() {
  static const Floor measured;
  return measured;
}

const TrainingSet& lobes() {
  static const TrainingSet set = [] {
    TrainingSet made(brdf::RadiometricScale::si);
    for (int i = 0; i < kMaterials; ++i) made.add({std::to_string(i), "", "-"}, Lobe(i));
    return made;
  }();
  return set;
}

const Basis& basis() {
  static const Basis trained = train(lobes(), centred_gram(lobes()), kComponents);
  return trained;
}

/// Runs `work` for the benchmark's iterations and sets `of_floor`.
void measure(benchmark::State& state, double multiply_adds, double bytes,
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

double cells() { return static_cast<double>(lobes().cells().size()); }
double rows() { return 3.0 * kMaterials; }

void map_table(benchmark::State& state) {
  const brdf::BrdfTable table = expand(basis(), Eigen::MatrixXd::Zero(1, 3));
  measure(state, 0.0, 3.0 * cells() * (sizeof(double) + sizeof(float)) / 2.0,
          [&] { benchmark::DoNotOptimize(mapped_values(LogMapping{}, table)); });
}

void gram(benchmark::State& state) {
  measure(state, 0.5 * rows() * rows() * cells(), 0.0,
          [] { benchmark::DoNotOptimize(centred_gram(lobes())); });
}

void train_from_gram(benchmark::State& state) {
  const Eigen::MatrixXd matrix = centred_gram(lobes());
  measure(state, rows() * kComponents * cells(), 0.0,
          [&] { benchmark::DoNotOptimize(train(lobes(), matrix, kComponents)); });
}

void expand_coefficients(benchmark::State& state) {
  const Eigen::MatrixXd c = Eigen::MatrixXd::Constant(basis().component_count(), 3, 0.01);
  // Reading Q and writing the table; a copied byte is read and written.
  const double q = cells() * basis().component_count() * sizeof(float);
  measure(state, 0.0, (q + 3.0 * brdf::lattice::kCells * sizeof(double)) / 2.0,
          [&] { benchmark::DoNotOptimize(expand(basis(), c)); });
}

void fit_ninety_samples(benchmark::State& state) {
  samples::SampleSet set;
  for (int i = 0; i < 90; ++i) {
    samples::Sample sample;
    sample.direction = {Angle::from_degrees(1.0 + 7 * (i / 9)), Angle::from_degrees(5.0 + i % 9),
                        Angle::from_degrees(80.0), Angle()};
    sample.value_per_sr = brdf::Rgb::Constant(0.1 + 0.01 * (i % 11));
    sample.sigma_per_sr = 0.02 * sample.value_per_sr;
    sample.u_common_per_sr = 0.02 * sample.value_per_sr;
    sample.u_theta_h = Angle::from_degrees(0.05);
    sample.pose = i / 9;
    set.samples.push_back(sample);
  }
  measure(state, 0.0, 0.0, [&] { benchmark::DoNotOptimize(fit(basis(), set)); });
}

void train_files(benchmark::State& state, const std::filesystem::path& folder) {
  std::vector<MaterialFile> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".binary") files.push_back({entry.path(), ""});
  }
  std::sort(files.begin(), files.end(),
            [](const MaterialFile& a, const MaterialFile& b) { return a.path < b.path; });
  const std::filesystem::path out = std::filesystem::temp_directory_path() /
                                    ("gonio_train_benchmark_" + std::to_string(::getpid()));
  const double m = 3.0 * static_cast<double>(files.size());
  measure(state, (0.5 * m * m + m * kDefaultComponents) * cells(), 0.0, [&] {
    TrainingSet set(brdf::read_merl(files.at(0).path).scale());
    set.add_files(files);
    write_basis(out, train(set, centred_gram(set)), files::Overwrite::Yes);
  });
  std::filesystem::remove(out);
}

void register_all() {
  const auto add = [](const char* name, void (*function)(benchmark::State&)) {
    benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMillisecond)->UseRealTime();
  };
  add("map_table", map_table);
  add("gram", gram);
  add("train_from_gram", train_from_gram);
  add("expand", expand_coefficients);
  add("fit_ninety_samples", fit_ninety_samples);
  if (const char* const folder = std::getenv("GONIO_MERL_DIR")) {
    benchmark::RegisterBenchmark("train_files", train_files, std::filesystem::path(folder))
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime()
        ->Iterations(1);
  }
}

}  // namespace
}  // namespace gonio::basis

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  gonio::basis::register_all();
  const auto& machine = gonio::basis::machine();
  benchmark::AddCustomContext("revision", gonio::revision());
  benchmark::AddCustomContext("threads", std::to_string(gonio::parallel::thread_count()));
  benchmark::AddCustomContext("sgemm_gflops", std::to_string(2e-9 * machine.multiply_adds_per_s));
  benchmark::AddCustomContext("copy_gb_per_s", std::to_string(1e-9 * machine.copied_bytes_per_s));
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
