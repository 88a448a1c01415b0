#pragma once

#include <memory>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// What lies where in the plane of a target.
///
/// Threads  const, may be shared.
class Scene {
 public:
  explicit Scene(const SceneOptions& options);

  /// What is seen at a point of the target's plane; null: nothing, the black background.
  const brdf::BrdfModel* material_at(double x_mm, double y_mm, devices::Target target) const;

  /// The polish of the target at a point, or null.
  const PolishedOptions* polish_at(double x_mm, double y_mm, devices::Target target) const;

 private:
  const brdf::BrdfModel* on_board(double x_mm, double y_mm) const;
  const brdf::BrdfModel* on_chart(double x_mm, double y_mm) const;

  SceneOptions options_;
  std::shared_ptr<const brdf::BrdfModel> white_tile_;
  std::shared_ptr<const brdf::BrdfModel> patch_;
  std::shared_ptr<const brdf::BrdfModel> holder_;
  std::shared_ptr<const brdf::BrdfModel> board_white_;
  std::shared_ptr<const brdf::BrdfModel> board_black_;
  std::shared_ptr<const brdf::BrdfModel> mirror_dust_;
  std::shared_ptr<const brdf::BrdfModel> glass_dust_;
  std::shared_ptr<const brdf::BrdfModel> trap_;
  std::vector<std::shared_ptr<const brdf::BrdfModel>> chart_;
};

}  // namespace gonio::sim
