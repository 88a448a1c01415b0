#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// What a place of a target's plane is made of.
struct Surface {
  std::shared_ptr<const brdf::BrdfModel> material;  ///< null: nothing, the black background
  std::optional<brdf::Rgb> per_sr;  ///< its BRDF where that is the same in all directions, 1/sr
  const PolishedOptions* polish = nullptr;  ///< null: does not reflect as a mirror does
};

/// What lies where in the plane of a target.
///
/// Threads  const, may be shared.
class Scene {
 public:
  explicit Scene(const SceneOptions& options);

  Scene(const Scene&) = delete;  // surfaces point into it
  Scene& operator=(const Scene&) = delete;

  /// All that can be seen of any target. The first is the background.
  const std::vector<Surface>& surfaces() const { return surfaces_; }

  /// Index in surfaces() of what is seen at a point of the target's plane.
  std::uint16_t surface_at(double x_mm, double y_mm, devices::Target target) const;

 private:
  using Index = std::uint16_t;
  static constexpr Index kBackground = 0;

  Index add(std::shared_ptr<const brdf::BrdfModel> material,
            const PolishedOptions* polish = nullptr);
  Index on_board(double x_mm, double y_mm) const;
  Index on_chart(double x_mm, double y_mm) const;

  SceneOptions options_;
  std::vector<Surface> surfaces_;
  Index sample_;
  Index white_tile_;
  Index patch_;
  Index holder_;
  Index board_white_;
  Index board_black_;
  Index mirror_;
  Index glass_;
  Index trap_;
  Index chart_;  ///< the first patch; the others follow
};

}  // namespace gonio::sim
