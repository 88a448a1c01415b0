#include "test_materials.h"

#include <unistd.h>

#include <cmath>
#include <random>

#include "directions_deg.h"
#include "gonio/basis/basis_file.h"
#include "gonio/errors/errors.h"

namespace gonio::basis::test {

brdf::Rgb Lobe::evaluate_visible(const brdf::ShadingGeometry& geometry) const {
  const double slope = geometry.sin_theta_h / width_;
  const double grazing = 1.0 - geometry.cos_theta_d;
  return diffuse_ + specular_ * (std::exp(-slope * slope) * (0.05 + grazing * grazing));
}

Lobe material(int index) {
  std::mt19937 engine(1000u + static_cast<unsigned>(index));  // its output is standardised
  const auto uniform = [&] { return static_cast<double>(engine()) / 4294967296.0; };
  const double diffuse = 0.3 * std::pow(10.0, -2.0 * uniform());
  const double specular = 5.0 * std::pow(10.0, 2.0 * uniform());
  const brdf::Rgb tint(0.3 + uniform(), 0.3 + uniform(), 0.3 + uniform());
  return Lobe(diffuse * tint, specular * brdf::Rgb(1.0, 0.95, 0.9), 0.05 + 0.3 * uniform());
}

const TrainingSet& training_set() {
  static const TrainingSet set = [] {
    TrainingSet made(brdf::RadiometricScale::si);
    for (int i = 0; i < kMaterials; ++i) {
      made.add({"lobe-" + std::to_string(i), i % 2 == 0 ? "even" : "odd", ""}, material(i));
    }
    return made;
  }();
  return set;
}

const Eigen::MatrixXd& training_gram() {
  static const Eigen::MatrixXd gram = centred_gram(training_set());
  return gram;
}

const Basis& full_basis() {
  static const Basis basis = train(training_set(), training_gram());
  return basis;
}

brdf::HalfDiff bin_centre(int theta_h, int theta_d, int phi_d) {
  return brdf::lattice::angles_of({theta_h, theta_d, phi_d});
}

samples::SampleSet sample(const brdf::BrdfModel& model,
                          const std::vector<brdf::HalfDiff>& directions) {
  samples::SampleSet set;
  for (const brdf::HalfDiff& direction : directions) {
    samples::Sample made;
    made.direction = direction;
    made.value_per_sr = model.evaluate(brdf::shading_geometry(direction));
    set.samples.push_back(made);
  }
  return set;
}

const std::vector<brdf::HalfDiff>& six_directions() {
  static const std::vector<brdf::HalfDiff> all = {
      half_diff_deg(3, 12, 28),  half_diff_deg(50, 19, 89), half_diff_deg(5, 70, 77),
      half_diff_deg(15, 4, 130), half_diff_deg(1, 6, 37),   half_diff_deg(0.3, 71, 104)};
  return all;
}

Basis small_basis() {
  return train(training_set(), training_gram(), std::vector<std::size_t>{0, 1, 3}, 3);
}

std::string refusal(const std::filesystem::path& path) {
  try {
    read_basis(path);
  } catch (const DataFormatError& error) {
    return error.what();
  } catch (const std::exception& error) {
    return std::string("another exception: ") + error.what();
  }
  return "accepted";
}

}  // namespace gonio::basis::test
