#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "gonio/basis/basis.h"

namespace gonio::basis {

/// Siblings are materials that tell more of each other than of a new one: a product in several
/// colours, a measurement and its decoded network. Whoever leaves a material out to see how well
/// the others predict it leaves out its siblings too, or flatters itself.
///
/// Returns  The number of each material's group (MaterialId::group) by first appearance; a material
///          whose group is empty is a group of its own.
std::vector<std::size_t> sibling_groups(std::span<const MaterialId> materials);

/// Fewer groups than this tell nobody what is usual.
inline constexpr std::size_t kFewestGroups = 12;
/// Fewer groups than this leave nothing to compare a left-out one's error with.
inline constexpr std::size_t kFewestGroupsForBands = 3;

/// How many groups there are.
std::size_t count_groups(std::span<const MaterialId> materials);

/// The training rows of each group, ascending.
std::vector<std::vector<Eigen::Index>> rows_of_groups(const Basis& basis);

}  // namespace gonio::basis
