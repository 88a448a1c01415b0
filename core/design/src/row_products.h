#pragma once

#include <cstddef>

namespace gonio::design {

/// out[v] = row . vectors[v], v < count; `vectors` hold k numbers each, one after another. Few thin
/// products per row, where a BLAS spends its time packing. Sums run in eight interleaved parts, the
/// same on every machine.
///
/// With float the result is good to a millionth of the lengths' product. With double only the
/// row's own single precision is left: for sums that are kept.
void row_products(const float* row, std::size_t k, const float* vectors, std::size_t count,
                  float* out);
void row_products(const float* row, std::size_t k, const double* vectors, std::size_t count,
                  double* out);

}  // namespace gonio::design
