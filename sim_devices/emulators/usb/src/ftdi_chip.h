#pragma once

#include <deque>

#include "apt_drive.h"
#include "emulated_device.h"

namespace gonio::usb_emulator {

/// An FT232 between USB and the drive's serial line, with the line's time for every byte. A line
/// that is not set up as the drive has it carries nothing.
class FtdiChip final : public EmulatedDevice {
 public:
  FtdiChip(std::unique_ptr<AptDrive> drive, const std::string& serial);

  const std::string& name() const override { return drive_->name(); }
  const Identity& identity() const override { return identity_; }
  std::optional<Bytes> control(const Setup& setup, std::span<const std::uint8_t> data) override;
  void bulk_out(std::span<const std::uint8_t> bytes) override;
  std::optional<Bytes> bulk_in(std::size_t room, Wall::time_point since) override;
  void step() override;
  void restart() override;
  void cycle_power() override { drive_->restart(); }

 private:
  struct OnTheLine {
    Wall::time_point arrives;
    std::uint8_t byte;
  };

  bool line_is_right() const;
  void send_to_host(const Bytes& bytes);

  std::unique_ptr<AptDrive> drive_;
  Identity identity_;
  std::uint16_t divisor_ = 0;
  std::uint16_t format_ = 0;
  bool rts_cts_ = false;
  bool rts_ = false;
  std::chrono::milliseconds latency_{16};
  std::deque<OnTheLine> to_host_;
  std::deque<std::uint8_t> to_drive_;
  Wall::time_point to_drive_at_{};  ///< when the last byte has arrived there
  Wall::time_point to_host_at_{};
};

}  // namespace gonio::usb_emulator
