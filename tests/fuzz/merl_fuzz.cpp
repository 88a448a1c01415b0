#include <unistd.h>

#include <cstring>
#include <fstream>
#include <string>

#include "gonio/brdf/merl_file.h"
#include "trial.h"

namespace {

/// A file of the right size, kept between trials (35 MB), and its name for a sidecar.
class WholeFile {
 public:
  WholeFile() : file_({}) {
    file_.resize(gonio::brdf::kMerlFileBytes);
    const std::int32_t dimensions[3] = {90, 90, 180};
    write(0, dimensions, sizeof dimensions);
  }
  void write(std::uint64_t offset, const void* bytes, std::size_t size) {
    file_.write_at(offset, {static_cast<const std::uint8_t*>(bytes), size});
  }
  const std::filesystem::path& path() const { return file_.path(); }

 private:
  gonio::fuzz::MemoryFile file_;
};

}  // namespace

/// First byte 0: the rest is a whole file. 1: a number of eight bytes and its place in a file that
/// is otherwise right.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  if (data[0] != 1 || size < 13) {
    return gonio::fuzz::trial(data + 1, size - 1,
                              [](const auto& path) { gonio::brdf::read_merl(path); });
  }
  static WholeFile whole;
  std::uint32_t place = 0;
  std::memcpy(&place, data + 1, sizeof place);
  const std::uint64_t offset = 12 + place % (gonio::brdf::kMerlFileBytes - 20);
  whole.write(offset, data + 5, 8);
  try {
    gonio::brdf::read_merl(whole.path());
  } catch (const gonio::DataFormatError&) {
  }
  const double zero = 0.0;
  whole.write(offset, &zero, sizeof zero);
  return 0;
}
