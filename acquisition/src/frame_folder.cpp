#include "frame_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "gonio/files/sha256.h"

namespace gonio::acquisition {
namespace {

/// Under another name, which nothing else has.
std::string set_aside(const std::filesystem::path& folder, const std::string& name) {
  for (int attempt = 1;; ++attempt) {
    const std::string aside = fmt::format("{}.without-row-{}", name, attempt);
    if (std::filesystem::exists(folder / aside)) continue;
    std::filesystem::rename(folder / name, folder / aside);
    return aside;
  }
}

}  // namespace

std::string frame_file_name(std::int64_t id) { return fmt::format("frames/{:06}.tiff", id); }

std::vector<std::int64_t> numbers_of_frame_files(const std::filesystem::path& folder) {
  std::vector<std::int64_t> numbers;
  std::error_code missing;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "frames", missing)) {
    const std::string digits = entry.path().stem().string();
    std::int64_t number = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error != std::errc() || end != digits.data() + digits.size()) continue;
    if (folder / frame_file_name(number) == entry.path()) numbers.push_back(number);
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

std::vector<std::int64_t> without_rows(const std::vector<std::int64_t>& files,
                                       std::int64_t last_row) {
  return {std::upper_bound(files.begin(), files.end(), last_row), files.end()};
}

std::vector<std::string> cut_back(const std::filesystem::path& folder, std::int64_t last_row) {
  std::vector<std::string> done;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "frames")) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(".") || !name.ends_with(".part")) continue;
    done.push_back("frames/" + name);
  }
  std::vector<std::int64_t> left = without_rows(numbers_of_frame_files(folder), last_row);
  if (left == std::vector{last_row + 1}) {
    done.push_back(frame_file_name(left.front()));
    left.clear();
  }
  std::sort(done.begin(), done.end());
  for (std::string& name : done) {
    std::filesystem::remove(folder / name);
    name += " was never acknowledged, removed";
  }
  for (const std::int64_t number : left) {
    const std::string name = frame_file_name(number);
    done.push_back(fmt::format("{} has lost its row, kept as {}", name, set_aside(folder, name)));
  }
  return done;
}

std::string fault_of(const std::filesystem::path& path, const std::string& sha256,
                     const devices::Frame& shape) {
  if (!std::filesystem::is_regular_file(path)) {
    std::error_code none;
    return std::filesystem::exists(std::filesystem::symlink_status(path, none))
               ? "is no regular file"
               : "is missing";
  }
  const std::uintmax_t pixel_bytes =
      sizeof(std::uint16_t) * std::uintmax_t(shape.width_px) * std::uintmax_t(shape.height_px);
  const std::uintmax_t size = std::filesystem::file_size(path);
  if (size < pixel_bytes) return "is smaller than its pixels";
  // Said at once: the checksum of a file that somebody made endless takes as long.
  constexpr std::uintmax_t kMostBesidePixels = 65536;
  if (size > pixel_bytes + kMostBesidePixels) return "is larger than its pixels";
  return files::sha256_of_file(path) == sha256 ? "" : "does not have its checksum";
}

}  // namespace gonio::acquisition
