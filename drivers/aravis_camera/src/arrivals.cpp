#include "arrivals.h"

#include <utility>

namespace gonio::aravis_camera {

void Arrivals::come_from(ArvStream* stream) {
  const std::scoped_lock lock(mutex_);
  stream_ = stream;
}

void Arrivals::forget() {
  const std::scoped_lock lock(mutex_);
  stream_ = nullptr;
  done_.clear();
}

std::optional<Arrival> Arrivals::wait_for(std::chrono::nanoseconds patience) {
  std::unique_lock lock(mutex_);
  const auto something = [this] { return !done_.empty() || control_lost_; };
  if (!changed_.wait_until(lock, std::chrono::steady_clock::now() + patience, something) ||
      done_.empty()) {
    return std::nullopt;
  }
  Arrival oldest = std::move(done_.front());
  done_.pop_front();
  return oldest;
}

void Arrivals::give_back(ArvBuffer* buffer) {
  ArvStream* stream = nullptr;
  {
    const std::scoped_lock lock(mutex_);
    stream = stream_;
  }
  arv_stream_push_buffer(stream, buffer);
}

bool Arrivals::control_lost() const {
  const std::scoped_lock lock(mutex_);
  return control_lost_;
}

void Arrivals::on_stream(void* self, ArvStreamCallbackType type, ArvBuffer* /*buffer*/) {
  // Here and not where the frame is taken: that may be late, and an old frame would seem a new one.
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  auto* const arrivals = static_cast<Arrivals*>(self);
  const std::scoped_lock lock(arrivals->mutex_);
  if (type != ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE || arrivals->stream_ == nullptr) return;
  if (ArvBuffer* const done = arv_stream_try_pop_buffer(arrivals->stream_)) {
    arrivals->done_.push_back({Handle<ArvBuffer>(done), now});
    arrivals->changed_.notify_one();
  }
}

void Arrivals::on_control_lost(ArvDevice* /*device*/, void* self) {
  auto* const arrivals = static_cast<Arrivals*>(self);
  const std::scoped_lock lock(arrivals->mutex_);
  arrivals->control_lost_ = true;
  arrivals->changed_.notify_one();
}

}  // namespace gonio::aravis_camera
