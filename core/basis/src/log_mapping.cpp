#include "gonio/basis/log_mapping.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gonio::basis {

double LogMapping::weight(const brdf::PolarCosines& cosines) const {
  return std::clamp(cosines.cos_theta_i * cosines.cos_theta_o, cosine_floor, 1.0);
}

double LogMapping::forward(double f_per_sr, double weight) const {
  const double argument = f_per_sr * weight + epsilon;
  return argument > 0.0 ? std::log(argument) : std::numeric_limits<double>::quiet_NaN();
}

double LogMapping::inverse(double x, double weight) const {
  return std::max((std::exp(x) - epsilon) / weight, 0.0);
}

double LogMapping::derivative(double f_per_sr, double weight) const {
  return weight / (f_per_sr * weight + epsilon);
}

}  // namespace gonio::basis
