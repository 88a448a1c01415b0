#pragma once

// Loops that exist twice, for any processor and for one with AVX2, chosen at run time: the program
// is compiled for the least processor (docs/adr/0001). Write the loop once as a GONIO_INLINE
// function, call it from a plain and from a GONIO_TARGET_AVX2 one, and test GONIO_WITH_AVX2 and
// has_avx2() where it is called. Both give the same bytes: without fused
// multiply-add, sums in an order that does not depend on the width of a register.
#if defined(__x86_64__) && defined(__GNUC__)
#define GONIO_WITH_AVX2 1
#define GONIO_TARGET_AVX2 __attribute__((target("avx2")))

namespace gonio::parallel {

/// Whether this processor has AVX2; asked once. Any thread.
inline bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}

}  // namespace gonio::parallel
#else
#define GONIO_WITH_AVX2 0
#endif

#define GONIO_INLINE inline __attribute__((always_inline))
