#include <cblas.h>

#include <cstdlib>
#include <string_view>

// What OpenBLAS must be told before it is first called (docs/adr/0001-threads-and-blas.md). The
// initialiser runs before main; no target can link OpenBLAS without it.

// Exported by every build that chooses its kernels at run time, though not declared in cblas.h;
// weak, so that a build made for one processor links as well.
extern "C" __attribute__((weak)) void gotoblas_dynamic_init();
extern "C" __attribute__((weak)) void gotoblas_dynamic_quit();

namespace {

/// A library older than the processor does not know its model number and takes the oldest kernels
/// it has, whatever instructions there are: five times slower on a 2023 server (0.3.21).
void choose_kernels_by_instructions() {
#if defined(__x86_64__)
  constexpr const char* kVariable = "OPENBLAS_CORETYPE";
  const bool oldest = std::string_view(openblas_get_corename()) == "Prescott";
  if (!oldest || std::getenv(kVariable) != nullptr) return;
  if (gotoblas_dynamic_init == nullptr || gotoblas_dynamic_quit == nullptr) return;
  const bool avx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  const bool avx512 =
      __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
      __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512dq") != 0;
  if (!avx2) return;
  ::setenv(kVariable, avx512 ? "SkylakeX" : "Haswell", 1);
  gotoblas_dynamic_quit();
  gotoblas_dynamic_init();
  ::unsetenv(kVariable);
#endif
}

}  // namespace

// A linker symbol, not a name for readers: NOLINTNEXTLINE(readability-identifier-naming)
extern "C" const int gonio_openblas_settings;
extern "C" const int gonio_openblas_settings = [] {
  // We cut work into fixed blocks ourselves (gonio::parallel). A BLAS that splits calls by the
  // number of processors would sum in another order on another machine, and would start threads
  // under our threads.
  openblas_set_num_threads(1);
  choose_kernels_by_instructions();
  return 1;
}();
