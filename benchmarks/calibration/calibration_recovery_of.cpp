// A calibration that `gonio calibrate` has made of a hidden world, in process or over the wire,
// against the truth of that world.
//
//   calibration_recovery_of RIG SEED FOLDER

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/instrument/calibration_archive.h"
#include "gonio/setup/calibration_settings.h"
#include "gonio/setup/simulated_rig.h"
#include "recovery.h"

namespace {

using namespace gonio;

int run(const std::string& rig_path, std::uint64_t seed, const std::string& path) {
  const cli::RigFile rig = cli::read_rig_file(rig_path);
  const auto plate = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5));
  const sim::SimOptions truth = cli::simulated_world(rig, plate, seed);
  const calibration::routine::Folder folder{path};
  const auto serials = instrument::read_calibration_archive(folder.archive()).serials;
  const calibration::routine::Routine routine(
      cli::nominal_instrument(rig), cli::calibration_settings(rig), folder, serials,
      [] { return std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()); });
  const double angles = rig.world.camera.width_px < 2448 ? 3.0 : 1.0;  // as in the tests
  for (const auto& each : calibration::routine::test::recovered(routine, truth, angles)) {
    fmt::print("{:<40} {:>4} {:>10.5f} +- {:.5f}, limit {:.4f}\n", each.name, each.unit, each.error,
               each.sigma, each.limit);
  }
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: {} RIG SEED FOLDER\n", argv[0]);
    return EXIT_FAILURE;
  }
  try {
    return run(argv[1], std::stoull(argv[2]), argv[3]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
}
