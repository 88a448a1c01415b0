#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace gonio::basis::detail {

/// Asks for large pages behind memory that is about to be filled: with small ones the page faults
/// of a training set (300,000 at 90 materials) cost as much as mapping it. A hint; refusal does
/// not matter.
inline void advise_large_pages(void* begin, std::size_t bytes) {
  constexpr std::uintptr_t kPage = 4096;
  const auto from = (reinterpret_cast<std::uintptr_t>(begin) + kPage - 1) / kPage * kPage;
  const auto to = (reinterpret_cast<std::uintptr_t>(begin) + bytes) / kPage * kPage;
  if (to > from) ::madvise(reinterpret_cast<void*>(from), to - from, MADV_HUGEPAGE);
}

}  // namespace gonio::basis::detail
