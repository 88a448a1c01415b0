#pragma once

#include <optional>
#include <string>

#include "gonio/basis/basis.h"

namespace gonio::basis::detail {

/// A part of a basis that contradicts the others, in a reader's words.
struct Contradiction {
  std::string data_set;  ///< its name in the file
  std::string message;   ///< what was found and what was expected
};

/// What a file may claim although no training can have produced it: a mean that is no logarithm of
/// a BRDF, singular values that are negative or not descending, components whose lengths are not
/// the singular values or that are not at right angles (neighbours only: one pass over memory).
///
/// `basis`  All shapes as documented, all values finite.
/// Threads  Any; uses the threads of gonio::parallel.
std::optional<Contradiction> contradiction_in(const Basis& basis);

}  // namespace gonio::basis::detail
