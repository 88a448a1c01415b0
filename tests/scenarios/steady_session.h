#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "gonio/acquisition/resume.h"
#include "gonio/brdf/builtin_materials.h"
#include "gonio/files/text_file.h"
#include "simulated_session.h"
#include "temporary_folder.h"

namespace gonio {

inline const std::vector<std::array<double, 3>> kTwelveDirections{
    {3.0, 12.0, 28.0},  {39.0, 60.0, 89.0},  {15.0, 30.0, 130.0}, {2.0, 60.0, 180.0},
    {20.0, 20.0, 60.0}, {5.0, 20.0, 40.0},   {10.0, 25.0, 90.0},  {8.0, 40.0, 100.0},
    {25.0, 30.0, 70.0}, {30.0, 45.0, 110.0}, {12.0, 35.0, 20.0},  {18.0, 35.0, 150.0}};

/// A world of 64 x 52 px in which only noise is random. Without play: from which side an axis took
/// it up at its home is not known.
inline sim::SimOptions steady_world() {
  sim::SimOptions world = sim::nominal_options(brdf::builtin_materials().front().model, 7);
  constexpr double kCoarser = 5.0;
  sim::CameraOptions& camera = world.camera;
  camera.width_px = 64;
  camera.height_px = 52;
  camera.fx_px /= kCoarser;
  camera.fy_px /= kCoarser;
  camera.cx_px = 31.5;
  camera.cy_px = 25.5;
  world.lamp.drift_sigma = 0.0;
  world.lamp.warm_up_amplitude = 0.0;
  world.same_noise_again = true;
  sim::AxisOptions axis;
  axis.homing_sigma = Angle();
  axis.positioning_sigma = Angle();
  world.axes.assign(world.rig.axes.size(), axis);
  return world;
}

/// Lamp, monitor and axes with the errors of the nominal world instead.
inline void take_nominal_errors(sim::SimOptions& world) {
  const sim::SimOptions nominal = sim::nominal_options(brdf::builtin_materials().front().model, 7);
  world.lamp = nominal.lamp;
  world.axes = nominal.axes;
  world.axes.resize(world.rig.axes.size());
  world.same_noise_again = false;
}

/// Sessions of twelve points in steady_world(), and such that go on.
class SteadySession : public testing::Test {
 protected:
  using Progress = std::function<void(const acquisition::SessionProgress&)>;

  SteadySession() {
    options_.white_frames = 1;
    options_.dark_frames = 2;
    options_.relative_sigma = 0.02;
    options_.spot_half_width_mm = 4.0;
    reduction_.spot_half_width_mm = 4.0;
    reduction_.grid = 3;
  }

  virtual acquisition::DeviceSet devices(sim::SimGoniometer& world) const {
    acquisition::DeviceSet set = devices_of(world);
    set.begin_subject = [&world](std::uint64_t subject) { world.begin_subject(subject); };
    return set;
  }

  /// Runs it, and looks at the rig after whatever end.
  acquisition::SessionResult run(sim::SimGoniometer& world, acquisition::SessionWriter& archive,
                                 const Progress& progress,
                                 const acquisition::SessionPart& part = {},
                                 std::stop_token stop = {}) const {
    struct Safe {
      sim::SimGoniometer& world;
      ~Safe() {
        for (std::size_t i = 0; i < world.axis_count(); ++i) {
          EXPECT_THROW(world.stage(i).begin_move_to(Angle()), devices::DeviceError)
              << "axis " << i << " was not stopped";
        }
        constexpr double kDark = 0.1;  // of a lit channel's reading
        EXPECT_LT(world.lamp_monitor().read(), kDark) << "the shutter is open";
      }
    };
    const Safe safe{world};
    return acquisition::run_session(devices(world), known_, plan_, options_, archive, progress,
                                    std::move(stop), part);
  }

  acquisition::SessionResult begin(const std::filesystem::path& folder,
                                   const Progress& progress = {}) const {
    sim::SimGoniometer world(world_);
    acquisition::SessionWriter archive(folder, {{"sample_id", "plate"}}, {});
    return run(world, archive, progress);
  }

  acquisition::SessionResult resume(const std::filesystem::path& folder,
                                    const Progress& progress = {},
                                    std::stop_token pause = {}) const {
    files::ProcessLock lock(acquisition::session_lock(folder));
    const acquisition::ResumeState state =
        acquisition::resume_state(acquisition::SessionReader(folder));
    sim::SimOptions later = world_;
    later.begins_at = state.may_begin_at + outage_;
    later.power_ups = static_cast<std::uint64_t>(state.parts);
    later.axes.resize(later.rig.axes.size());
    // Where it was left, but for what a test says happened meanwhile.
    for (std::size_t i = 0; i < state.last_joints.size(); ++i) {
      later.axes[i].stands_at =
          state.last_joints[i] + (i == kTurnedAxis ? turned_meanwhile_ : Angle());
    }
    sim::SimGoniometer world(later);
    acquisition::SessionWriter archive = acquisition::SessionWriter::resume(
        folder, std::move(lock), later.begins_at, world.clock().now(), "in a test");
    acquisition::SessionPart part = acquisition::part_to_resume(state);
    part.pause = std::move(pause);
    return run(world, archive, progress, part);
  }

  /// Paused after six points; then `meanwhile` happens, and it is gone on with.
  void interrupt_and_resume(const std::filesystem::path& folder,
                            const std::function<void()>& meanwhile = {}) {
    std::stop_source pause;
    {
      sim::SimGoniometer world(world_);
      acquisition::SessionWriter archive(folder, {}, {});
      acquisition::SessionPart part;
      part.pause = pause.get_token();
      run(
          world, archive,
          [&](const acquisition::SessionProgress& now) {
            if (now.done == 5) pause.request_stop();
          },
          part);
    }
    if (meanwhile) meanwhile();
    EXPECT_TRUE(resume(folder).complete);
  }

  acquisition::Reduction reduced(const std::filesystem::path& folder) const {
    return acquisition::reduce(acquisition::SessionReader(folder), known_, reduction_);
  }

  /// The worst point's mean deviation from the untroubled session, relative.
  double worst_deviation(const acquisition::Reduction& found,
                         const std::filesystem::path& untroubled) const {
    const acquisition::Reduction whole = reduced(untroubled);
    EXPECT_EQ(found.samples.samples.size(), whole.samples.samples.size());
    std::map<int, std::pair<double, double>> sums;
    for (std::size_t i = 0; i < whole.samples.samples.size(); ++i) {
      auto& [before, after] = sums[whole.samples.samples[i].pose];
      before += whole.samples.samples[i].value_per_sr.sum();
      after += found.samples.samples[i].value_per_sr.sum();
    }
    EXPECT_EQ(sums.size(), plan_.points.size());
    double worst = 0.0;
    for (const auto& entry : sums) {
      worst = std::max(worst, std::abs(entry.second.second / entry.second.first - 1.0));
    }
    return worst;
  }

  /// The texts of the notes of a kind, in their order.
  static std::vector<std::string> notes_of(const std::filesystem::path& folder,
                                           const std::string& kind) {
    std::vector<std::string> texts;
    const acquisition::SessionReader archive(folder);
    for (const acquisition::SessionNote& note : archive.notes()) {
      if (note.kind == kind) texts.push_back(note.text);
    }
    return texts;
  }

  std::string samples_of(const std::filesystem::path& folder) const {
    const TemporaryFolder scratch;
    samples::write_samples(scratch.path() / "samples.csv", reduced(folder).samples);
    return files::read_text_file(scratch.path() / "samples.csv");
  }

  sim::SimOptions world_ = steady_world();
  static constexpr std::size_t kTurnedAxis = 1;
  Angle turned_meanwhile_;  ///< one axis, while a session is interrupted
  std::chrono::seconds outage_{100};
  instrument::Instrument known_ = nominal_instrument(steady_world());
  acquisition::MeasurementPlan plan_ = plan_of(known_, kTwelveDirections);
  acquisition::SessionOptions options_;
  acquisition::ReductionOptions reduction_;
};

}  // namespace gonio
