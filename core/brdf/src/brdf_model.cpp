#include "gonio/brdf/brdf_model.h"

#include <stdexcept>
#include <string>

namespace gonio::brdf {

std::string_view to_string(RadiometricScale scale) {
  return scale == RadiometricScale::si ? "si" : "merl";
}

RadiometricScale radiometric_scale_from_string(std::string_view name) {
  for (const auto scale : {RadiometricScale::si, RadiometricScale::merl}) {
    if (name == to_string(scale)) return scale;
  }
  throw std::invalid_argument("unknown radiometric scale \"" + std::string(name) +
                              "\", expected si or merl");
}

}  // namespace gonio::brdf
