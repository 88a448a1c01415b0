#include "gonio/brdf/merl_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "gonio/errors/errors.h"
#include "gonio/files/input_file.h"
#include "gonio/files/sha256.h"
#include "gonio/files/text_file.h"
#include "large_pages.h"
#include "merl_sidecar.h"

namespace gonio::brdf {
namespace {

static_assert(std::endian::native == std::endian::little, "MERL files are little-endian");

using Header = std::array<std::int32_t, 3>;
constexpr Header kHeader = {lattice::kThetaH, lattice::kThetaD, lattice::kPhiD};
constexpr std::size_t kStored = 3 * lattice::kCells;
static_assert(sizeof(Header) + kStored * sizeof(double) == kMerlFileBytes);

/// Read, checked and hashed while still in the cache.
constexpr std::size_t kChunk = std::size_t{32} << 10U;  // doubles: 256 KiB

/// Whether all are finite, at memory speed: adding one to an exponent of all ones carries into the
/// sign bit, which no other exponent does.
bool all_finite(std::span<const double> values) {
  constexpr std::uint64_t kExponent = 0x7FF0'0000'0000'0000U;
  constexpr std::uint64_t kLowestExponentBit = 0x0010'0000'0000'0000U;
  std::uint64_t carried = 0;
  for (const double value : values) {
    carried |= (std::bit_cast<std::uint64_t>(value) & kExponent) + kLowestExponentBit;
  }
  return carried >> 63U == 0;
}

std::size_t first_not_finite(std::span<const double> values) {
  const auto found =
      std::find_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); });
  return static_cast<std::size_t>(found - values.begin());
}

std::string place_of(std::size_t stored_index) {
  return "byte " + std::to_string(sizeof(Header) + stored_index * sizeof(double));
}

/// "NaN in the G plane at index (3, 0, 179)"
std::string describe(double value, std::size_t stored_index) {
  const lattice::Index at = lattice::index_from_cell(stored_index % lattice::kCells);
  return std::string(std::isnan(value) ? "NaN" : "an infinite value") + " in the " +
         "RGB"[stored_index / lattice::kCells] + " plane at index (" + std::to_string(at.theta_h) +
         ", " + std::to_string(at.theta_d) + ", " + std::to_string(at.phi_d) + ")";
}

bool any_valid_above_horizon(const BrdfTable& table) {
  const auto& cells = lattice::cells_above_horizon(table.convention());
  return std::any_of(cells.begin(), cells.end(),
                     [&](std::uint32_t cell) { return table.valid(cell); });
}

std::string dimensions(const Header& header) {
  return std::to_string(header[0]) + " x " + std::to_string(header[1]) + " x " +
         std::to_string(header[2]);
}

void check_header(const std::filesystem::path& path, files::InputFile& file, const Header& header) {
  if (header != kHeader) {
    throw DataFormatError(path, "byte 0",
                          "found dimensions " + dimensions(header) + ", expected 90 x 90 x 180");
  }
  if (file.size() != kMerlFileBytes) {
    throw DataFormatError(path, "byte " + std::to_string(std::min(file.size(), kMerlFileBytes)),
                          "found " + std::to_string(file.size()) + " bytes, expected " +
                              std::to_string(kMerlFileBytes));
  }
}

/// A sidecar of ours whose binary never came: worth nothing, so it must not stop a second try.
bool left_by_a_crash(const std::filesystem::path& binary) {
  std::error_code ignored;
  if (std::filesystem::exists(binary, ignored)) return false;
  try {
    return read_merl_sidecar(binary).has_value();
  } catch (const std::runtime_error&) {
    return false;  // something else of that name: the caller's rule for existing files holds
  }
}

/// What stands under the name a new sidecar is to get; nothing when it is free.
std::optional<std::string> old_text(const std::filesystem::path& sidecar) {
  if (!std::filesystem::exists(sidecar)) return std::nullopt;
  return files::read_text_file(sidecar);
}

/// The old sidecar again beside the old binary. Where that fails too, the new sidecar stays, which
/// read_merl() refuses beside the old binary.
void put_back(const std::filesystem::path& sidecar, const std::optional<std::string>& text) {
  try {
    if (text) {
      files::write_text_file(sidecar, *text, files::Overwrite::Yes);
    } else {
      std::filesystem::remove(sidecar);
    }
  } catch (const std::runtime_error&) {  // what stopped the binary is the news
  }
}

}  // namespace

BrdfTable read_merl(const std::filesystem::path& path) {
  files::InputFile file(path);
  Header header{};
  const auto header_bytes = std::as_writable_bytes(std::span(header));
  file.read(header_bytes);
  check_header(path, file, header);

  const std::optional<MerlSidecar> sidecar = read_merl_sidecar(path);
  std::optional<files::Sha256> hash;
  if (sidecar) {
    hash.emplace();
    hash->update(header_bytes);
  }
  // Appended chunk by chunk: sizing the vector first would write its 35 MB twice.
  std::vector<double> stored;
  stored.reserve(kStored);
  advise_large_pages(stored.data(), kStored * sizeof(double));
  std::vector<double> buffer(kChunk);
  while (stored.size() < kStored) {
    const std::span chunk(buffer.data(), std::min(kChunk, kStored - stored.size()));
    file.read(std::as_writable_bytes(chunk));
    if (!all_finite(chunk)) {
      const std::size_t bad = first_not_finite(chunk);
      const std::size_t index = stored.size() + bad;
      throw DataFormatError(path, place_of(index),
                            "found " + describe(chunk[bad], index) + ", expected a finite number");
    }
    if (hash) hash->update(std::as_bytes(chunk));
    stored.insert(stored.end(), chunk.begin(), chunk.end());
  }
  if (sidecar) {
    if (const std::string found = hash->finish(); found != sidecar->binary_sha256) {
      throw DataFormatError(merl_sidecar_path(path), "key \"binary_sha256\"",
                            "found the sum of another file, expected that of " +
                                path.filename().string() + " (" + found + ")");
    }
  }
  BrdfTable table(std::move(stored), sidecar ? sidecar->convention : IndexConvention::bin_centre,
                  sidecar ? sidecar->scale : RadiometricScale::merl);
  if (!any_valid_above_horizon(table)) {
    throw DataFormatError(path, place_of(0),
                          "found no valid cell above the horizon, expected at least one");
  }
  return table;
}

std::string merl_sha256(const BrdfTable& table) {
  files::Sha256 hash;
  hash.update(std::as_bytes(std::span(kHeader)));
  hash.update(std::as_bytes(std::span(table.stored_planes())));
  return hash.finish();
}

void write_merl(const std::filesystem::path& path, const BrdfTable& table,
                files::Overwrite overwrite, std::string_view provenance_json) {
  const std::span<const double> stored(table.stored_planes());
  if (!all_finite(stored)) {
    const std::size_t bad = first_not_finite(stored);
    throw std::invalid_argument("write_merl: " + describe(stored[bad], bad));
  }
  if (!any_valid_above_horizon(table)) {
    throw std::invalid_argument("write_merl: the table has no valid cell above the horizon");
  }
  const auto header_bytes = std::as_bytes(std::span(kHeader));
  const std::string sidecar = sidecar_text(
      {table.convention(), table.scale(), merl_sha256(table), std::string(provenance_json)});

  files::AtomicFile binary_file(path, overwrite);
  const std::filesystem::path sidecar_path = merl_sidecar_path(path);
  files::AtomicFile sidecar_file(sidecar_path,
                                 left_by_a_crash(path) ? files::Overwrite::Yes : overwrite);
  binary_file.write(header_bytes);
  binary_file.write(std::as_bytes(stored));
  sidecar_file.write(sidecar);
  // The names, old and new, in the order they come to stand: (B0, S0) -> (B0, S1) -> (B1, S1). The
  // middle one is refused by its SHA-256; B1 never stands beside S0 or alone, where its numbers
  // would be read in another unit.
  const std::optional<std::string> old_sidecar = old_text(sidecar_path);
  sidecar_file.prepare();
  binary_file.prepare();
  try {
    sidecar_file.commit();
    binary_file.commit();
  } catch (...) {
    if (sidecar_file.committed() && !binary_file.committed()) put_back(sidecar_path, old_sidecar);
    throw;
  }
}

}  // namespace gonio::brdf
