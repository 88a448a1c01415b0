#include "gonio/render/png.h"

#include <png.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

namespace gonio::render {
namespace {

// libpng leaves a failing call by longjmp, which must not cross a destructor. So everything that
// owns memory lives in this object, outside the frame that setjmp marks.
struct Encoder {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::vector<std::uint8_t> row;
  std::vector<std::byte> bytes;
  std::string reason;

  ~Encoder() { png_destroy_write_struct(&png, &info); }
};

void remember_reason(png_structp png, png_const_charp message) {
  static_cast<Encoder*>(png_get_error_ptr(png))->reason = message;
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

void append(png_structp png, png_bytep data, png_size_t size) {
  std::vector<std::byte>& bytes = static_cast<Encoder*>(png_get_io_ptr(png))->bytes;
  const std::size_t at = bytes.size();
  bytes.resize(at + size);
  std::memcpy(bytes.data() + at, data, size);
}

void nothing_to_flush(png_structp) {}

void fill_row(const Image& image, int y, bool opaque, std::vector<std::uint8_t>& row) {
  row.clear();
  for (int x = 0; x < image.width(); ++x) {
    const Rgba8& pixel = image.at(x, y);
    row.insert(row.end(), {pixel.r, pixel.g, pixel.b});
    if (!opaque) row.push_back(pixel.a);
  }
}

bool encode(const Image& image, bool opaque, Encoder& encoder) {
  if (setjmp(png_jmpbuf(encoder.png)) != 0) return false;
  png_set_write_fn(encoder.png, &encoder, append, nothing_to_flush);
  png_set_IHDR(encoder.png, encoder.info, static_cast<png_uint_32>(image.width()),
               static_cast<png_uint_32>(image.height()), 8,
               opaque ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(encoder.png, encoder.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_compression_level(encoder.png, 6);
  png_write_info(encoder.png, encoder.info);
  for (int y = 0; y < image.height(); ++y) {
    fill_row(image, y, opaque, encoder.row);
    png_write_row(encoder.png, encoder.row.data());
  }
  png_write_end(encoder.png, nullptr);
  return true;
}

}  // namespace

std::vector<std::byte> encode_png(const Image& image) {
  const bool opaque = std::all_of(image.pixels().begin(), image.pixels().end(),
                                  [](const Rgba8& pixel) { return pixel.a == 255; });
  Encoder encoder;
  encoder.row.reserve(static_cast<std::size_t>(image.width()) * 4);
  encoder.png =
      png_create_write_struct(PNG_LIBPNG_VER_STRING, &encoder, remember_reason, ignore_warning);
  if (encoder.png != nullptr) encoder.info = png_create_info_struct(encoder.png);
  if (encoder.info == nullptr) throw std::runtime_error("cannot encode PNG: out of memory");
  if (!encode(image, opaque, encoder)) {
    throw std::runtime_error("cannot encode PNG: " + encoder.reason);
  }
  return std::move(encoder.bytes);
}

void write_png(const std::filesystem::path& path, const Image& image, files::Overwrite overwrite) {
  files::AtomicFile file(path, overwrite);
  file.write(encode_png(image));
  file.commit();
}

}  // namespace gonio::render
