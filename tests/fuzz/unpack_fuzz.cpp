// Pixels of every format, from bytes of every length: the fast kernels and the plain ones agree.

#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "gonio/aravis_camera/unpack.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gonio::aravis_camera;
  if (size < 3) return 0;
  const auto formats = wire_formats();
  const WireFormat& format = formats[data[0] % formats.size()];
  const std::size_t pixels = data[1] | (data[2] << 8U);
  const auto packed = std::as_bytes(std::span(data + 3, size - 3));
  std::vector<std::uint16_t> fast(pixels);
  std::vector<std::uint16_t> plain(pixels);
  bool refused = false;
  try {
    unpack(format.packing, packed, fast);
  } catch (const std::invalid_argument&) {
    refused = true;
  }
  try {
    unpack_plain(format.packing, packed, plain);
    if (refused) std::abort();
  } catch (const std::invalid_argument&) {
    if (!refused) std::abort();
  }
  if (refused != (packed.size() != packed_size(format.packing, pixels))) std::abort();
  if (!refused && fast != plain) std::abort();
  return 0;
}
