#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "gonio/random/key.h"
#include "gonio/random/stream.h"
#include "tour_methods.h"
#include "tour_path.h"

namespace gonio::rig {
namespace {

constexpr double kImprovement_s = 1e-9;  // changes below it are rounding
constexpr int kLongestMovedPiece = 3;
constexpr int kMaxNeighbours = 10;
constexpr int kMaxKickPiece = 30;
constexpr int kMinKicks = 2000;
constexpr int kMaxKicks = 60000;
constexpr int kKicksBetweenPoseChoices = 200;

/// The nearest stops of every stop, by least travel time.
class Neighbours {
 public:
  explicit Neighbours(const TourProblem& problem)
      : count_(std::min(kMaxNeighbours, problem.stop_count() - 1)) {
    const int n = problem.stop_count();
    std::vector<std::pair<double, int>> others;
    for (int stop = 0; stop < n; ++stop) {
      others.clear();
      for (int other = 0; other < n; ++other) {
        if (other != stop) others.emplace_back(problem.least_cost(stop, other), other);
      }
      std::partial_sort(others.begin(), others.begin() + count_, others.end());
      for (int k = 0; k < count_; ++k) list_.push_back(others[static_cast<std::size_t>(k)].second);
    }
  }
  const int* begin(int stop) const { return list_.data() + std::ptrdiff_t{stop} * count_; }
  const int* end(int stop) const { return begin(stop) + count_; }

 private:
  int count_;
  std::vector<int> list_;
};

/// 2-opt, Or-opt and pose changes around the stops in a work list, until none of them improves.
class LocalSearch {
 public:
  LocalSearch(const TourProblem& problem, const Neighbours& neighbours)
      : problem_(problem),
        neighbours_(neighbours),
        queued_(static_cast<std::size_t>(problem.stop_count()), 0) {}

  void touch(int stop) {
    if (queued_[static_cast<std::size_t>(stop)]) return;
    queued_[static_cast<std::size_t>(stop)] = 1;
    queue_.push_back(stop);
  }

  void touch_all() {
    for (int stop = 0; stop < problem_.stop_count(); ++stop) touch(stop);
  }

  void run(TourPath& path) {
    while (!queue_.empty()) {
      const int stop = queue_.back();
      queue_.pop_back();
      queued_[static_cast<std::size_t>(stop)] = 0;
      while (improve(path, stop)) {
      }
    }
  }

 private:
  struct Change {
    enum class Kind { none, reverse, move, pose } kind = Kind::none;
    int first = 0, last = 0, after = 0;
    bool turned = false;
    double gain = -kImprovement_s;
  };

  /// Makes the best change around a stop, if there is one.
  bool improve(TourPath& path, int stop) {
    Change best;
    consider_poses(path, stop, best);
    for (const int* other = neighbours_.begin(stop); other != neighbours_.end(stop); ++other) {
      consider_reversals(path, stop, *other, best);
      consider_moves(path, stop, *other, best);
      consider_moves(path, *other, stop, best);
    }
    switch (best.kind) {
      case Change::Kind::none:
        return false;
      case Change::Kind::reverse:
        path.reverse(best.first, best.last);
        touch_around(path, best.first);
        touch_around(path, best.last);
        break;
      case Change::Kind::move: {
        const int length = best.last - best.first;
        path.move(best.first, best.last, best.after, best.turned);
        const int landed = best.after > best.last ? best.after - length : best.after + 1;
        touch_around(path, landed);
        touch_around(path, landed + length);
        touch_around(path, best.after > best.last ? best.first : best.last + 1);
        break;
      }
      case Change::Kind::pose:
        path.set_pose(best.first, best.after);
        touch_around(path, best.first);
        break;
    }
    return true;
  }

  void touch_around(const TourPath& path, int position) {
    for (int p = std::max(1, position - 1); p <= std::min(path.size(), position + 1); ++p) {
      touch(problem_.stop_of(path.node(p)));
    }
  }

  void consider_poses(const TourPath& path, int stop, Change& best) const {
    const int p = path.position(stop);
    for (int node = problem_.first_node(stop); node < problem_.first_node(stop + 1); ++node) {
      if (node == path.node(p)) continue;
      const double gain = path.pose_gain(p, node);
      if (gain < best.gain) best = {Change::Kind::pose, p, p, node, false, gain};
    }
  }

  /// The reversals that put two stops side by side.
  void consider_reversals(const TourPath& path, int stop, int other, Change& best) const {
    const int low = std::min(path.position(stop), path.position(other));
    const int high = std::max(path.position(stop), path.position(other));
    if (high - low < 2) return;
    for (const auto& [first, last] : {std::pair{low + 1, high}, std::pair{low, high - 1}}) {
      const double gain = path.reversal_gain(first, last);
      if (gain < best.gain) best = {Change::Kind::reverse, first, last, 0, false, gain};
    }
  }

  /// Moving short pieces that begin or end with `stop` to either side of `other`.
  void consider_moves(const TourPath& path, int stop, int other, Change& best) const {
    const int p = path.position(stop);
    const int target = path.position(other);
    for (int length = 1; length <= kLongestMovedPiece; ++length) {
      for (const int first : {p, p - length + 1}) {
        const int last = first + length - 1;
        if (first < 1 || last > path.size() || (target >= first && target <= last)) continue;
        // Putting it back in costs time, travel times being a metric.
        const double removal = path.removal_gain(first, last);
        if (removal >= best.gain) continue;
        for (const int after : {target - 1, target}) {
          if (after >= first - 1 && after <= last) continue;  // where it already is
          for (const bool turned : {false, true}) {
            if (turned && length == 1) continue;
            const double gain = removal + path.insertion_gain(first, last, after, turned);
            if (gain < best.gain) best = {Change::Kind::move, first, last, after, turned, gain};
          }
        }
        if (length == 1) break;
      }
    }
  }

  const TourProblem& problem_;
  const Neighbours& neighbours_;
  std::vector<int> queue_;
  std::vector<char> queued_;
};

std::vector<int> stops_of(const TourProblem& problem, const std::vector<int>& nodes) {
  std::vector<int> stops;
  stops.reserve(nodes.size());
  for (const int node : nodes) stops.push_back(problem.stop_of(node));
  return stops;
}

/// Always on to the nearest pose of a stop not yet seen.
std::vector<int> nearest_first(const TourProblem& problem) {
  std::vector<char> seen(static_cast<std::size_t>(problem.stop_count()), 0);
  std::vector<int> nodes;
  int at = 0;
  for (int k = 0; k < problem.stop_count(); ++k) {
    int nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int node = 1; node < problem.node_count(); ++node) {
      if (seen[static_cast<std::size_t>(problem.stop_of(node))]) continue;
      const double cost = problem.cost(at, node);
      if (nearest < 0 || cost < least) {
        nearest = node;
        least = cost;
      }
    }
    nodes.push_back(nearest);
    seen[static_cast<std::size_t>(problem.stop_of(nearest))] = 1;
    at = nearest;
  }
  return nodes;
}

/// Strips along one axis, to and fro along another; of first poses.
std::vector<int> boustrophedon(const TourProblem& problem, std::size_t major, std::size_t minor) {
  const int n = problem.stop_count();
  const auto joint = [&](int stop, std::size_t axis) {
    return problem.joints(problem.first_node(stop))[axis].radians();
  };
  std::vector<int> stops(static_cast<std::size_t>(n));
  std::iota(stops.begin(), stops.end(), 0);
  std::stable_sort(stops.begin(), stops.end(),
                   [&](int a, int b) { return joint(a, major) < joint(b, major); });
  const auto strips = static_cast<std::size_t>(std::max(1.0, std::sqrt(0.5 * n)));
  const std::size_t width = (stops.size() + strips - 1) / strips;
  bool falling = false;
  for (std::size_t begin = 0; begin < stops.size(); begin += width, falling = !falling) {
    const std::size_t end = std::min(begin + width, stops.size());
    std::stable_sort(stops.begin() + static_cast<std::ptrdiff_t>(begin),
                     stops.begin() + static_cast<std::ptrdiff_t>(end), [&](int a, int b) {
                       return falling ? joint(b, minor) < joint(a, minor)
                                      : joint(a, minor) < joint(b, minor);
                     });
  }
  return stops;
}

std::vector<std::vector<int>> constructions(const TourProblem& problem) {
  std::vector<int> as_listed(static_cast<std::size_t>(problem.stop_count()));
  std::iota(as_listed.begin(), as_listed.end(), 0);
  std::vector<std::vector<int>> found{best_poses(problem, as_listed), nearest_first(problem)};
  const std::size_t axes = std::min<std::size_t>(3, problem.joints(0).size());
  for (std::size_t major = 0; major < axes && axes > 1; ++major) {
    const std::size_t minor = (major + 1) % axes;
    found.push_back(best_poses(problem, boustrophedon(problem, major, minor)));
  }
  return found;
}

/// Exact choice of poses for the order at hand.
void choose_poses(const TourProblem& problem, TourPath& path, LocalSearch& search) {
  const std::vector<int> before = path.nodes();
  const std::vector<int> after = best_poses(problem, stops_of(problem, before));
  if (path_cost(problem, after) >= path.cost() - kImprovement_s) return;
  path = TourPath(problem, after);
  for (std::size_t k = 0; k < after.size(); ++k) {
    if (after[k] != before[k]) search.touch(problem.stop_of(after[k]));
  }
  search.run(path);
}

/// Swaps two neighbouring pieces: a double bridge that 2-opt cannot undo in one step.
void kick(const TourProblem& problem, TourPath& path, LocalSearch& search, random::Stream& stream) {
  const int n = path.size();
  const int longest = std::clamp(n / 3, 1, kMaxKickPiece);
  const auto draw = [&](int bound) {
    return static_cast<int>(stream.below(static_cast<std::uint64_t>(bound)));
  };
  const int one = 1 + draw(longest);
  const int two = 1 + draw(longest);
  const int first = 1 + draw(n - one - two + 1);
  path.move(first, first + one - 1, first + one + two - 1, false);
  for (const int p :
       {first - 1, first, first + two - 1, first + two, first + two + one - 1, first + two + one}) {
    if (p >= 1 && p <= n) search.touch(problem.stop_of(path.node(p)));
  }
}

}  // namespace

std::vector<int> searched_tour(const TourProblem& problem, const TourOptions& options) {
  const int n = problem.stop_count();
  if (n < 3) return exact_tour(problem);
  const Neighbours neighbours(problem);
  LocalSearch search(problem, neighbours);

  std::vector<TourPath> starts;
  for (const std::vector<int>& nodes : constructions(problem)) {
    TourPath path(problem, nodes);
    search.touch_all();
    search.run(path);
    choose_poses(problem, path, search);
    starts.push_back(std::move(path));
  }
  TourPath current =
      *std::min_element(starts.begin(), starts.end(),
                        [](const TourPath& a, const TourPath& b) { return a.cost() < b.cost(); });

  random::Stream stream(random::make_key(options.seed, "rig.tour"));
  const int kicks = std::clamp(options.kicks_per_stop * n, kMinKicks, kMaxKicks);
  TourPath trial = current;
  for (int i = 0; i < kicks; ++i) {
    trial = current;
    kick(problem, trial, search, stream);
    search.run(trial);
    if (i % kKicksBetweenPoseChoices == 0) choose_poses(problem, trial, search);
    if (trial.cost() <= current.cost() + kImprovement_s) std::swap(current, trial);
  }
  choose_poses(problem, current, search);
  return current.nodes();
}

}  // namespace gonio::rig
