#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/brdf/brdf_model.h"

namespace gonio::brdf {

/// A material that needs no download: an analytic model with sourced constants, in SI.
struct BuiltinMaterial {
  std::string name;         ///< lower case with dashes, unique
  std::string family;       ///< paint, plastic, metal, fabric, wood, metallic-paint, ...
  std::string description;  ///< one line
  std::string source;       ///< where the constants come from
  std::shared_ptr<const BrdfModel> model;
};

/// All of them, in a fixed order, families together. Built at the first call.
const std::vector<BuiltinMaterial>& builtin_materials();

/// The families in the order of builtin_materials(), each once.
std::vector<std::string> families();

/// Throws std::invalid_argument naming the nearest name.
const BuiltinMaterial& builtin_material(std::string_view name);

}  // namespace gonio::brdf
