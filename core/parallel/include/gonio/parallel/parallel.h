#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

/// Parallel loops whose result does not depend on the number of threads.
///
/// Work is cut into blocks whose limits depend only on the arguments; threads take blocks in
/// order, and sums are combined in block order. So the same call gives the same bytes with one
/// thread and with many, which is what lets a session be reproduced on another machine.
///
/// Built on std::jthread and not on OpenMP or TBB: their runtimes are not instrumented, so the
/// thread sanitizer reports races that are none and misses ones that are; and a reduction in a
/// fixed order is not something OpenMP promises.
///
/// Threads  All functions may be called from any thread. A loop started inside another loop's
///          body runs on the calling thread alone, and so does one started while another thread's
///          loop has the workers: slower, never a deadlock, and the same bytes.
namespace gonio::parallel {

/// Sets how many threads take part in a loop, the calling one included. 0 means one per processor
/// the process may use, which is also the default. Waits for a running loop to end.
/// Throws std::logic_error when called inside a loop's body.
void set_thread_count(unsigned count);

/// How many threads take part in a loop; at least 1.
unsigned thread_count() noexcept;

namespace detail {

/// Calls body(0) .. body(count - 1), handed out in ascending order. If calls throw, no more are
/// handed out and the exception of the lowest index is rethrown: always the same one, since all
/// lower indices had been handed out before.
void run(std::size_t count, const std::function<void(std::size_t)>& body);

inline std::size_t block_count(std::size_t begin, std::size_t end, std::size_t block) {
  if (block == 0) throw std::invalid_argument("parallel: a block must hold at least one item");
  if (end <= begin) return 0;
  return (end - begin - 1) / block + 1;
}

}  // namespace detail

/// Calls body(block_begin, block_end) for every block of [begin, end). All blocks have `block`
/// items but the last, which may have fewer. Returns when all have ended.
///
/// Errors   Rethrows what the first block (in order) to fail has thrown; later blocks may or may
///          not have run.
template <typename Body>
void for_each_block(std::size_t begin, std::size_t end, std::size_t block, Body&& body) {
  detail::run(detail::block_count(begin, end, block), [&](std::size_t index) {
    const std::size_t from = begin + index * block;
    body(from, from + std::min(block, end - from));
  });
}

/// Folds all blocks of [begin, end) into one value, in block order:
/// combine(total, map(block_begin, block_end)) for the first block, then the second, ...
///
/// `total`    The start value; returned when the range is empty.
/// `map`      Runs on many threads at once.
/// `combine`  void(Value& total, Value&& part); never runs twice at once.
///
/// Memory   A part is combined as soon as all earlier ones are, so about one part per thread is
///          alive; more only while one block takes much longer than the rest.
template <typename Value, typename Map, typename Combine>
Value reduce_blocks(std::size_t begin, std::size_t end, std::size_t block, Value total, Map&& map,
                    Combine&& combine) {
  const std::size_t count = detail::block_count(begin, end, block);
  std::vector<std::optional<Value>> parts(count);
  std::size_t next = 0;    // first block not yet combined
  bool combining = false;  // some thread is at it, and will also take what arrives meanwhile
  std::mutex mutex;        // guards the three above; `total` belongs to the combining thread

  detail::run(count, [&](std::size_t index) {
    const std::size_t from = begin + index * block;
    Value part = map(from, from + std::min(block, end - from));

    std::unique_lock lock(mutex);
    parts[index].emplace(std::move(part));
    if (combining) return;
    combining = true;
    while (next < count && parts[next].has_value()) {
      Value ready = std::move(*parts[next]);
      parts[next].reset();
      ++next;
      lock.unlock();
      combine(total, std::move(ready));  // when it throws, `combining` stays set: nobody goes on
      lock.lock();
    }
    combining = false;
  });
  return total;
}

}  // namespace gonio::parallel
