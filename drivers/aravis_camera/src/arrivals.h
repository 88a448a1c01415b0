#pragma once

#include <arv.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>

namespace gonio::aravis_camera {

struct Unref {
  void operator()(void* object) const noexcept { g_object_unref(object); }
};
template <typename Object>
using Handle = std::unique_ptr<Object, Unref>;

/// A buffer that is done, well or not.
struct Arrival {
  Handle<ArvBuffer> buffer;
  std::chrono::nanoseconds at{0};  ///< host's steady clock since its epoch
};

/// What Aravis' threads tell: buffers that are done, at most as many as the stream was given, and
/// the loss of control.
///
/// The library's own queue would do; its locks are not seen by thread sanitizers, these are.
class Arrivals {
 public:
  /// Before the acquisition starts.
  void come_from(ArvStream* stream);
  /// Before the stream goes.
  void forget();

  /// The oldest buffer, or none after `patience` or when control was lost.
  std::optional<Arrival> wait_for(std::chrono::nanoseconds patience);
  void give_back(ArvBuffer* buffer);
  bool control_lost() const;

  /// For Aravis, which calls them in threads of its own with the object as `self`.
  static void on_stream(void* self, ArvStreamCallbackType type, ArvBuffer* buffer);
  static void on_control_lost(ArvDevice* device, void* self);

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  ArvStream* stream_ = nullptr;
  std::deque<Arrival> done_;
  bool control_lost_ = false;
};

}  // namespace gonio::aravis_camera
