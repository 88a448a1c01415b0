#pragma once

#include <optional>
#include <vector>

#include "gonio/rig/travel.h"

namespace gonio::rig {

/// A time that no tour from `start` over these stops (and to `end`) can beat, whatever its order
/// and its choice of poses: shortest_tour()'s lower_bound_s for a tour that came from somewhere
/// else.
///
/// `tour_s`  Travel of a tour that is known; 0 for no stops.
/// Cost      A quarter of a second for any number of stops.
/// Throws    std::invalid_argument for a stop without alternatives.
/// Source    Held and Karp, "The Traveling-Salesman Problem and Minimum Spanning Trees",
///           Operations Research 18, 1970.
double travel_lower_bound(const TravelModel& travel, const Joints& start,
                          const std::vector<TourStop>& stops, double tour_s,
                          const std::optional<Joints>& end = std::nullopt);

}  // namespace gonio::rig
