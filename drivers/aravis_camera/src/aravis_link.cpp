// The one user of Aravis: handles, features under their several names, errors, the stream.

#include <arpa/inet.h>
#include <arv.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string_view>
#include <type_traits>
#include <utility>

#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/aravis_camera/wire_format.h"

namespace gonio::aravis_camera {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

// With the default of 208 KiB more than half of all frames lose packets (docs/hardware.md).
constexpr int kSocketBufferBytes = 4 << 20;
// What waits for us at most; when all are full the stream throws frames away and counts.
constexpr int kBuffers = 10;
constexpr std::uint16_t kGvcpPort = 3956;

constexpr std::array kExposureNames{"ExposureTime", "ExposureTimeAbs"};
constexpr std::array kGainNames{"Gain", "GainRaw"};
constexpr std::array kBlackLevelNames{"BlackLevel", "BlackLevelRaw"};
constexpr std::array kTemperatureNames{"DeviceTemperature", "TemperatureAbs", "Temperature"};
// SFNC 2.4 and names in use before it. All that change numbers by themselves or bend the response.
constexpr std::array kAutomaticChoices{"ExposureAuto",    "GainAuto",
                                       "BlackLevelAuto",  "BalanceWhiteAuto",
                                       "GainAutoBalance", "BlackLevelAutoBalance"};
constexpr std::array kAutomaticSwitches{"GammaEnable", "GammaEnabled", "LUTEnable",
                                        "SharpnessEnabled", "ColorTransformationEnable"};

struct Unref {
  void operator()(void* object) const noexcept { g_object_unref(object); }
};
template <typename Object>
using Handle = std::unique_ptr<Object, Unref>;

bool is_ipv4(const std::string& text) {
  in_addr ignored{};
  return inet_pton(AF_INET, text.c_str(), &ignored) == 1;
}

/// The address of ours from which packets to `device` go out; empty when there is no way.
std::string local_address_towards(const std::string& device) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kGvcpPort);
  inet_pton(AF_INET, device.c_str(), &address.sin_addr);
  const int probe = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in own{};
  socklen_t size = sizeof own;
  // Connecting a datagram socket sends nothing.
  const bool found =
      connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      getsockname(probe, reinterpret_cast<sockaddr*>(&own), &size) == 0;
  close(probe);
  std::array<char, INET_ADDRSTRLEN> text{};
  if (found) inet_ntop(AF_INET, &own.sin_addr, text.data(), text.size());
  return text.data();
}

DeviceErrc code_of(const GError& error) {
  if (error.domain == ARV_GC_ERROR) {
    return error.code == ARV_GC_ERROR_OUT_OF_RANGE ? DeviceErrc::LimitViolation : DeviceErrc::Fault;
  }
  if (error.domain != ARV_DEVICE_ERROR) return DeviceErrc::Fault;
  switch (error.code) {
    // Aravis has asked five times in 2.5 s by then.
    case ARV_DEVICE_ERROR_TIMEOUT:
    case ARV_DEVICE_ERROR_NOT_CONNECTED:
    case ARV_DEVICE_ERROR_NOT_FOUND:
    case ARV_DEVICE_ERROR_TRANSFER_ERROR:
    case ARV_DEVICE_ERROR_NOT_CONTROLLER:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED:
      return DeviceErrc::Disconnected;
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_BUSY:
    case ARV_DEVICE_ERROR_GENICAM_NOT_FOUND:
      return DeviceErrc::Protocol;
    default:
      return DeviceErrc::Fault;
  }
}

std::string problem_text(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "packets of another frame";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "more bytes than it should have";
    default:
      return "given up by the library";
  }
}

/// What Aravis' threads tell: buffers that are done, at most as many as the stream was given, and
/// the loss of control.
///
/// The library's own queue would do; its locks are not seen by thread sanitizers, these are.
class Arrivals {
 public:
  /// Before the acquisition starts.
  void come_from(ArvStream* stream) {
    const std::scoped_lock lock(mutex_);
    stream_ = stream;
  }

  /// Before the stream goes.
  void forget() {
    const std::scoped_lock lock(mutex_);
    stream_ = nullptr;
    done_.clear();
  }

  /// The oldest buffer, or null after `patience` or when control was lost.
  Handle<ArvBuffer> wait_for(std::chrono::nanoseconds patience) {
    std::unique_lock lock(mutex_);
    const auto something = [this] { return !done_.empty() || control_lost_; };
    if (!changed_.wait_until(lock, std::chrono::steady_clock::now() + patience, something) ||
        done_.empty()) {
      return nullptr;
    }
    Handle<ArvBuffer> oldest = std::move(done_.front());
    done_.pop_front();
    return oldest;
  }

  void give_back(ArvBuffer* buffer) {
    ArvStream* stream = nullptr;
    {
      const std::scoped_lock lock(mutex_);
      stream = stream_;
    }
    arv_stream_push_buffer(stream, buffer);
  }

  bool control_lost() const {
    const std::scoped_lock lock(mutex_);
    return control_lost_;
  }

  static void on_stream(void* self, ArvStreamCallbackType type, ArvBuffer* /*buffer*/) {
    auto* const arrivals = static_cast<Arrivals*>(self);
    const std::scoped_lock lock(arrivals->mutex_);
    if (type != ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE || arrivals->stream_ == nullptr) return;
    if (ArvBuffer* const done = arv_stream_try_pop_buffer(arrivals->stream_)) {
      arrivals->done_.emplace_back(done);
      arrivals->changed_.notify_one();
    }
  }

  static void on_control_lost(ArvDevice* /*device*/, void* self) {
    auto* const arrivals = static_cast<Arrivals*>(self);
    const std::scoped_lock lock(arrivals->mutex_);
    arrivals->control_lost_ = true;
    arrivals->changed_.notify_one();
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  ArvStream* stream_ = nullptr;
  std::deque<Handle<ArvBuffer>> done_;
  bool control_lost_ = false;
};

class AravisLink final : public CameraLink {
 public:
  explicit AravisLink(const AravisCameraOptions& options)
      : options_(options), format_(*find_wire_format(options.pixel_format)), camera_(open()) {
    arv_camera_set_range_check_policy(camera_.get(), ARV_RANGE_CHECK_POLICY_ENABLE);
    arv_camera_set_access_check_policy(camera_.get(), ARV_ACCESS_CHECK_POLICY_ENABLE);
    arv_camera_set_register_cache_policy(camera_.get(), ARV_REGISTER_CACHE_POLICY_DISABLE);
    g_signal_connect(arv_camera_get_device(camera_.get()), "control-lost",
                     G_CALLBACK(&Arrivals::on_control_lost), &arrivals_);
    identify();
    stop();
    configure(false);
    start();
  }

  ~AravisLink() override {
    // Of a camera that is gone every write would cost 2.5 s.
    if (!arrivals_.control_lost()) arv_camera_stop_acquisition(camera_.get(), nullptr);
    arrivals_.forget();
  }

  const CameraIdentity& identity() const override { return identity_; }

  CameraState state() override {
    CameraState now;
    now.exposure_us = number(identity_.exposure_feature);
    if (!identity_.gain_feature.empty()) now.gain = number(identity_.gain_feature);
    if (!identity_.black_level_feature.empty()) {
      now.black_level = number(identity_.black_level_feature);
    }
    now.pixel_format = static_cast<std::uint32_t>(call(
        "PixelFormat", [&](GError** e) { return arv_camera_get_pixel_format(camera_.get(), e); }));
    now.region = region();
    now.triggered = text("TriggerMode") == "On";
    now.trigger_source = text("TriggerSource");
    for (const char* name : automatic_choices_) {
      if (text(name) != "Off") now.automatic.emplace_back(name);
    }
    for (const char* name : automatic_switches_) {
      if (call(name, [&](GError** e) { return arv_camera_get_boolean(camera_.get(), name, e); })) {
        now.automatic.emplace_back(name);
      }
    }
    return now;
  }

  void set_exposure_us(double exposure_us) override {
    set_number(identity_.exposure_feature, exposure_us);
  }

  void trigger() override {
    call("TriggerSoftware", [&](GError** e) { arv_camera_software_trigger(camera_.get(), e); });
  }

  bool take_frame(std::chrono::nanoseconds patience, const Take& take) override {
    Handle<ArvBuffer> buffer = arrivals_.wait_for(patience);
    require_control();
    if (!buffer) return false;
    // Goes back to the stream however `take` ends.
    const auto give_back = [this](ArvBuffer* used) { arrivals_.give_back(used); };
    const std::unique_ptr<ArvBuffer, decltype(give_back)> taken(buffer.release(), give_back);
    take(raw_frame(taken.get()));
    return true;
  }

  void restart(bool free_running) override {
    stop();
    // A new stream has another port: what is still on its way finds nobody.
    arrivals_.forget();
    stream_.reset();
    configure(free_running);
    start();
  }

  std::optional<double> temperature_c() override {
    if (identity_.temperature_feature.empty()) return std::nullopt;
    return number(identity_.temperature_feature);
  }

 private:
  [[noreturn]] void fail(DeviceErrc code, const std::string& message) const {
    throw DeviceError(code, options_.name, message);
  }

  void require_control() const {
    if (!arrivals_.control_lost()) return;
    fail(DeviceErrc::Disconnected,
         "control of the camera was lost: it was restarted, unplugged, or another program took it");
  }

  /// Calls Aravis and turns its error into ours.
  template <typename Function>
  std::invoke_result_t<const Function&, GError**> call(std::string_view what,
                                                       const Function& function) const {
    require_control();
    GError* error = nullptr;
    const auto check = [&] {
      if (error == nullptr) return;
      const DeviceErrc code = code_of(*error);
      const std::string message = error->message;
      g_error_free(error);
      fail(code, std::string(what) + ": " + message);
    };
    if constexpr (std::is_void_v<decltype(function(&error))>) {
      function(&error);
      check();
    } else {
      const auto result = function(&error);
      check();
      return result;
    }
  }

  Handle<ArvCamera> open() const {
    GError* error = nullptr;
    Handle<ArvCamera> camera;
    if (is_ipv4(options_.device)) {
      // Straight to the address: no search, no broadcast, no look at the USB.
      const std::string own = local_address_towards(options_.device);
      if (own.empty()) fail(DeviceErrc::Disconnected, "no network reaches " + options_.device);
      const Handle<GInetAddress> from(g_inet_address_new_from_string(own.c_str()));
      const Handle<GInetAddress> to(g_inet_address_new_from_string(options_.device.c_str()));
      const Handle<ArvDevice> device(arv_gv_device_new(from.get(), to.get(), &error));
      if (device) camera.reset(arv_camera_new_with_device(device.get(), &error));
    } else {
      arv_update_device_list();
      camera.reset(arv_camera_new(options_.device.c_str(), &error));
    }
    if (!camera || error != nullptr) {
      const std::string why = error != nullptr ? error->message : "not found";
      g_clear_error(&error);
      fail(DeviceErrc::Disconnected, "no camera answers at " + options_.device + " (" + why +
                                         "): power, cable and network; gonio devices lists what "
                                         "answers");
    }
    ArvDevice* const device = arv_camera_get_device(camera.get());
    if (ARV_IS_GV_DEVICE(device) && arv_gv_device_is_controller(ARV_GV_DEVICE(device)) == 0) {
      fail(DeviceErrc::Disconnected,
           "another program controls the camera, or one that died less than 3 s ago did");
    }
    return camera;
  }

  bool has(const char* feature) const {
    return call(feature, [&](GError** e) {
             return arv_camera_is_feature_available(camera_.get(), feature, e);
           }) != 0;
  }

  template <typename Names>
  std::string first_of(const Names& names) const {
    for (const char* name : names) {
      if (has(name)) return name;
    }
    return {};
  }

  std::string text(const char* feature) const {
    const char* const found =
        call(feature, [&](GError** e) { return arv_camera_get_string(camera_.get(), feature, e); });
    return found == nullptr ? "" : found;
  }

  void set_text(const char* feature, const std::string& value) {
    call(feature + (" to " + value),
         [&](GError** e) { arv_camera_set_string(camera_.get(), feature, value.c_str(), e); });
  }

  static bool is_raw(const std::string& feature) { return feature.ends_with("Raw"); }

  double number(const std::string& feature) const {
    return call(feature, [&](GError** e) {
      return is_raw(feature)
                 ? static_cast<double>(arv_camera_get_integer(camera_.get(), feature.c_str(), e))
                 : arv_camera_get_float(camera_.get(), feature.c_str(), e);
    });
  }

  void set_number(const std::string& feature, double value) {
    call(feature, [&](GError** e) {
      if (is_raw(feature)) {
        arv_camera_set_integer(camera_.get(), feature.c_str(), std::llround(value), e);
      } else {
        arv_camera_set_float(camera_.get(), feature.c_str(), value, e);
      }
    });
  }

  Region region() const {
    Region found;
    call("region", [&](GError** e) {
      arv_camera_get_region(camera_.get(), &found.x, &found.y, &found.width, &found.height, e);
    });
    return found;
  }

  /// What a C string says, which may be null.
  std::string said(const char* what, const char* (*get)(ArvCamera*, GError**)) const {
    const char* const found = call(what, [&](GError** e) { return get(camera_.get(), e); });
    return found == nullptr ? "" : found;
  }

  void identify() {
    identity_.vendor = said("vendor", &arv_camera_get_vendor_name);
    identity_.model = said("model", &arv_camera_get_model_name);
    identity_.serial = has("DeviceSerialNumber")
                           ? said("serial number", &arv_camera_get_device_serial_number)
                           : said("device id", &arv_camera_get_device_id);
    identity_.exposure_feature = first_of(kExposureNames);
    identity_.gain_feature = first_of(kGainNames);
    identity_.black_level_feature = first_of(kBlackLevelNames);
    identity_.temperature_feature = first_of(kTemperatureNames);
    if (identity_.exposure_feature.empty()) {
      fail(DeviceErrc::Fault, "the camera has neither ExposureTime nor ExposureTimeAbs");
    }
    for (const char* name : kAutomaticChoices) {
      if (has(name)) automatic_choices_.push_back(name);
    }
    for (const char* name : kAutomaticSwitches) {
      if (has(name)) automatic_switches_.push_back(name);
    }
  }

  void configure(bool free_running) {
    if (has("ExposureMode")) set_text("ExposureMode", "Timed");
    for (const char* name : automatic_choices_) set_text(name, "Off");
    for (const char* name : automatic_switches_) {
      call(name, [&](GError** e) { arv_camera_set_boolean(camera_.get(), name, FALSE, e); });
    }
    set_text("PixelFormat", std::string(format_.name));
    set_region();
    set_gain();
    set_black_level();
    call("AcquisitionMode", [&](GError** e) {
      arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, e);
    });
    set_trigger(free_running);
    set_packet_size();
    call(identity_.exposure_feature, [&](GError** e) {
      arv_camera_get_float_bounds(camera_.get(), identity_.exposure_feature.c_str(),
                                  &identity_.min_exposure_us, &identity_.max_exposure_us, e);
    });
    identity_.region = region();
  }

  void set_region() {
    Region wanted = options_.region;
    if (wanted.width == 0) {
      call("region", [&](GError** e) {
        gint smallest = 0;
        // The largest window begins at the corner.
        if (arv_camera_is_region_offset_available(camera_.get(), nullptr) != 0) {
          arv_camera_set_integer(camera_.get(), "OffsetX", 0, e);
          if (*e == nullptr) arv_camera_set_integer(camera_.get(), "OffsetY", 0, e);
        }
        if (*e == nullptr) arv_camera_get_width_bounds(camera_.get(), &smallest, &wanted.width, e);
        if (*e == nullptr) {
          arv_camera_get_height_bounds(camera_.get(), &smallest, &wanted.height, e);
        }
      });
    }
    call("region", [&](GError** e) {
      arv_camera_set_region(camera_.get(), wanted.x, wanted.y, wanted.width, wanted.height, e);
    });
    const Region got = region();
    if (got.x != wanted.x || got.y != wanted.y || got.width != wanted.width ||
        got.height != wanted.height) {
      fail(DeviceErrc::LimitViolation,
           "the camera does not take the region: " + std::to_string(wanted.width) + " x " +
               std::to_string(wanted.height) + " at " + std::to_string(wanted.x) + ", " +
               std::to_string(wanted.y) + " became " + std::to_string(got.width) + " x " +
               std::to_string(got.height) + " at " + std::to_string(got.x) + ", " +
               std::to_string(got.y));
    }
  }

  void set_gain() {
    const std::string& feature = identity_.gain_feature;
    if (feature.empty()) {
      if (options_.gain_db != 0.0) fail(DeviceErrc::Fault, "the camera has no gain to set");
      return;
    }
    if (!is_raw(feature)) return set_number(feature, options_.gain_db);
    if (options_.gain_raw_per_db == 0.0) {
      if (options_.gain_db != 0.0) {
        fail(DeviceErrc::Fault,
             "the camera has only GainRaw: gain_raw_per_db must say its units (manual)");
      }
      gint64 smallest = 0;
      gint64 largest = 0;
      call(feature, [&](GError** e) {
        arv_camera_get_integer_bounds(camera_.get(), feature.c_str(), &smallest, &largest, e);
      });
      return set_number(feature, static_cast<double>(smallest));
    }
    set_number(feature, options_.gain_db * options_.gain_raw_per_db);
  }

  void set_black_level() {
    if (identity_.black_level_feature.empty()) return;
    set_number(identity_.black_level_feature,
               options_.black_level_dn / options_.black_level_unit_dn);
  }

  void set_trigger(bool free_running) {
    if (has("TriggerSelector")) set_text("TriggerSelector", "FrameStart");
    if (!options_.trigger_line.empty() && has("TriggerActivation")) {
      set_text("TriggerActivation", "RisingEdge");
    }
    set_text("TriggerSource", options_.trigger_line.empty() ? "Software" : options_.trigger_line);
    set_text("TriggerMode", free_running ? "Off" : "On");
  }

  void set_packet_size() {
    if (arv_camera_is_gv_device(camera_.get()) == 0) return;
    if (options_.packet_size == 0) {
      // With test packets, when the camera can send them; else it stays at what it had.
      arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_ALWAYS);
      return;
    }
    arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
    call("packet size", [&](GError** e) {
      arv_camera_gv_set_packet_size(camera_.get(), options_.packet_size, e);
    });
    const auto got = static_cast<int>(call("packet size", [&](GError** e) {
      return arv_camera_gv_get_packet_size(camera_.get(), e);
    }));
    if (got != options_.packet_size) {
      fail(DeviceErrc::LimitViolation, "packet size: asked " +
                                           std::to_string(options_.packet_size) +
                                           ", the camera has " + std::to_string(got));
    }
  }

  void stop() {
    call("AcquisitionStop", [&](GError** e) { arv_camera_stop_acquisition(camera_.get(), e); });
  }

  void start() {
    stream_.reset(call("stream", [&](GError** e) {
      return arv_camera_create_stream(camera_.get(), &Arrivals::on_stream, &arrivals_, e);
    }));
    arrivals_.come_from(stream_.get());
    if (arv_camera_is_gv_device(camera_.get()) != 0) {
      identity_.packet_size = static_cast<int>(call("packet size", [&](GError** e) {
        return arv_camera_gv_get_packet_size(camera_.get(), e);
      }));
    }
    if (ARV_IS_GV_STREAM(stream_.get())) {
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                   "socket-buffer-size", kSocketBufferBytes, nullptr);
    }
    const auto payload =
        call("payload", [&](GError** e) { return arv_camera_get_payload(camera_.get(), e); });
    for (int buffer = 0; buffer < kBuffers; ++buffer) {
      arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
    }
    call("AcquisitionStart", [&](GError** e) { arv_camera_start_acquisition(camera_.get(), e); });
  }

  static RawFrame raw_frame(ArvBuffer* buffer) {
    RawFrame frame;
    frame.id = arv_buffer_get_frame_id(buffer);
    frame.timestamp_ns = arv_buffer_get_timestamp(buffer);
    const ArvBufferStatus status = arv_buffer_get_status(buffer);
    const ArvBufferPayloadType type = arv_buffer_get_payload_type(buffer);
    if (status != ARV_BUFFER_STATUS_SUCCESS) {
      frame.problem = problem_text(status);
    } else if (type != ARV_BUFFER_PAYLOAD_TYPE_IMAGE &&
               type != ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA) {
      frame.problem = "no image";
    } else {
      frame.complete = true;
      frame.pixel_format = arv_buffer_get_image_pixel_format(buffer);
      frame.width = arv_buffer_get_image_width(buffer);
      frame.height = arv_buffer_get_image_height(buffer);
      std::size_t size = 0;
      const auto* const data =
          static_cast<const std::byte*>(arv_buffer_get_image_data(buffer, &size));
      frame.bytes = {data, data == nullptr ? 0 : size};
    }
    return frame;
  }

  AravisCameraOptions options_;
  const WireFormat& format_;
  Arrivals arrivals_;  // outlives camera and stream, whose threads use it
  Handle<ArvCamera> camera_;
  Handle<ArvStream> stream_;
  CameraIdentity identity_;
  std::vector<const char*> automatic_choices_;  ///< those the camera has
  std::vector<const char*> automatic_switches_;
};

}  // namespace

AravisCamera::AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock)
    : AravisCamera(options, clock, aravis_opener(options)) {}

LinkOpener aravis_opener(const AravisCameraOptions& options) {
  return [options] { return std::make_unique<AravisLink>(options); };
}

std::vector<CameraDeviceInfo> list_cameras() {
  const auto said = [](const char* text) { return std::string(text == nullptr ? "" : text); };
  arv_update_device_list();
  std::vector<CameraDeviceInfo> found;
  for (unsigned index = 0; index < arv_get_n_devices(); ++index) {
    found.push_back({said(arv_get_device_id(index)), said(arv_get_device_vendor(index)),
                     said(arv_get_device_model(index)), said(arv_get_device_serial_nbr(index)),
                     said(arv_get_device_address(index)), said(arv_get_device_protocol(index))});
  }
  return found;
}

}  // namespace gonio::aravis_camera
