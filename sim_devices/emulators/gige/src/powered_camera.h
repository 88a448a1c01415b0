#pragma once

#include <arv.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gonio/devices/camera.h"
#include "gonio/gige_emulator/gige_camera.h"
#include "image.h"
#include "registers.h"

namespace gonio::gige_emulator {

/// Aravis' fake camera with our description of it, and its registers; there while it has power.
///
/// Threads  One at a time.
class PoweredCamera {
 public:
  /// Without power. `fill` is called with `source` for every frame it sends, in a thread of its
  /// own. Throws std::invalid_argument for an identity that does not fit.
  PoweredCamera(const GigeCameraOptions& options, const devices::CameraInfo& sensor,
                ArvFakeCameraFillPattern fill, void* source);

  const GigeCameraOptions& options() const { return options_; }

  /// Everything at its default. Throws std::runtime_error when the address cannot be used,
  /// std::invalid_argument when it is none.
  void power_up();
  void power_off() { fake_.reset(); }
  bool has_power() const { return fake_ != nullptr; }

  // --- with power only ----------------------------------------------------------------------

  std::uint32_t read(std::uint32_t address) const;
  void write(std::uint32_t address, std::uint32_t value);
  void set(Feature feature, double value);

  /// How often the fake camera looks for something to send.
  void set_pace(double hz);
  /// Share of the packets that it does not send.
  void set_loss(double ratio);

  /// A frame as the stream is set up to carry it; nothing when no format has the code.
  std::vector<std::uint8_t> packed(const devices::Frame& frame) const;
  /// Which run of the acquisition it is: what is exposed in one is not sent in another.
  std::pair<std::uint32_t, int> run_of_acquisition() const;

  // --- always -------------------------------------------------------------------------------

  /// Of frames sent without trigger.
  void set_free_period_us(std::uint32_t period_us);

 private:
  ArvFakeCamera* camera() const { return arv_gv_fake_camera_get_fake_camera(fake_.get()); }
  double read_real(std::uint32_t address) const;
  void write_real(std::uint32_t address, double value);
  void write_text(std::uint32_t address, const std::string& text, std::size_t room);

  GigeCameraOptions options_;
  devices::CameraInfo sensor_;
  ArvFakeCameraFillPattern fill_;
  void* source_;
  std::unique_ptr<ArvGvFakeCamera, void (*)(void*)> fake_{nullptr, &g_object_unref};
  int power_ups_ = 0;
  int paced_power_up_ = 0;
  double pace_hz_ = 0.0;
  std::uint32_t free_period_us_ = 40000;
};

}  // namespace gonio::gige_emulator
