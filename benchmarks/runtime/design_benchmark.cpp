// Direction choice on a basis of the real size, loaded.
//
// `of_floor` as in train_benchmark.cpp. `of_numpy`: time over that of the nearest thing in numpy on
// the same shapes, measured in this run through /usr/bin/python3; absent without numpy there. For
// the exchange it is a greedy choice of as many directions, two products of Q with a vector each;
// for the Xu metric the k-dimensional formula.

#include <benchmark/benchmark.h>

#include "gonio/basis/reconstruct.h"
#include "gonio/design/condition_search.h"
#include "gonio/design/exchange.h"
#include "gonio/design/expected_noise.h"
#include "gonio/design/image_importance.h"
#include "gonio/design/importance.h"
#include "gonio/design/leave_one_out.h"
#include "gonio/design/near_field.h"
#include "gonio/design/pose_exchange.h"
#include "gonio/design/xu_search.h"
#include "machine.h"
#include "some_basis.h"

namespace gonio::design {
namespace {

using bench::kComponents;
using bench::some_basis;

constexpr int kSamples = 10;

const Eigen::MatrixXd& importance() {
  static const Eigen::MatrixXd matrix =
      importance_matrix(some_basis().components, importance_weights());
  return matrix;
}

const Candidates& candidates() {
  static const Candidates within{cells_within({})};
  return within;
}

double numpy_greedy() {
  static const double seconds = bench::numpy_seconds(
      "import numpy as np, time; q=np.ones((1096216,80),np.float32); v=np.ones(80,np.float32); "
      "q@v; t=time.time(); [(q@v, q@v) for i in range(10)]; print(time.time()-t)");
  return seconds;
}

double numpy_xu() {
  static const double seconds = bench::numpy_seconds(
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
  bench::compare(state, numpy_greedy(), [] { benchmark::DoNotOptimize(chosen()); });
}

void importance_of_cells(benchmark::State& state) {
  const Eigen::VectorXf weights = importance_weights();
  bench::measure(
      state, 0.5 * kComponents * kComponents * static_cast<double>(basis_cell_count()), 0.0,
      [&] { benchmark::DoNotOptimize(importance_matrix(some_basis().components, weights)); });
}

void importance_of_images(benchmark::State& state) {
  bench::compare(state, 0.0, [] {
    benchmark::DoNotOptimize(image_importance(some_basis(), some_basis().left_vectors));
  });
}

void leave_one_out_ten(benchmark::State& state) {
  const Design start = chosen();
  bench::compare(state, 0.0, [&] {
    benchmark::DoNotOptimize(leave_one_out_exchange(some_basis().components,
                                                    some_basis().left_vectors, importance(),
                                                    candidates(), start.cells, {}));
  });
}

void condition_number_ten(benchmark::State& state) {
  bench::compare(state, 0.0, [] {
    benchmark::DoNotOptimize(condition_search(some_basis().components, candidates(), {}));
  });
}

void xu_search_ten(benchmark::State& state) {
  bench::compare(state, 0.0, [] {
    benchmark::DoNotOptimize(xu_search(some_basis().components, some_basis().singular_values,
                                       some_basis().left_vectors, candidates(), {}));
  });
}

void xu_metric_ten(benchmark::State& state) {
  Eigen::MatrixXd rows(kSamples, kComponents);
  for (Eigen::Index i = 0; i < kSamples; ++i) {
    rows.row(i) = some_basis().components.row(100000 * i + 77).cast<double>();
  }
  bench::compare(state, numpy_xu(), [&] {
    benchmark::DoNotOptimize(xu_metric(rows, some_basis().singular_values,
                                       some_basis().left_vectors, basis::kPublishedEta));
  });
}

void patch_design_ten(benchmark::State& state) {
  const auto allowed = [](const brdf::HalfDiff& pose) { return within({}, pose); };
  const PoseCandidates poses{pose_grid(2.0, allowed), allowed, {}};
  const PatchGeometry patch = PatchGeometry::of_half_width(25.0).coarse();
  importance();
  bench::compare(state, 0.0, [&] {
    benchmark::DoNotOptimize(choose_poses(some_basis(), importance(), poses, patch, {}));
  });
  state.counters["poses"] = static_cast<double>(poses.poses.size());
}

void near_field_pair(benchmark::State& state) {
  importance();
  bench::compare(state, 0.0, [] {
    benchmark::DoNotOptimize(choose_shots(some_basis(), importance(), {}, {}));
  });
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
  add("patch_design_10", patch_design_ten);
  add("near_field_pair", near_field_pair);
}

}  // namespace
}  // namespace gonio::design

int main(int argc, char** argv) {
  return gonio::bench::run(argc, argv, gonio::design::register_all);
}
