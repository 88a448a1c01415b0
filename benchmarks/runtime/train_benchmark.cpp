// Training and expansion of a basis against what the machine can do at best.
//
// Every figure carries `of_floor`: its time over the time the unavoidable work would take at the
// rates measured just before, in this run, with the same number of threads: multiply-adds at the
// rate of a large sgemm, bytes at the rate of a copy. 1 would be perfect.
//
// `numpy_ms`: the nearest thing in numpy, through /usr/bin/python3 where that has it.
//
// GONIO_MERL_DIR=folder adds training end to end on the .binary files in it, read and written.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "gonio/basis/basis_file.h"
#include "gonio/basis/dense_field.h"
#include "gonio/brdf/merl_file.h"
#include "machine.h"

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

double cells() { return static_cast<double>(lobes().cells().size()); }
double rows() { return 3.0 * kMaterials; }

void map_table(benchmark::State& state) {
  const brdf::BrdfTable table = expand(basis(), Eigen::MatrixXd::Zero(1, 3));
  bench::measure(state, 0.0, 3.0 * cells() * (sizeof(double) + sizeof(float)) / 2.0,
                 [&] { benchmark::DoNotOptimize(mapped_values(LogMapping{}, table)); });
}

/// The same product in numpy, of rows that lie in memory already.
double numpy_gram() {
  static const double seconds = bench::numpy_seconds(
      "import numpy as np, time; x=np.ones((120,1096216),np.float32); x[:4]@x[:4].T; "
      "t=time.time(); x@x.T; print(time.time()-t)");
  return seconds;
}

void gram(benchmark::State& state) {
  bench::measure(state, 0.5 * rows() * rows() * cells(), 0.0,
                 [] { benchmark::DoNotOptimize(centred_gram(lobes())); });
  if (const double numpy = numpy_gram(); numpy > 0.0) {
    state.counters["numpy_ms"] = 1e3 * numpy;
  }
}

void train_from_gram(benchmark::State& state) {
  const Eigen::MatrixXd matrix = centred_gram(lobes());
  bench::measure(state, rows() * kComponents * cells(), 0.0,
                 [&] { benchmark::DoNotOptimize(train(lobes(), matrix, kComponents)); });
}

void expand_coefficients(benchmark::State& state) {
  const Eigen::MatrixXd c = Eigen::MatrixXd::Constant(basis().component_count(), 3, 0.01);
  // Reading Q and writing the table; a copied byte is read and written.
  const double q = cells() * basis().component_count() * sizeof(float);
  bench::measure(state, 0.0, (q + 3.0 * brdf::lattice::kCells * sizeof(double)) / 2.0,
                 [&] { benchmark::DoNotOptimize(expand(basis(), c)); });
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
  bench::measure(state, (0.5 * m * m + m * kDefaultComponents) * cells(), 0.0, [&] {
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
  return gonio::bench::run(argc, argv, gonio::basis::register_all);
}
