#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace gonio::brdf {

/// Asks for large pages behind memory that is about to be filled: with small ones the 8,500 page
/// faults of a table cost more than reading it does, and a random look-up one more cache miss. A
/// hint; refusal does not matter.
inline void advise_large_pages(void* begin, std::size_t bytes) {
  constexpr std::uintptr_t kPage = 4096;
  const auto from = (reinterpret_cast<std::uintptr_t>(begin) + kPage - 1) / kPage * kPage;
  const auto to = (reinterpret_cast<std::uintptr_t>(begin) + bytes) / kPage * kPage;
  if (to > from) ::madvise(reinterpret_cast<void*>(from), to - from, MADV_HUGEPAGE);
}

/// std::vector(size, value) on large pages.
template <typename Vector>
Vector on_large_pages(std::size_t size, const typename Vector::value_type& value) {
  Vector vector;
  vector.reserve(size);
  advise_large_pages(vector.data(), size * sizeof(typename Vector::value_type));
  vector.resize(size, value);
  return vector;
}

}  // namespace gonio::brdf
