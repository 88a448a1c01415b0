#pragma once

#include <cstdint>
#include <span>

#include "gonio/random/key.h"

/// Random numbers as values: each function below is a pure function of its arguments. `counter`
/// says which number of the sequence is meant (a pixel's index, say), so loops may run in any
/// order and on any number of threads and still give the same bytes.
///
/// The three distributions take their bits from separate parts of the key's sequence: one key may
/// serve all of them, and a counter used for one is still fresh for another.
///
/// Threads  Any.
namespace gonio::random {

/// Uniform on [0, 1), a multiple of 2^-53.
double uniform(Key key, std::uint64_t counter);

/// Standard normal, within +-8.2: the inverse of the distribution function at a uniform number
/// with 52 bits, symmetric about zero.
double normal(Key key, std::uint64_t counter);

/// Poisson with the given mean; a whole number.
///
/// Method   Below 10 by inversion; to 1e6 by Hörmann, "The transformed rejection method for
///          generating Poisson random variables", Insurance: Mathematics and Economics 12, 1993
///          (PTRS); above as a rounded normal number, whose skewness of 1e-3 is then lost.
/// Throws   std::invalid_argument if the mean is negative, infinite or not a number.
double poisson(Key key, std::uint64_t counter, double mean);

/// out[i] = uniform(key, first + i), faster than one by one.
void fill_uniform(Key key, std::uint64_t first, std::span<double> out);

/// out[i] = normal(key, first + i), faster than one by one.
void fill_normal(Key key, std::uint64_t first, std::span<double> out);

/// out[i] = poisson(key, first + i, means[i]). `out` may be `means`.
/// Throws   std::invalid_argument if the sizes differ, and as poisson().
void fill_poisson(Key key, std::uint64_t first, std::span<const double> means,
                  std::span<double> out);

/// The number below which a standard normal variable lies with the given probability.
///
/// Range    `probability` in (0, 1); relative error about 1e-16.
/// Throws   std::invalid_argument outside it.
/// Source   Wichura, "Algorithm AS 241: The Percentage Points of the Normal Distribution",
///          Applied Statistics 37, 1988 (PPND16).
double normal_quantile(double probability);

}  // namespace gonio::random
