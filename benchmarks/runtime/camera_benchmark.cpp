// The camera driver: unpacking beside a copy of the same bytes measured in this run, and frames
// over loopback from the emulated camera, 1024 x 1024 Mono16 in packets of 9000 bytes.
//
// bytes_per_second is of packed input. Bars: 2 GB/s for the 12 bit packings, 300 frames/s.

#include <benchmark/benchmark.h>

#include <cstring>
#include <random>
#include <vector>

#include "gonio/aravis_camera/unpack.h"
#include "gonio/aravis_camera/wire_format.h"
#ifdef GONIO_WITH_ARAVIS
#include "gonio/private_network/private_network.h"
#include "wire_camera.h"
#endif

namespace gonio::aravis_camera {
namespace {

constexpr std::size_t kPixels = std::size_t{1024} * 1024;

std::vector<std::byte> random_bytes(std::size_t count) {
  std::mt19937 random(1);
  std::vector<std::byte> bytes(count);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

void count_bytes(benchmark::State& state, std::size_t bytes) {
  state.SetBytesProcessed(static_cast<std::int64_t>(bytes) *
                          static_cast<std::int64_t>(state.iterations()));
}

void copy_of_packed_12(benchmark::State& state) {
  const std::vector<std::byte> packed = random_bytes(packed_size(Packing::lsb_12p, kPixels));
  std::vector<std::byte> to(packed.size());
  for (auto _ : state) {
    std::memcpy(to.data(), packed.data(), packed.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  count_bytes(state, packed.size());
}
BENCHMARK(copy_of_packed_12)->UseRealTime();

using Unpack = void (*)(Packing, std::span<const std::byte>, std::span<std::uint16_t>);

void unpack_frame(benchmark::State& state, Unpack function, Packing packing) {
  const std::vector<std::byte> packed = random_bytes(packed_size(packing, kPixels));
  std::vector<std::uint16_t> dn(kPixels);
  for (auto _ : state) {
    function(packing, packed, dn);
    benchmark::DoNotOptimize(dn.data());
    benchmark::ClobberMemory();
  }
  count_bytes(state, packed.size());
}
BENCHMARK_CAPTURE(unpack_frame, 12p, &unpack, Packing::lsb_12p)->UseRealTime();
BENCHMARK_CAPTURE(unpack_frame, 12Packed, &unpack, Packing::gev_12_packed)->UseRealTime();
BENCHMARK_CAPTURE(unpack_frame, 10p, &unpack, Packing::lsb_10p)->UseRealTime();
BENCHMARK_CAPTURE(unpack_frame, 16, &unpack, Packing::word)->UseRealTime();

/// What a word format of 10 or 12 bits costs on top: are there numbers above it?
void bits_in_use_of_frame(benchmark::State& state) {
  const std::vector<std::uint16_t> dn(kPixels, 0x0FFF);
  for (auto _ : state) benchmark::DoNotOptimize(bits_in_use(dn));
  count_bytes(state, 2 * kPixels);
}
BENCHMARK(bits_in_use_of_frame)->UseRealTime();
BENCHMARK_CAPTURE(unpack_frame, 12p_plain, &unpack_plain, Packing::lsb_12p)->UseRealTime();
BENCHMARK_CAPTURE(unpack_frame, 12Packed_plain, &unpack_plain, Packing::gev_12_packed)
    ->UseRealTime();

#ifdef GONIO_WITH_ARAVIS
/// Frames per second as items; `bad` of them should be none.
void stream_over_loopback(benchmark::State& state) {
  WireCamera wire("Mono16", {}, 20.0, 1024, 1024);
  // Three in turn, as the test of every pixel (tests/drivers/aravis_stream_test.cpp) does.
  wire.emulator().show_when_free_running(
      {wire.pattern().still(), wire.pattern().still(), wire.pattern().still()},
      static_cast<double>(state.range(0)));
  AravisCamera camera = wire.open();
  constexpr int kFrames = 2000;
  double seconds = 0.0;
  for (auto _ : state) {
    int seen = 0;
    std::chrono::steady_clock::time_point first;
    camera.stream(std::chrono::milliseconds(1), [&](const devices::Frame&) {
      if (seen == 0) first = std::chrono::steady_clock::now();
      return ++seen <= kFrames;
    });
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - first;
    state.SetIterationTime(took.count());
    seconds += took.count();
  }
  state.counters["frames_per_s"] = kFrames * static_cast<double>(state.iterations()) / seconds;
  const CameraCounters counters = camera.counters();
  state.counters["bad"] =
      static_cast<double>(counters.incomplete + counters.out_of_order + counters.wrong_settings);
  state.counters["missing"] = static_cast<double>(counters.id_gaps);
}
// Sent at this rate or, where the machine does not get there, as fast as it goes; the last has no
// pace.
BENCHMARK(stream_over_loopback)
    ->Arg(400)
    ->Arg(1000000)
    ->UseManualTime()
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

/// One capture() with software trigger, settings read back and all, less the exposure of 1 ms in a
/// world twenty times faster.
void triggered_frame(benchmark::State& state) {
  WireCamera wire("Mono12p", {}, 20.0, 320, 256);
  AravisCamera camera = wire.open();
  camera.capture(std::chrono::milliseconds(1));  // the first after a start takes 0.1 s
  for (auto _ : state) benchmark::DoNotOptimize(camera.capture(std::chrono::milliseconds(1)));
}
BENCHMARK(triggered_frame)->UseRealTime()->Unit(benchmark::kMillisecond);
#endif

}  // namespace
}  // namespace gonio::aravis_camera

int main(int argc, char** argv) {
#ifdef GONIO_WITH_ARAVIS
  // So that no other camera on this machine is in the way; where refused, the host's loopback does.
  gonio::private_network::enter();
#endif
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
