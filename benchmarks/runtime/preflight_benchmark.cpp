// The check before anything moves, with its forecast, and the order of a plan; on the default rig.
//
// `of_second`    Time over the second that the check of 1,000 points may take.
// `of_geometry`  Time over that of looking at the same places of the sample once, on as many
//                threads: what the forecast cannot do without.
// `of_bound`     Travel over the least that any order could take.
// `of_list`      Travel over that of the order of the list.

#include <benchmark/benchmark.h>

#include <cmath>

#include "gonio/acquisition/preflight.h"
#include "gonio/brdf/builtin_materials.h"
#include "gonio/instrument/measurement_equation.h"
#include "gonio/random/distributions.h"
#include "gonio/setup/simulated_rig.h"
#include "gonio/sim/sim_goniometer.h"
#include "machine.h"

namespace gonio::acquisition {
namespace {

constexpr int kPlaces = 144;  // of a point, as the forecast looks at it

std::vector<samples::Direction> directions(const rig::Inverse& inverse, int count,
                                           std::uint64_t seed) {
  const random::Key key = random::make_key(seed, "benchmark.directions");
  std::vector<samples::Direction> found;
  for (std::uint64_t i = 0; static_cast<int>(found.size()) < count; i += 3) {
    samples::Direction direction;
    direction.angles.theta_h = Angle::from_degrees(80.0 * std::pow(random::uniform(key, i), 2));
    direction.angles.theta_d = Angle::from_degrees(4.0 + 75.0 * random::uniform(key, i + 1));
    direction.angles.phi_d = Angle::from_degrees(180.0 * random::uniform(key, i + 2));
    if (!inverse.solve(direction.angles).poses.empty()) found.push_back(direction);
  }
  return found;
}

/// In the order of the list: how they lie does not matter to what looks at them.
MeasurementPlan listed(const rig::Inverse& inverse, int count) {
  MeasurementPlan plan;
  for (const samples::Direction& direction : directions(inverse, count, 1)) {
    plan.points.push_back({direction.angles, inverse.solve(direction.angles).poses.front()});
  }
  return plan;
}

struct Bench {
  Bench() : known(cli::nominal_instrument(rig)), inverse(known.rig) {
    expectation.sample.brdf = [this](std::size_t, const brdf::DirectionPair& pair) {
      return material->evaluate(pair);
    };
    expectation.sample.point_sigma_ln = 0.1;
    for (const auto& channel : rig.world.lamp.channels) {
      expectation.light.channels.push_back(
          {channel.name, rig.world.camera.dn_per_electron * rig.world.camera.responsivity_e_per_s *
                             1e6 * channel.intensity_w_per_sr});
    }
  }
  cli::RigFile rig = cli::default_rig_file();
  instrument::Instrument known;
  rig::Inverse inverse;
  std::shared_ptr<const brdf::BrdfModel> material = brdf::builtin_material("gold-satin").model;
  sim::SimGoniometer world{cli::simulated_world(rig, material, 1)};
  Expectation expectation;
};

double geometry_seconds(const Bench& bench, const MeasurementPlan& plan) {
  return bench::seconds_of([&] {
    parallel::for_each_block(0, plan.points.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const rig::RigPose pose = rig::forward(bench.known.rig, plan.points[i].pose.joints);
        for (int place = 0; place < kPlaces; ++place) {
          benchmark::DoNotOptimize(
              instrument::pixel_geometry(bench.known, pose, 100.0 + place % 12, place / 12));
        }
      }
    });
  });
}

void preflight_of(benchmark::State& state) {
  Bench bench;
  const MeasurementPlan plan = listed(bench.inverse, static_cast<int>(state.range(0)));
  const double geometry_s = geometry_seconds(bench, plan);
  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) {
    benchmark::DoNotOptimize(preflight(cli::devices_of(bench.world), bench.known, plan,
                                       bench.rig.session, &bench.expectation));
  }
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  const double each_s = time.count() / static_cast<double>(state.iterations());
  state.counters["of_second"] = each_s;
  state.counters["of_geometry"] = each_s / geometry_s;
}

void order_of_200(benchmark::State& state) {
  const Bench bench;
  const auto list = directions(bench.inverse, 200, static_cast<std::uint64_t>(state.range(0)));
  MeasurementPlan plan;
  for (auto _ : state) plan = make_plan(bench.inverse, list, 1.0, 0.0);
  const rig::TravelModel travel(bench.known.rig);
  rig::Joints at = tour_ends(bench.known.rig);
  double listed_s = 0.0;
  for (const samples::Direction& direction : list) {
    const rig::Joints to = bench.inverse.solve(direction.angles).poses.front().joints;
    listed_s += travel.seconds(at, to);
    at = to;
  }
  state.counters["of_bound"] = plan.travel_s / plan.lower_bound_s;
  state.counters["of_list"] = plan.travel_s / listed_s;
}

void register_all() {
  benchmark::RegisterBenchmark("preflight", preflight_of)
      ->Arg(100)
      ->Arg(1000)
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
  benchmark::RegisterBenchmark("order_200_seed", order_of_200)
      ->DenseRange(1, 5)
      ->Iterations(1)
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

}  // namespace
}  // namespace gonio::acquisition

int main(int argc, char** argv) {
  return gonio::bench::run(argc, argv, gonio::acquisition::register_all);
}
