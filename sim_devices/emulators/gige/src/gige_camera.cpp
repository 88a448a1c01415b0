#include "gonio/gige_emulator/gige_camera.h"

#include <arpa/inet.h>
#include <arv.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include "genicam.h"
#include "image.h"
#include "registers.h"

namespace gonio::gige_emulator {
namespace {

using namespace registers;
using emulator_faults::Fault;
using Steady = std::chrono::steady_clock;

constexpr std::uint16_t kControlPort = 3956;

// Until a master sets another one. It cannot send test packets, so nobody negotiates it; loopback
// takes packets of any size.
constexpr std::uint32_t kPacketBytes = 9000;

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

/// Aravis wants the description as a file; this one has no name and no folder.
class FileInMemory {
 public:
  explicit FileInMemory(std::string_view bytes) : descriptor_(memfd_create("genicam", 0)) {
    if (descriptor_ < 0 ||
        write(descriptor_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) {
      throw std::runtime_error("cannot keep the camera's description in memory");
    }
  }
  ~FileInMemory() { close(descriptor_); }
  FileInMemory(const FileInMemory&) = delete;
  FileInMemory& operator=(const FileInMemory&) = delete;

  std::string path() const { return fmt::format("/proc/self/fd/{}", descriptor_); }

 private:
  int descriptor_;
};

/// Aravis would only log that another camera is there.
void require_free_address(const std::string& address) {
  sockaddr_in wanted{};
  wanted.sin_family = AF_INET;
  wanted.sin_port = htons(kControlPort);
  if (inet_pton(AF_INET, address.c_str(), &wanted.sin_addr) != 1) {
    throw std::invalid_argument(
        fmt::format("address: found \"{}\", expected an IPv4 address", address));
  }
  const int probe = socket(AF_INET, SOCK_DGRAM, 0);
  const int bound = bind(probe, reinterpret_cast<const sockaddr*>(&wanted), sizeof wanted);
  const int error = errno;
  close(probe);
  if (bound != 0) {
    throw std::runtime_error(fmt::format("no GigE Vision camera can be at {}:{}: {}", address,
                                         kControlPort,
                                         error == EADDRINUSE      ? "one is there already"
                                         : error == EADDRNOTAVAIL ? "no interface has this address"
                                                                  : "the port is refused"));
  }
}

}  // namespace

class GigeCamera::Body {
 public:
  Body(const GigeCameraOptions& options, devices::Camera& world, devices::Clock& clock,
       emulator_faults::FaultPlan& faults)
      : options_(options), world_(world), clock_(clock), faults_(faults), sensor_(world.info()) {
    if (options_.model.empty()) options_.model = sensor_.model;
    if (options_.serial.empty()) options_.serial = sensor_.serial;
    const auto require = [](const char* field, const std::string& text, std::size_t room) {
      if (text.empty() || text.size() >= room) {
        throw std::invalid_argument(
            fmt::format("{}: found \"{}\", expected 1 to {} characters", field, text, room - 1));
      }
    };
    require("vendor", options_.vendor, 32);
    require("model", options_.model, 32);
    require("serial", options_.serial, 16);
    const std::scoped_lock lock(camera_mutex_);
    power_up();
    thread_ = std::thread([this] { run(); });
  }

  ~Body() {
    stopping_ = true;
    thread_.join();
    const std::scoped_lock lock(camera_mutex_);
    fake_.reset();
  }

  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;

  const std::string& address() const { return options_.address; }

  void unplug() {
    const std::scoped_lock lock(camera_mutex_);
    fake_.reset();
    away_by_fault_ = false;
  }

  void plug_in() {
    const std::scoped_lock lock(camera_mutex_);
    if (!fake_) power_up();
    away_by_fault_ = false;
  }

  void set(Feature feature, double value) {
    const std::scoped_lock lock(camera_mutex_);
    if (!fake_) return;
    const auto whole = static_cast<std::uint32_t>(value);
    switch (feature) {
      case Feature::exposure_auto:
        return write(kExposureAuto, whole);
      case Feature::gain_auto:
        return write(kGainAuto, whole);
      case Feature::black_level_auto:
        return write(kBlackLevelAuto, whole);
      case Feature::gamma_enable:
        return write(kGammaEnable, whole);
      case Feature::pixel_format:
        return write(kPixelFormat, whole);
      case Feature::width:
        return write(kWidth, whole);
      case Feature::exposure_time_us:
        return write(kExposureUs, whole);
      case Feature::temperature_c:
        return write_real(kTemperature, value);
    }
  }

  void pulse() { pulsed_ = true; }

  void show_when_free_running(std::vector<devices::Frame> frames, double frames_per_second) {
    const std::scoped_lock lock(camera_mutex_, image_mutex_);
    free_frames_ = std::move(frames);
    free_images_.clear();
    free_period_us_ =
        std::max(1U, static_cast<std::uint32_t>(1e6 / std::max(frames_per_second, 1.0)));
    if (fake_) write(kFramePeriodUs, free_period_us_);
  }

  GigeCameraLog log() const {
    const std::scoped_lock lock(image_mutex_);
    return log_;
  }

 private:
  // --- camera_mutex_ is held in these ---------------------------------------------------------

  void power_up() {
    require_free_address(options_.address);
    const FileInMemory description(genicam_description(sensor_, options_.vendor, options_.model));
    fake_.reset(arv_gv_fake_camera_new_full(options_.address.c_str(), options_.serial.c_str(),
                                            description.path().c_str()));
    if (!arv_gv_fake_camera_is_running(fake_.get())) {
      fake_.reset();
      throw std::runtime_error(
          fmt::format("no GigE Vision camera can be at {}: no interface has "
                      "this address",
                      options_.address));
    }
    ++power_ups_;
    write_text(kVendorName, options_.vendor, 32);
    write_text(kModelName, options_.model, 32);
    write(kSensorWidth, static_cast<std::uint32_t>(sensor_.width_px));
    write(kSensorHeight, static_cast<std::uint32_t>(sensor_.height_px));
    write(kWidth, static_cast<std::uint32_t>(sensor_.width_px));
    write(kHeight, static_cast<std::uint32_t>(sensor_.height_px));
    write(kPixelFormat, pixel_formats(sensor_.pixel_format).front().code);
    write(kPacketSize, kPacketBytes);
    write(kFakeTriggerSource, 1);
    write(kFramePeriodUs, free_period_us_);
    write_real(kBlackLevel, options_.black_level_dn);
    write_real(kTemperature, options_.temperature_c);
    set_pace(kIdleHz);
    arv_fake_camera_set_fill_pattern(camera(), &Body::fill, this);
  }

  ArvFakeCamera* camera() const { return arv_gv_fake_camera_get_fake_camera(fake_.get()); }

  std::uint32_t read(std::uint32_t address) const {
    std::uint32_t value = 0;
    arv_fake_camera_read_register(camera(), address, &value);
    return value;
  }
  double read_real(std::uint32_t address) const {
    return static_cast<double>(std::bit_cast<float>(read(address)));
  }
  void write(std::uint32_t address, std::uint32_t value) {
    arv_fake_camera_write_register(camera(), address, value);
  }
  void write_real(std::uint32_t address, double value) {
    write(address, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
  }
  void write_text(std::uint32_t address, const std::string& text, std::size_t room) {
    std::string padded = text;
    padded.resize(room, '\0');
    arv_fake_camera_write_memory(camera(), address, static_cast<std::uint32_t>(room),
                                 padded.data());
  }

  void set_pace(double hz) {
    if (pace_hz_ == hz && paced_power_up_ == power_ups_) return;
    arv_fake_camera_set_trigger_frequency(camera(), hz);
    pace_hz_ = hz;
    paced_power_up_ = power_ups_;
  }

  ImageSettings settings() const {
    ImageSettings of;
    of.x = static_cast<int>(read(kOffsetX));
    of.y = static_cast<int>(read(kOffsetY));
    of.width = static_cast<int>(read(kWidth));
    of.height = static_cast<int>(read(kHeight));
    of.gain_db = read(kGain) / 100.0;
    of.black_level_dn = read_real(kBlackLevel);
    of.adc_bits = options_.adc_bits;
    return of;
  }

  std::vector<std::uint8_t> packed(const devices::Frame& frame) const {
    const PixelFormat* const format = pixel_format(read(kPixelFormat));
    return format == nullptr ? std::vector<std::uint8_t>() : image(frame, settings(), *format);
  }

  /// Which run of the acquisition it is: what is exposed in one is not sent in another.
  std::pair<std::uint32_t, int> run_of_acquisition() const {
    return {read(kAcquisition) == 0 ? 0 : read(kStreamPort), power_ups_};
  }

  bool take_trigger() {
    const bool asked = read(kTriggerSoftware) != 0;
    if (asked) write(kTriggerSoftware, 0);
    const bool pulsed = pulsed_.exchange(false);
    if (read(kAcquisition) == 0 || read(kTriggerMode) != 1) return false;
    return read(kTriggerSource) == kSoftware ? asked : pulsed;
  }

  // --- the camera's own thread ----------------------------------------------------------------

  void run() {
    Steady::time_point last_exposure = Steady::now();
    while (!stopping_) {
      bool away = false;
      bool triggered = false;
      {
        const std::scoped_lock lock(camera_mutex_);
        away = away_by_fault_;
        if (away && !faults_.strikes(Fault::dead_link, options_.name, clock_.now())) {
          try {
            power_up();
            away_by_fault_ = away = false;
          } catch (const std::runtime_error&) {
            // Somebody else has the address now; it is asked for again.
          }
        }
        triggered = fake_ && take_trigger();
        if (fake_ && !triggered && Steady::now() > last_exposure + kIdleAfter) set_pace(kIdleHz);
      }
      if (triggered) {
        expose();
        last_exposure = Steady::now();
      } else {
        std::this_thread::sleep_for(away ? Steady::duration(kAwayLook) : Steady::duration(kLook));
      }
    }
  }

  bool struck(Fault fault) { return faults_.strikes(fault, options_.name, clock_.now()); }

  void expose() {
    std::pair<std::uint32_t, int> run;
    std::chrono::nanoseconds exposure{0};
    {
      const std::scoped_lock lock(camera_mutex_);
      if (!fake_) return;
      if (struck(Fault::dead_link)) {
        fake_.reset();
        away_by_fault_ = true;
        return;
      }
      set_pace(kBusyHz);
      run = run_of_acquisition();
      exposure = std::chrono::microseconds(read(kExposureUs));
      if (struck(Fault::wrong_exposure)) {
        const double factor =
            exposure * kWrongExposure <= sensor_.max_exposure ? kWrongExposure : 1 / kWrongExposure;
        exposure = std::chrono::microseconds(std::llround(read(kExposureUs) * factor));
        write(kExposureUs, static_cast<std::uint32_t>(exposure.count() / 1000));
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
    {
      const std::scoped_lock image_lock(image_mutex_);
      log_.exposures.push_back({start, end});
      if (!fake_ || run != run_of_acquisition()) {
        ++log_.dropped_triggers;
        return;
      }
      if (read(kTriggerSoftware) != 0) {
        write(kTriggerSoftware, 0);
        ++log_.dropped_triggers;
      }
      if (!exposed || struck(Fault::no_frame)) return;
      image_ = packed(frame);
      repeat_id_ = struck(Fault::duplicate_frame_id);
    }
    g_object_set(fake_.get(), "gvsp-lost-ratio", struck(Fault::lost_packets) ? kLossRatio : 0.0,
                 nullptr);
    write(kFakeTrigger, 1);
  }

  // --- the fake camera's thread ---------------------------------------------------------------

  /// Called for every frame it sends; its control channel is dead meanwhile.
  static void fill(ArvBuffer* buffer, void* user_data, guint32, guint32, ArvPixelFormat format) {
    static_cast<Body*>(user_data)->fill_buffer(buffer, format);
  }

  void fill_buffer(ArvBuffer* buffer, ArvPixelFormat format) {
    const std::scoped_lock lock(image_mutex_);
    // The buffer does not know its size here (Aravis issue 955); what was packed for another window
    // or format than the stream began with must not be copied.
    const auto pixels = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)) *
                        static_cast<std::size_t>(arv_buffer_get_image_height(buffer));
    const std::size_t room = pixels * ARV_PIXEL_FORMAT_BIT_PER_PIXEL(format) / 8;
    std::size_t size = 0;
    // Whoever fills a buffer gets its memory by the reader's function only.
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
    auto* const data = const_cast<void*>(arv_buffer_get_data(buffer, &size));
    const std::vector<std::uint8_t>& bytes = next_image(buffer, room);
    if (bytes.size() == room) {
      std::memcpy(data, bytes.data(), room);
    } else {
      std::memset(data, 0, room);
    }
    if (repeat_id_) arv_buffer_set_frame_id(buffer, last_id_);
    repeat_id_ = false;
    last_id_ = arv_buffer_get_frame_id(buffer);
    log_.transfers.push_back({Steady::now(), room});
  }

  const std::vector<std::uint8_t>& next_image(ArvBuffer* buffer, std::size_t room) {
    if (free_frames_.empty()) return image_;
    if (free_images_.empty() || free_images_.front().size() != room) {
      ImageSettings of;
      arv_buffer_get_image_region(buffer, &of.x, &of.y, &of.width, &of.height);
      of.black_level_dn = free_frames_.front().black_level_dn;
      of.adc_bits = options_.adc_bits;
      const PixelFormat* const format = pixel_format(arv_buffer_get_image_pixel_format(buffer));
      free_images_.clear();
      for (const devices::Frame& frame : free_frames_) {
        free_images_.push_back(format == nullptr ? std::vector<std::uint8_t>()
                                                 : image(frame, of, *format));
      }
    }
    return free_images_[free_shown_++ % free_images_.size()];
  }

  GigeCameraOptions options_;
  devices::Camera& world_;
  devices::Clock& clock_;
  emulator_faults::FaultPlan& faults_;
  devices::CameraInfo sensor_;

  // Whether the fake camera is there, and its registers. Before image_mutex_ where both are needed.
  mutable std::mutex camera_mutex_;
  std::unique_ptr<ArvGvFakeCamera, void (*)(void*)> fake_{nullptr, &g_object_unref};
  int power_ups_ = 0;
  int paced_power_up_ = 0;
  double pace_hz_ = 0.0;
  bool away_by_fault_ = false;
  std::uint32_t free_period_us_ = 40000;

  // What the fake camera's thread needs; it takes nothing else.
  mutable std::mutex image_mutex_;
  std::vector<std::uint8_t> image_;
  bool repeat_id_ = false;
  std::uint64_t last_id_ = 0;
  std::vector<devices::Frame> free_frames_;
  std::vector<std::vector<std::uint8_t>> free_images_;  ///< packed when first asked for
  std::size_t free_shown_ = 0;
  GigeCameraLog log_;

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
