#pragma once

#include <cstddef>
#include <vector>

namespace gonio::monitor {

/// Values over time in bounded memory: when there are too many, every second one is dropped, and
/// from then on only every second, fourth, ... value is kept. The first and the last always are.
class ThinnedSeries {
 public:
  struct Value {
    double at_s = 0.0;
    double value = 0.0;

    bool operator==(const Value&) const = default;
  };
  static constexpr std::size_t kMost = 512;

  void add(Value value);
  std::vector<Value> values() const;

 private:
  std::vector<Value> kept_;
  Value last_;
  std::size_t seen_ = 0;
  std::size_t stride_ = 1;
};

}  // namespace gonio::monitor
