#pragma once

#include <span>
#include <string_view>

namespace gonio::shipped_drives {

/// One file of rigs/drives.
struct ShippedDrive {
  std::string_view name;  ///< "leadshine-em2rs"
  std::string_view toml;
};

std::span<const ShippedDrive> shipped_drives();

}  // namespace gonio::shipped_drives
