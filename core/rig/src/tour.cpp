#include "tour_methods.h"

namespace gonio::rig {

Tour shortest_tour(const TravelModel& travel, const Joints& start,
                   const std::vector<TourStop>& stops, const TourOptions& options) {
  const TourProblem problem(travel, start, stops, options.end);
  const bool exact = problem.stop_count() <= options.exact_up_to && exact_is_affordable(problem);
  Tour tour = problem.tour_of(exact ? exact_tour(problem) : searched_tour(problem, options));
  tour.exact = exact;
  tour.lower_bound_s = exact ? tour.travel_s : tour_lower_bound(problem, tour.travel_s);
  return tour;
}

Tour shortest_tour(const TravelModel& travel, const Joints& start,
                   const std::vector<TourStop>& stops, std::uint64_t seed) {
  TourOptions options;
  options.seed = seed;
  return shortest_tour(travel, start, stops, options);
}

}  // namespace gonio::rig
