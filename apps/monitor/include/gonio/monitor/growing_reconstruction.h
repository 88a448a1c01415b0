#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "gonio/acquisition/reduction.h"
#include "gonio/basis/basis.h"
#include "gonio/instrument/instrument.h"

namespace gonio::monitor {

/// The material as far as it has been measured, as a picture of a sphere: made anew from the
/// archive as points come in, while somebody looks.
///
/// Cost     One thread of the lowest priority (nice 19), never for more than a fifth of the time;
///          nothing while nobody looks. When it ends, it waits for the picture under way.
/// Threads  All members may be called from any.
/// Errors   Become Picture::message; the session does not notice.
class GrowingReconstruction {
 public:
  struct Source {
    std::filesystem::path archive;
    instrument::Instrument instrument;
    acquisition::ReductionOptions reduction;
    brdf::RadiometricScale scale = brdf::RadiometricScale::si;  ///< the basis' as well
    std::shared_ptr<const basis::Basis> basis;
  };
  struct Picture {
    std::string png;           ///< empty: there is none yet
    std::uint64_t number = 0;  ///< counts up with every picture
    int points = 0;            ///< that it was made of
    std::string message;       ///< why there is none, or none newer; may be empty
  };

  explicit GrowingReconstruction(Source source);
  ~GrowingReconstruction();
  GrowingReconstruction(const GrowingReconstruction&) = delete;
  GrowingReconstruction& operator=(const GrowingReconstruction&) = delete;

  /// The newest; asks for a newer one when fewer points went into it than `points_measured`.
  std::shared_ptr<const Picture> picture(int points_measured);

 private:
  void work(const std::stop_token& stop);
  Picture make(int points) const;

  const Source source_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::shared_ptr<const Picture> newest_ = std::make_shared<const Picture>();
  int wanted_points_ = 0;
  int tried_points_ = 0;
  std::jthread thread_;  ///< last: joined before what it uses is gone
};

}  // namespace gonio::monitor
