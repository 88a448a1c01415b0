#pragma once

#include <arv.h>

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

#include "gonio/devices/frame.h"
#include "gonio/gige_emulator/gige_camera.h"

namespace gonio::gige_emulator {

/// What the fake camera's thread puts into the frames that it sends.
///
/// Threads  All members from any thread.
class ImageSource {
 public:
  explicit ImageSource(int adc_bits) : adc_bits_(adc_bits) {}

  /// The bytes of the next frame. `repeat_id`: it carries the id of the one before.
  void show(std::vector<std::uint8_t> image, bool repeat_id);
  /// Instead of that these, round and round, from the first.
  void show_always(std::vector<devices::Frame> frames);

  std::vector<TransferRecord> transfers() const;

  /// For Aravis, with the object as `self`. The camera's control channel is dead meanwhile.
  static void fill(ArvBuffer* buffer, void* self, guint32 exposure_us, guint32 gain,
                   ArvPixelFormat format);

 private:
  void fill_buffer(ArvBuffer* buffer, ArvPixelFormat format);
  const std::vector<std::uint8_t>& next_image(ArvBuffer* buffer, std::size_t room);

  int adc_bits_;
  mutable std::mutex mutex_;
  std::vector<std::uint8_t> image_;
  bool repeat_id_ = false;
  std::uint64_t last_id_ = 0;
  std::vector<devices::Frame> frames_;
  std::vector<std::vector<std::uint8_t>> images_;  ///< of them, packed when first asked for
  std::size_t shown_ = 0;
  std::vector<TransferRecord> transfers_;
};

}  // namespace gonio::gige_emulator
