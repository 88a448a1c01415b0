#include <cblas.h>

// We cut work into fixed blocks ourselves (gonio::parallel). A BLAS that splits calls by the
// number of processors would sum in another order on another machine, and would start threads
// under our threads. The initialiser runs before main; no target can link OpenBLAS without it.
// A linker symbol, not a name for readers: NOLINTNEXTLINE(readability-identifier-naming)
extern "C" const int gonio_openblas_one_thread;
extern "C" const int gonio_openblas_one_thread = [] {
  openblas_set_num_threads(1);
  return 1;
}();
