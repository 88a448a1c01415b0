#include "gonio/gige_emulator/gige_camera.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "image_source.h"
#include "powered_camera.h"
#include "registers.h"

namespace gonio::gige_emulator {
namespace {

using namespace registers;
using emulator_faults::Fault;
using Steady = std::chrono::steady_clock;

// How often the camera's thread looks for a trigger.
constexpr std::chrono::microseconds kLook{500};
// How often one that vanished asks whether its fault has worn off.
constexpr std::chrono::milliseconds kAwayLook{100};
// The fake camera looks for frames to send on a grid of this frequency. It sleeps whole
// milliseconds and burns the rest up to the next point: periods a little above whole ones cost
// little.
constexpr double kBusyHz = 1000.0 / 1.2;
constexpr double kIdleHz = 1000.0 / 40.2;
constexpr std::chrono::milliseconds kIdleAfter{500};
// Half of all packets: that all or none of a frame's dozens are lost does not happen.
constexpr double kLossRatio = 0.5;
constexpr double kWrongExposure = 1.5;

}  // namespace

class GigeCamera::Body {
 public:
  Body(const GigeCameraOptions& options, devices::Camera& world, devices::Clock& clock,
       emulator_faults::FaultPlan& faults)
      : world_(world),
        clock_(clock),
        faults_(faults),
        longest_exposure_(world.info().max_exposure),
        source_(options.adc_bits),
        camera_(options, world.info(), &ImageSource::fill, &source_) {
    const std::scoped_lock lock(camera_mutex_);
    power_up();
    thread_ = std::thread([this] { run(); });
  }

  ~Body() {
    stopping_ = true;
    thread_.join();
    const std::scoped_lock lock(camera_mutex_);
    camera_.power_off();
  }

  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;

  const std::string& address() const { return camera_.options().address; }

  void unplug() {
    const std::scoped_lock lock(camera_mutex_);
    camera_.power_off();
    away_by_fault_ = false;
  }

  void plug_in() {
    const std::scoped_lock lock(camera_mutex_);
    if (!camera_.has_power()) power_up();
    away_by_fault_ = false;
  }

  void set(Feature feature, double value) {
    const std::scoped_lock lock(camera_mutex_);
    if (camera_.has_power()) camera_.set(feature, value);
  }

  void pulse() { pulsed_ = true; }

  void show_when_free_running(std::vector<devices::Frame> frames, double frames_per_second) {
    const std::scoped_lock lock(camera_mutex_);
    source_.show_always(std::move(frames));
    camera_.set_free_period_us(
        std::max(1U, static_cast<std::uint32_t>(1e6 / std::max(frames_per_second, 1.0))));
  }

  GigeCameraLog log() const {
    const std::scoped_lock lock(camera_mutex_);
    GigeCameraLog all = log_;
    all.transfers = source_.transfers();
    return all;
  }

 private:
  // --- camera_mutex_ is held in these ---------------------------------------------------------

  void power_up() {
    camera_.power_up();
    camera_.set_pace(kIdleHz);
  }

  bool take_trigger() {
    const bool asked = camera_.read(kTriggerSoftware) != 0;
    if (asked) camera_.write(kTriggerSoftware, 0);
    const bool pulsed = pulsed_.exchange(false);
    if (camera_.read(kAcquisition) == 0 || camera_.read(kTriggerMode) != 1) return false;
    return by_software() ? asked : pulsed;
  }

  bool by_software() const { return camera_.read(kTriggerSource) == kSoftware; }

  bool struck(Fault fault) { return faults_.strikes(fault, camera_.options().name, clock_.now()); }

  // --- the camera's own thread ----------------------------------------------------------------

  void run() {
    Steady::time_point last_exposure = Steady::now();
    while (!stopping_) {
      bool away = false;
      bool triggered = false;
      {
        const std::scoped_lock lock(camera_mutex_);
        away = away_by_fault_;
        if (away && !struck(Fault::dead_link)) {
          try {
            power_up();
            away_by_fault_ = away = false;
          } catch (const std::runtime_error&) {
            // Somebody else has the address now; it is asked for again.
          }
        }
        triggered = camera_.has_power() && take_trigger();
        if (camera_.has_power() && !triggered && Steady::now() > last_exposure + kIdleAfter) {
          camera_.set_pace(kIdleHz);
        }
      }
      if (triggered) {
        expose();
        last_exposure = Steady::now();
      } else {
        std::this_thread::sleep_for(away ? Steady::duration(kAwayLook) : Steady::duration(kLook));
      }
    }
  }

  void expose() {
    std::pair<std::uint32_t, int> run;
    std::chrono::nanoseconds exposure{0};
    {
      const std::scoped_lock lock(camera_mutex_);
      if (!camera_.has_power()) return;
      if (struck(Fault::dead_link)) {
        camera_.power_off();
        away_by_fault_ = true;
        return;
      }
      camera_.set_pace(kBusyHz);
      run = camera_.run_of_acquisition();
      exposure = std::chrono::microseconds(camera_.read(kExposureUs));
      if (struck(Fault::wrong_exposure)) {
        const double factor =
            exposure * kWrongExposure <= longest_exposure_ ? kWrongExposure : 1 / kWrongExposure;
        exposure = std::chrono::microseconds(std::llround(camera_.read(kExposureUs) * factor));
        camera_.write(kExposureUs, static_cast<std::uint32_t>(exposure.count() / 1000));
      }
    }
    const Steady::time_point start = Steady::now();
    devices::Frame frame;
    bool exposed = true;
    try {
      frame = world_.capture(exposure);
    } catch (const devices::DeviceError&) {
      exposed = false;  // an exposure that the sensor refuses: the real one sends nothing either
    }
    const Steady::time_point end = Steady::now();

    const std::scoped_lock lock(camera_mutex_);
    log_.exposures.push_back({start, end});
    if (!camera_.has_power() || run != camera_.run_of_acquisition()) {
      ++log_.dropped_triggers;
      return;
    }
    const bool asked_meanwhile = camera_.read(kTriggerSoftware) != 0;
    if (asked_meanwhile) camera_.write(kTriggerSoftware, 0);
    const bool pulsed_meanwhile = pulsed_.exchange(false);
    if (by_software() ? asked_meanwhile : pulsed_meanwhile) ++log_.dropped_triggers;
    if (!exposed || struck(Fault::no_frame)) return;
    source_.show(camera_.packed(frame), struck(Fault::duplicate_frame_id));
    camera_.set_loss(struck(Fault::lost_packets) ? kLossRatio : 0.0);
    camera_.write(kFakeTrigger, 1);
  }

  devices::Camera& world_;
  devices::Clock& clock_;
  emulator_faults::FaultPlan& faults_;
  std::chrono::nanoseconds longest_exposure_;

  ImageSource source_;  // outlives the camera, whose thread asks it
  mutable std::mutex camera_mutex_;
  PoweredCamera camera_;
  bool away_by_fault_ = false;
  GigeCameraLog log_;  ///< but for the transfers

  std::atomic<bool> pulsed_ = false;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

GigeCamera::GigeCamera(const GigeCameraOptions& options, devices::Camera& world,
                       devices::Clock& clock, emulator_faults::FaultPlan& faults)
    : body_(std::make_unique<Body>(options, world, clock, faults)) {}
GigeCamera::~GigeCamera() = default;

const std::string& GigeCamera::address() const { return body_->address(); }
void GigeCamera::unplug() { body_->unplug(); }
void GigeCamera::plug_in() { body_->plug_in(); }
void GigeCamera::set(Feature feature, double value) { body_->set(feature, value); }
void GigeCamera::pulse() { body_->pulse(); }
void GigeCamera::show_when_free_running(std::vector<devices::Frame> frames,
                                        double frames_per_second) {
  body_->show_when_free_running(std::move(frames), frames_per_second);
}
GigeCameraLog GigeCamera::log() const { return body_->log(); }

}  // namespace gonio::gige_emulator
