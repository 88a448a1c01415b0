// What gonio relies on in the BLAS it was given (docs/adr/0001-threads-and-blas.md).
#include <cblas.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "gonio/parallel/parallel.h"

namespace gonio {
namespace {

using ::testing::AnyOf;
using ::testing::Each;
using ::testing::Not;

constexpr int kRows = 90;  // the size of a training Gram matrix
constexpr int kColumns = 400;

std::vector<double> gram(const std::vector<double>& a) {
  std::vector<double> product(kRows * kRows);
  cblas_dsyrk(CblasColMajor, CblasUpper, CblasNoTrans, kRows, kColumns, 1.0, a.data(), kRows, 0.0,
              product.data(), kRows);
  return product;
}

TEST(OpenBlas, UsesOneThreadPerCall) { EXPECT_EQ(openblas_get_num_threads(), 1); }

// A library older than the processor would take the oldest kernels it has.
TEST(OpenBlas, UsesTheVectorInstructionsThereAre) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") == 0 || __builtin_cpu_supports("fma") == 0) {
    GTEST_SKIP() << "the processor has no AVX2";
  }
  EXPECT_THAT(std::string(openblas_get_corename()), Not(AnyOf("Prescott", "Core2", "Nehalem")));
#else
  GTEST_SKIP() << "other processors have one set of kernels";
#endif
}

// Debian's serial build fails here: it hands the same buffer to two threads about once in a
// thousand to a million calls, so a lucky run of this test proves little, a failed one everything.
TEST(OpenBlas, GivesTheSameBytesWhenManyThreadsCallIt) {
  std::vector<double> a(static_cast<std::size_t>(kRows) * kColumns);
  for (std::size_t i = 0; i < a.size(); ++i) a[i] = 1.0 / (1.0 + static_cast<double>(i % 97));
  const std::vector<double> expected = gram(a);

  parallel::set_thread_count(4);
  std::vector<char> same(4000);
  parallel::for_each_block(0, same.size(), 1,
                           [&](std::size_t i, std::size_t) { same[i] = gram(a) == expected; });
  parallel::set_thread_count(0);
  EXPECT_THAT(same, Each(true));
}

}  // namespace
}  // namespace gonio
