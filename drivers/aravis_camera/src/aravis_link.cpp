// A connection over Aravis: what is set, what is read back, the stream and its buffers.

#include <arv.h>

#include <array>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "arrivals.h"
#include "camera_features.h"
#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/aravis_camera/wire_format.h"
#include "open_camera.h"

namespace gonio::aravis_camera {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

// With the default of 208 KiB more than half of all frames lose packets (docs/hardware.md).
constexpr int kSocketBufferBytes = 4 << 20;
// What waits for us at most; when all are full the stream throws frames away and counts.
constexpr int kBuffers = 10;
// A frame may be sent with padding and chunks of data behind it.
constexpr std::size_t kLargestPayload = 2;  // times the image
constexpr std::size_t kPayloadExtras = 65536;

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

class AravisLink final : public CameraLink {
 public:
  explicit AravisLink(const AravisCameraOptions& options)
      : options_(options),
        format_(*find_wire_format(options.pixel_format)),
        camera_(open_camera(options_)),
        features_(camera_.get(), options_.name, arrivals_) {
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
    now.exposure_us = features_.number(identity_.exposure_feature);
    if (!identity_.gain_feature.empty()) now.gain = features_.number(identity_.gain_feature);
    if (!identity_.black_level_feature.empty()) {
      now.black_level = features_.number(identity_.black_level_feature);
    }
    now.pixel_format = static_cast<std::uint32_t>(features_.call(
        "PixelFormat", [&](GError** e) { return arv_camera_get_pixel_format(camera_.get(), e); }));
    now.region = features_.region();
    now.triggered = features_.text("TriggerMode") == "On";
    now.trigger_source = features_.text("TriggerSource");
    for (const char* name : automatic_choices_) {
      if (features_.text(name) != "Off") now.automatic.emplace_back(name);
    }
    for (const char* name : automatic_switches_) {
      if (features_.call(
              name, [&](GError** e) { return arv_camera_get_boolean(camera_.get(), name, e); })) {
        now.automatic.emplace_back(name);
      }
    }
    return now;
  }

  void set_exposure_us(double exposure_us) override {
    features_.set_number(identity_.exposure_feature, exposure_us);
  }

  void trigger() override {
    features_.call("TriggerSoftware",
                   [&](GError** e) { arv_camera_software_trigger(camera_.get(), e); });
  }

  bool take_frame(std::chrono::nanoseconds patience, const Take& take) override {
    std::optional<Arrival> arrival = arrivals_.wait_for(patience);
    features_.require_control();
    if (!arrival) return false;
    // Goes back to the stream however `take` ends.
    const auto give_back = [this](ArvBuffer* used) { arrivals_.give_back(used); };
    const std::unique_ptr<ArvBuffer, decltype(give_back)> taken(arrival->buffer.release(),
                                                                give_back);
    RawFrame frame = raw_frame(taken.get());
    frame.arrived = arrival->at;
    take(frame);
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
    return features_.number(identity_.temperature_feature);
  }

 private:
  void identify() {
    identity_.vendor = features_.said("vendor", &arv_camera_get_vendor_name);
    identity_.model = features_.said("model", &arv_camera_get_model_name);
    identity_.serial = features_.has("DeviceSerialNumber")
                           ? features_.said("serial number", &arv_camera_get_device_serial_number)
                           : features_.said("device id", &arv_camera_get_device_id);
    identity_.exposure_feature = features_.first_of(kExposureNames);
    identity_.gain_feature = features_.first_of(kGainNames);
    identity_.black_level_feature = features_.first_of(kBlackLevelNames);
    identity_.temperature_feature = features_.first_of(kTemperatureNames);
    if (identity_.exposure_feature.empty()) {
      features_.fail(DeviceErrc::Fault, "the camera has neither ExposureTime nor ExposureTimeAbs");
    }
    for (const char* name : kAutomaticChoices) {
      if (features_.has(name)) automatic_choices_.push_back(name);
    }
    for (const char* name : kAutomaticSwitches) {
      if (features_.has(name)) automatic_switches_.push_back(name);
    }
  }

  void configure(bool free_running) {
    if (features_.has("ExposureMode")) features_.set_text("ExposureMode", "Timed");
    for (const char* name : automatic_choices_) features_.set_text(name, "Off");
    for (const char* name : automatic_switches_) {
      features_.call(name,
                     [&](GError** e) { arv_camera_set_boolean(camera_.get(), name, FALSE, e); });
    }
    features_.set_text("PixelFormat", std::string(format_.name));
    set_region();
    set_gain();
    set_black_level();
    features_.call("AcquisitionMode", [&](GError** e) {
      arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, e);
    });
    set_trigger(free_running);
    set_packet_size();
    features_.call(identity_.exposure_feature, [&](GError** e) {
      arv_camera_get_float_bounds(camera_.get(), identity_.exposure_feature.c_str(),
                                  &identity_.min_exposure_us, &identity_.max_exposure_us, e);
    });
    identity_.region = features_.region();
  }

  void set_region() {
    Region wanted = options_.region;
    if (wanted.width == 0) {
      features_.call("region", [&](GError** e) {
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
    features_.call("region", [&](GError** e) {
      arv_camera_set_region(camera_.get(), wanted.x, wanted.y, wanted.width, wanted.height, e);
    });
    const Region got = features_.region();
    if (got.x != wanted.x || got.y != wanted.y || got.width != wanted.width ||
        got.height != wanted.height) {
      features_.fail(DeviceErrc::LimitViolation,
                     "the camera does not take the region: " + std::to_string(wanted.width) +
                         " x " + std::to_string(wanted.height) + " at " + std::to_string(wanted.x) +
                         ", " + std::to_string(wanted.y) + " became " + std::to_string(got.width) +
                         " x " + std::to_string(got.height) + " at " + std::to_string(got.x) +
                         ", " + std::to_string(got.y));
    }
  }

  void set_gain() {
    const std::string& feature = identity_.gain_feature;
    if (feature.empty()) {
      if (options_.gain_db != 0.0)
        features_.fail(DeviceErrc::Fault, "the camera has no gain to set");
      return;
    }
    if (!features_.is_raw(feature)) return features_.set_number(feature, options_.gain_db);
    if (options_.gain_raw_per_db == 0.0) {
      if (options_.gain_db != 0.0) {
        features_.fail(DeviceErrc::Fault,
                       "the camera has only GainRaw: gain_raw_per_db must say its units (manual)");
      }
      gint64 smallest = 0;
      gint64 largest = 0;
      features_.call(feature, [&](GError** e) {
        arv_camera_get_integer_bounds(camera_.get(), feature.c_str(), &smallest, &largest, e);
      });
      return features_.set_number(feature, static_cast<double>(smallest));
    }
    features_.set_number(feature, options_.gain_db * options_.gain_raw_per_db);
  }

  void set_black_level() {
    if (identity_.black_level_feature.empty()) return;
    features_.set_number(identity_.black_level_feature,
                         options_.black_level_dn / options_.black_level_unit_dn);
  }

  void set_trigger(bool free_running) {
    if (features_.has("TriggerSelector")) features_.set_text("TriggerSelector", "FrameStart");
    if (!options_.trigger_line.empty() && features_.has("TriggerActivation")) {
      features_.set_text("TriggerActivation", "RisingEdge");
    }
    features_.set_text("TriggerSource",
                       options_.trigger_line.empty() ? "Software" : options_.trigger_line);
    features_.set_text("TriggerMode", free_running ? "Off" : "On");
  }

  void set_packet_size() {
    if (arv_camera_is_gv_device(camera_.get()) == 0) return;
    if (options_.packet_size == 0) {
      // With test packets, when the camera can send them; else it stays at what it had.
      arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_ALWAYS);
      return;
    }
    arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
    features_.call("packet size", [&](GError** e) {
      arv_camera_gv_set_packet_size(camera_.get(), options_.packet_size, e);
    });
    const auto got = static_cast<int>(features_.call("packet size", [&](GError** e) {
      return arv_camera_gv_get_packet_size(camera_.get(), e);
    }));
    if (got != options_.packet_size) {
      features_.fail(DeviceErrc::LimitViolation, "packet size: asked " +
                                                     std::to_string(options_.packet_size) +
                                                     ", the camera has " + std::to_string(got));
    }
  }

  void stop() {
    features_.call("AcquisitionStop",
                   [&](GError** e) { arv_camera_stop_acquisition(camera_.get(), e); });
  }

  void start() {
    stream_.reset(features_.call("stream", [&](GError** e) {
      return arv_camera_create_stream(camera_.get(), &Arrivals::on_stream, &arrivals_, e);
    }));
    arrivals_.come_from(stream_.get());
    if (arv_camera_is_gv_device(camera_.get()) != 0) {
      identity_.packet_size = static_cast<int>(features_.call("packet size", [&](GError** e) {
        return arv_camera_gv_get_packet_size(camera_.get(), e);
      }));
    }
    if (ARV_IS_GV_STREAM(stream_.get())) {
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                   "socket-buffer-size", kSocketBufferBytes, nullptr);
    }
    const auto payload = features_.call(
        "payload", [&](GError** e) { return arv_camera_get_payload(camera_.get(), e); });
    // Ten of these are taken at once; a broken description may say anything up to 4 GiB.
    const std::size_t image = image_bytes();
    if (payload < image || payload > kLargestPayload * image + kPayloadExtras) {
      features_.fail(DeviceErrc::Protocol, "PayloadSize is " + std::to_string(payload) +
                                               " bytes, the image takes " + std::to_string(image) +
                                               ": is the firmware's description its own?");
    }
    for (int buffer = 0; buffer < kBuffers; ++buffer) {
      arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
    }
    features_.call("AcquisitionStart",
                   [&](GError** e) { arv_camera_start_acquisition(camera_.get(), e); });
  }

  std::size_t image_bytes() const {
    return packed_size(format_.packing, static_cast<std::size_t>(identity_.region.width) *
                                            static_cast<std::size_t>(identity_.region.height));
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
  CameraFeatures features_;
  Handle<ArvStream> stream_;
  CameraIdentity identity_;
  std::vector<const char*> automatic_choices_;  ///< those the camera has
  std::vector<const char*> automatic_switches_;
};

}  // namespace

AravisCamera::AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock,
                           std::stop_token stop)
    : AravisCamera(options, clock, aravis_opener(options), std::move(stop)) {}

LinkOpener aravis_opener(const AravisCameraOptions& options) {
  return [options] { return std::make_unique<AravisLink>(options); };
}

}  // namespace gonio::aravis_camera
