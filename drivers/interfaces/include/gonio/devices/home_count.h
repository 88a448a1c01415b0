#pragma once

#include <deque>
#include <optional>

#include "gonio/devices/clock.h"

namespace gonio::devices {

/// Finds the home mark in the count of a drive that counts on in its old zero until it says that it
/// is home: between where it was read last and as far as it may have got since, at the speeds at
/// which it was seen to go.
///
/// Units    Counts, and the time of one clock.
/// Threads  One.
class HomeCount {
 public:
  using Time = Clock::Duration;

  /// How far the count went from where the axis stood to the mark.
  struct Way {
    double counts = 0.0;  ///< signed
    double within = 0.0;  ///< off by this at most
  };

  /// `standing`: where the axis stood before it was sent.
  explicit HomeCount(double standing) : standing_(standing) {}

  /// `count`, asked for at `asked`; the drive has said since that it still searches.
  void searching(double count, Time asked);

  /// By `by` the drive had said that it searches no more; the first after a search counts.
  void searches_no_more(Time by);

  /// Nothing where it was read too seldom, or still searches.
  std::optional<Way> way_to_mark() const;

 private:
  struct Reading {
    double count;
    Time asked;
  };
  double standing_;
  std::deque<Reading> last_;  ///< the few that tell its speed at the end
  std::optional<Time> found_by_;
};

}  // namespace gonio::devices
