#pragma once

#include <span>
#include <string_view>

namespace gonio::cli {

struct MerlSum {
  std::string_view name;    ///< file name without ".binary"
  std::string_view sha256;  ///< 64 hexadecimal digits
};

/// SHA-256 of the 100 files of the MERL BRDF database (Matusik et al. 2003) as distributed.
std::span<const MerlSum> merl_sums();

}  // namespace gonio::cli
