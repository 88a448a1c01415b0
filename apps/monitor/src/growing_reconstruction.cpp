#include "gonio/monitor/growing_reconstruction.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <exception>

#include "gonio/acquisition/session_archive.h"
#include "gonio/basis/dense_field.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/brdf/brdf_table.h"
#include "gonio/parallel/parallel.h"
#include "gonio/render/png.h"
#include "gonio/render/sphere_picture.h"

namespace gonio::monitor {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kSphereSize_px = 256;
constexpr int kNicest = 19;
constexpr int kRestFactor = 4;  // rests so many times as long as it has worked

}  // namespace

GrowingReconstruction::GrowingReconstruction(Source source)
    : source_(std::move(source)), thread_([this](const std::stop_token& stop) { work(stop); }) {}

GrowingReconstruction::~GrowingReconstruction() = default;

std::shared_ptr<const GrowingReconstruction::Picture> GrowingReconstruction::picture(
    int points_measured) {
  const std::lock_guard lock(mutex_);
  if (points_measured > wanted_points_) {
    wanted_points_ = points_measured;
    wake_.notify_all();
  }
  return newest_;
}

void GrowingReconstruction::work(const std::stop_token& stop) {
  // What the session leaves over. On Linux a priority set by a thread's number is that thread's
  // only.
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNicest);
  std::unique_lock lock(mutex_);
  while (wake_.wait(lock, stop, [&] { return wanted_points_ > tried_points_; })) {
    const int points = wanted_points_;
    const std::uint64_t number = newest_->number;
    lock.unlock();
    const Clock::time_point begin = Clock::now();
    auto made = std::make_shared<Picture>(make(points));
    const Clock::duration rest = kRestFactor * (Clock::now() - begin);
    lock.lock();
    tried_points_ = points;
    if (made->png.empty()) {  // the older picture stays
      made->png = newest_->png;
      made->points = newest_->points;
      made->number = number;
    } else {
      made->number = number + 1;
    }
    newest_ = std::move(made);
    wake_.wait_for(lock, stop, rest, [] { return false; });
  }
}

GrowingReconstruction::Picture GrowingReconstruction::make(int points) const {
  Picture picture;
  picture.points = points;
  try {
    // Within a loop of one step, loops run on this thread alone: the shared workers are the
    // session's.
    parallel::for_each_block(0, 1, 1, [&](std::size_t, std::size_t) {
      const acquisition::SessionReader archive(source_.archive);
      acquisition::Reduction reduced =
          acquisition::reduce(archive, source_.instrument, source_.reduction);
      reduced.samples.scale = source_.scale;
      const basis::Fit fit = basis::fit(*source_.basis, reduced.samples, {});
      const brdf::TableBrdf model(basis::expand(*source_.basis, fit.coefficients));
      constexpr auto kLighting = render::PictureLighting::studio;
      const render::SpherePicture sphere = render::render_sphere(model, kLighting, kSphereSize_px);
      const double exposure = render::picture_exposure(sphere, kLighting, reduced.samples.scale);
      const std::vector<std::byte> png = render::encode_png(render::develop(sphere, exposure));
      picture.png.assign(reinterpret_cast<const char*>(png.data()), png.size());
    });
  } catch (const std::exception& error) {
    picture.message = error.what();
  }
  return picture;
}

}  // namespace gonio::monitor
