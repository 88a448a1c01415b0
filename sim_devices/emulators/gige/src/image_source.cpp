#include "image_source.h"

#include <chrono>
#include <cstring>
#include <utility>

#include "image.h"

namespace gonio::gige_emulator {

void ImageSource::show(std::vector<std::uint8_t> image, bool repeat_id) {
  const std::scoped_lock lock(mutex_);
  image_ = std::move(image);
  repeat_id_ = repeat_id;
}

void ImageSource::show_always(std::vector<devices::Frame> frames) {
  const std::scoped_lock lock(mutex_);
  frames_ = std::move(frames);
  images_.clear();
  shown_ = 0;
}

std::vector<TransferRecord> ImageSource::transfers() const {
  const std::scoped_lock lock(mutex_);
  return transfers_;
}

void ImageSource::fill(ArvBuffer* buffer, void* self, guint32, guint32, ArvPixelFormat format) {
  static_cast<ImageSource*>(self)->fill_buffer(buffer, format);
}

void ImageSource::fill_buffer(ArvBuffer* buffer, ArvPixelFormat format) {
  const std::scoped_lock lock(mutex_);
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
  transfers_.push_back({std::chrono::steady_clock::now(), room});
}

const std::vector<std::uint8_t>& ImageSource::next_image(ArvBuffer* buffer, std::size_t room) {
  if (frames_.empty()) return image_;
  if (images_.empty() || images_.front().size() != room) {
    ImageSettings of;
    arv_buffer_get_image_region(buffer, &of.x, &of.y, &of.width, &of.height);
    of.black_level_dn = frames_.front().black_level_dn;
    of.adc_bits = adc_bits_;
    const PixelFormat* const format = pixel_format(arv_buffer_get_image_pixel_format(buffer));
    images_.clear();
    for (const devices::Frame& frame : frames_) {
      images_.push_back(format == nullptr ? std::vector<std::uint8_t>()
                                          : image(frame, of, *format));
    }
  }
  return images_[shown_++ % images_.size()];
}

}  // namespace gonio::gige_emulator
