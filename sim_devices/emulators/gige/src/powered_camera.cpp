#include "powered_camera.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <stdexcept>
#include <string_view>

#include "genicam.h"

namespace gonio::gige_emulator {

using namespace registers;

namespace {

constexpr std::uint16_t kControlPort = 3956;

// Until a master sets another one. It cannot send test packets, so nobody negotiates it; loopback
// takes packets of any size.
constexpr std::uint32_t kPacketBytes = 9000;

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

PoweredCamera::PoweredCamera(const GigeCameraOptions& options, const devices::CameraInfo& sensor,
                             ArvFakeCameraFillPattern fill, void* source)
    : options_(options), sensor_(sensor), fill_(fill), source_(source) {
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
}

void PoweredCamera::power_up() {
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
  arv_fake_camera_set_fill_pattern(camera(), fill_, source_);
}

std::uint32_t PoweredCamera::read(std::uint32_t address) const {
  std::uint32_t value = 0;
  arv_fake_camera_read_register(camera(), address, &value);
  return value;
}

double PoweredCamera::read_real(std::uint32_t address) const {
  return static_cast<double>(std::bit_cast<float>(read(address)));
}

void PoweredCamera::write(std::uint32_t address, std::uint32_t value) {
  arv_fake_camera_write_register(camera(), address, value);
}

void PoweredCamera::write_real(std::uint32_t address, double value) {
  write(address, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
}

void PoweredCamera::write_text(std::uint32_t address, const std::string& text, std::size_t room) {
  std::string padded = text;
  padded.resize(room, '\0');
  arv_fake_camera_write_memory(camera(), address, static_cast<std::uint32_t>(room), padded.data());
}

void PoweredCamera::set(Feature feature, double value) {
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
    case Feature::payload_bytes:
      return write(kPayloadBytes, whole);
  }
}

void PoweredCamera::set_pace(double hz) {
  if (pace_hz_ == hz && paced_power_up_ == power_ups_) return;
  arv_fake_camera_set_trigger_frequency(camera(), hz);
  pace_hz_ = hz;
  paced_power_up_ = power_ups_;
}

void PoweredCamera::set_loss(double ratio) {
  g_object_set(fake_.get(), "gvsp-lost-ratio", ratio, nullptr);
}

void PoweredCamera::set_free_period_us(std::uint32_t period_us) {
  free_period_us_ = period_us;
  if (fake_) write(kFramePeriodUs, free_period_us_);
}

std::vector<std::uint8_t> PoweredCamera::packed(const devices::Frame& frame) const {
  const PixelFormat* const format = pixel_format(read(kPixelFormat));
  if (format == nullptr) return {};
  ImageSettings of;
  of.x = static_cast<int>(read(kOffsetX));
  of.y = static_cast<int>(read(kOffsetY));
  of.width = static_cast<int>(read(kWidth));
  of.height = static_cast<int>(read(kHeight));
  of.gain_db = read(kGain) / 100.0;
  of.black_level_dn = read_real(kBlackLevel);
  of.adc_bits = options_.adc_bits;
  return image(frame, of, *format);
}

std::pair<std::uint32_t, int> PoweredCamera::run_of_acquisition() const {
  return {read(kAcquisition) == 0 ? 0 : read(kStreamPort), power_ups_};
}

}  // namespace gonio::gige_emulator
