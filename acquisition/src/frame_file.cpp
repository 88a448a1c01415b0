#include "gonio/acquisition/frame_file.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <cerrno>
#include <memory>

#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "gonio/files/input_file.h"
#include "gonio/files/sha256.h"

namespace gonio::acquisition {
namespace {

struct CloseTiff {
  void operator()(TIFF* tiff) const noexcept { TIFFClose(tiff); }
};
using Tiff = std::unique_ptr<TIFF, CloseTiff>;

/// libtiff prints on its own unless told not to; every failure is reported by the caller.
void silence_libtiff() {
  static const bool kDone = [] {
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    return true;
  }();
  static_cast<void>(kDone);
}

}  // namespace

std::string write_frame_file(const std::filesystem::path& path, const devices::Frame& frame,
                             files::Overwrite overwrite) {
  silence_libtiff();
  files::AtomicFile file(path, overwrite);
  {
    errno = 0;
    const Tiff tiff(TIFFOpen(file.temporary_path().c_str(), "w"));
    if (!tiff && errno != 0) throw FileError(path, "write", errno);
    if (!tiff) throw FileError(path, "write", "libtiff cannot open it");
    const auto width = static_cast<std::uint32_t>(frame.width_px);
    const auto height = static_cast<std::uint32_t>(frame.height_px);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, width);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, height);
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, height);
    // libtiff takes a non-const buffer although it only reads it when no byte swap is needed.
    auto* pixels = const_cast<std::uint16_t*>(frame.pixels_dn.data());
    const auto bytes = static_cast<tmsize_t>(frame.pixels_dn.size() * sizeof(std::uint16_t));
    if (TIFFWriteEncodedStrip(tiff.get(), 0, pixels, bytes) != bytes ||
        TIFFFlush(tiff.get()) != 1) {
      throw FileError(path, "write", "libtiff could not write the pixels (disk full?)");
    }
  }
  const std::string sha256 = files::sha256_of_file(file.temporary_path());
  file.commit();
  return sha256;
}

std::vector<std::uint16_t> read_frame_file(const std::filesystem::path& path, int width_px,
                                           int height_px) {
  silence_libtiff();
  files::require_regular_file(path);
  const Tiff tiff(TIFFOpen(path.c_str(), "r"));
  if (!tiff) throw DataFormatError(path, "byte 0", "not a readable TIFF file");
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint16_t bits = 0;
  std::uint16_t samples = 1;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &samples);
  if (width != static_cast<std::uint32_t>(width_px) ||
      height != static_cast<std::uint32_t>(height_px) || bits != 16 || samples != 1) {
    throw DataFormatError(path, "TIFF header",
                          fmt::format("found {} x {} px, {} sample(s) of {} bit, expected {} x {} "
                                      "px, 1 sample of 16 bit",
                                      width, height, samples, bits, width_px, height_px));
  }
  // The journal and the header may agree on a size that the file cannot hold.
  const std::uintmax_t pixel_bytes = sizeof(std::uint16_t) * std::uintmax_t{width} * height;
  std::uint16_t compression = COMPRESSION_NONE;
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_COMPRESSION, &compression);
  if (compression != COMPRESSION_NONE || std::filesystem::file_size(path) < pixel_bytes) {
    throw DataFormatError(path, "TIFF header",
                          fmt::format("expected {} bytes of uncompressed pixels", pixel_bytes));
  }
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(width) * height);
  if (TIFFScanlineSize(tiff.get()) != static_cast<tmsize_t>(width * sizeof(std::uint16_t))) {
    throw DataFormatError(path, "TIFF header", "unexpected row size");
  }
  for (std::uint32_t row = 0; row < height; ++row) {
    if (TIFFReadScanline(tiff.get(), &pixels[static_cast<std::size_t>(row) * width], row, 0) != 1) {
      throw DataFormatError(path, fmt::format("row {}", row), "pixels are missing");
    }
  }
  return pixels;
}

}  // namespace gonio::acquisition
