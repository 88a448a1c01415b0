#include "gonio/parallel/parallel.h"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <limits>
#include <stop_token>
#include <thread>

namespace gonio::parallel {
namespace {

/// True on a thread that is inside a loop's body.
thread_local bool inside_loop = false;

class InsideLoop {
 public:
  InsideLoop() { inside_loop = true; }
  ~InsideLoop() { inside_loop = before_; }
  InsideLoop(const InsideLoop&) = delete;
  InsideLoop& operator=(const InsideLoop&) = delete;

 private:
  const bool before_ = inside_loop;
};

/// One loop: the next index to hand out and the first failure.
class Job {
 public:
  Job(std::size_t count, const std::function<void(std::size_t)>& body)
      : count_(count), body_(body) {}

  void work() noexcept {
    const InsideLoop marked;
    while (!failed_.load(std::memory_order_relaxed)) {
      const std::size_t index = next_.fetch_add(1, std::memory_order_relaxed);
      if (index >= count_) break;
      try {
        body_(index);
      } catch (...) {
        note_failure(index, std::current_exception());
      }
    }
  }

  /// To be called when all threads have left work().
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void note_failure(std::size_t index, std::exception_ptr failure) {
    const std::lock_guard lock(mutex_);
    failed_.store(true, std::memory_order_relaxed);
    if (index >= failed_index_) return;
    failed_index_ = index;
    failure_ = std::move(failure);
  }

  const std::size_t count_;
  const std::function<void(std::size_t)>& body_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> failed_ = false;
  std::mutex mutex_;
  std::size_t failed_index_ = std::numeric_limits<std::size_t>::max();
  std::exception_ptr failure_;
};

/// Threads that sleep between loops: a loop of some microseconds must not pay for starting them.
class Workers {
 public:
  explicit Workers(unsigned count) {
    threads_.reserve(count);
    for (unsigned i = 0; i < count; ++i) {
      threads_.emplace_back([this](const std::stop_token& stop) { serve(stop); });
    }
  }

  void run(Job& job) {
    {
      const std::lock_guard lock(mutex_);
      job_ = &job;
      ++round_;
      busy_ = threads_.size();
    }
    wake_.notify_all();
    job.work();
    std::unique_lock lock(mutex_);
    idle_.wait(lock, [&] { return busy_ == 0; });
    job_ = nullptr;
  }

 private:
  void serve(const std::stop_token& stop) {
    std::uint64_t served = 0;
    std::unique_lock lock(mutex_);
    while (wake_.wait(lock, stop, [&] { return round_ != served; })) {
      served = round_;
      Job& job = *job_;
      lock.unlock();
      job.work();
      lock.lock();
      if (--busy_ == 0) idle_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::condition_variable idle_;
  Job* job_ = nullptr;
  std::uint64_t round_ = 0;            // counts the jobs, so that no worker serves one twice
  std::size_t busy_ = 0;               // workers that have not finished the current job
  std::vector<std::jthread> threads_;  // last: joined before what they use is gone
};

unsigned processors() noexcept { return std::max(1U, std::thread::hardware_concurrency()); }

/// The workers, and who may use them.
struct Pool {
  std::mutex in_use;  // held for the whole of a loop and while the workers are replaced
  std::optional<Workers> workers;  // started by the first loop that can use them
  std::atomic<unsigned> thread_count = processors();
};

Pool& pool() {
  static Pool instance;
  return instance;
}

}  // namespace

void set_thread_count(unsigned count) {
  if (inside_loop) {
    throw std::logic_error("parallel: the thread count cannot be set inside a parallel loop");
  }
  Pool& shared = pool();
  const std::lock_guard lock(shared.in_use);
  const unsigned wanted = count == 0 ? processors() : count;
  if (wanted == shared.thread_count) return;
  shared.workers.reset();
  shared.thread_count = wanted;
}

unsigned thread_count() noexcept { return pool().thread_count; }

namespace detail {

void run(std::size_t count, const std::function<void(std::size_t)>& body) {
  if (count == 0) return;
  if (!inside_loop && count > 1) {
    Pool& shared = pool();
    const std::unique_lock lock(shared.in_use, std::try_to_lock);
    if (lock.owns_lock() && shared.thread_count > 1) {
      Job job(count, body);
      if (!shared.workers) shared.workers.emplace(shared.thread_count - 1);
      shared.workers->run(job);
      job.rethrow();
      return;
    }
  }
  // On this thread alone, and in the plainest way: exceptions pass straight through.
  const InsideLoop marked;
  for (std::size_t index = 0; index < count; ++index) body(index);
}

}  // namespace detail
}  // namespace gonio::parallel
