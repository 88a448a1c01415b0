#include "evaluated_again.h"

#include <algorithm>
#include <cmath>

namespace gonio::calibration::routine {
namespace {

constexpr double kOfSigma = 1e-3;
constexpr double kOfValue = 1e-6;

bool near(double one, double other, double sigma) {
  return std::abs(one - other) <=
         std::max(kOfSigma * sigma, kOfValue * std::max(std::abs(one), std::abs(other)));
}

bool same_parameters(const instrument::StepResult& one, const instrument::StepResult& other) {
  if (one.parameters.size() != other.parameters.size()) return false;
  const auto sigma = [&](Eigen::Index i) { return std::sqrt(one.covariance(i, i)); };
  for (std::size_t k = 0; k < one.parameters.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    if (one.parameters[k].name != other.parameters[k].name ||
        one.parameters[k].unit != other.parameters[k].unit ||
        !near(one.parameters[k].value, other.parameters[k].value, sigma(i))) {
      return false;
    }
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double scale = sigma(i) * sigma(j);
      if (!near(one.covariance(i, j), other.covariance(i, j), scale)) return false;
    }
  }
  return true;
}

}  // namespace

void take_over_taking(const instrument::StepResult& from, instrument::StepResult& to) {
  to.finished = from.finished;
  to.valid_until = from.valid_until;
  to.temperature_deg_c = from.temperature_deg_c;
  to.inputs = from.inputs;
  to.told = from.told;
  to.raw_data = from.raw_data;
  // What the devices told when it was taken is among the old ones.
  for (const std::string& note : from.notes) {
    if (std::find(to.notes.begin(), to.notes.end(), note) == to.notes.end()) {
      to.notes.push_back(note);
    }
  }
}

bool same_numbers(const instrument::StepResult& one, const instrument::StepResult& other) {
  const auto same_residual = [](const auto& a, const auto& b) {
    return a.first == b.first && near(a.second, b.second, std::abs(b.second));
  };
  const auto same_check = [](const auto& a, const auto& b) {
    return a.name == b.name && a.limit == b.limit && near(a.found, b.found, b.limit);
  };
  return same_parameters(one, other) &&
         std::equal(one.residuals.begin(), one.residuals.end(), other.residuals.begin(),
                    other.residuals.end(), same_residual) &&
         std::equal(one.checks.begin(), one.checks.end(), other.checks.begin(), other.checks.end(),
                    same_check);
}

}  // namespace gonio::calibration::routine
