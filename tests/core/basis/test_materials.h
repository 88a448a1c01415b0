#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/basis/training_set.h"
#include "gonio/brdf/brdf_model.h"
#include "gonio/samples/samples.h"

namespace gonio::basis::test {

/// A diffuse part plus a Gaussian lobe in theta_h that grows towards grazing theta_d: smooth, cheap
/// and different enough to span a basis.
class Lobe final : public brdf::BrdfModel {
 public:
  Lobe(const brdf::Rgb& diffuse, const brdf::Rgb& specular, double width)
      : diffuse_(diffuse), specular_(specular), width_(width) {}

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry& geometry) const override;

  brdf::Rgb diffuse_;
  brdf::Rgb specular_;
  double width_;
};

/// Number `index` of an endless, fixed sequence of lobes.
Lobe material(int index);

constexpr int kMaterials = 6;

/// Two routes through double precision; the small systems have condition numbers up to 1e6.
inline constexpr double kRouteTolerance = 1e-7;
/// Of a Gram and its squares of singular values, against the largest: products of float32 numbers,
/// summed in float32 512 at a time and in double from there.
inline constexpr double kGramTolerance = 1e-6;

/// The first kMaterials of them in SI, made once, and the Gram of their rows.
const TrainingSet& training_set();
const Eigen::MatrixXd& training_gram();
/// The basis of all of them with all components.
const Basis& full_basis();

/// The bin centre of a lattice cell, where interpolated rows are the stored ones.
brdf::HalfDiff bin_centre(int theta_h, int theta_d, int phi_d);

/// Six directions spread over what a rig reaches.
const std::vector<brdf::HalfDiff>& six_directions();

/// Noise-free samples of a model.
samples::SampleSet sample(const brdf::BrdfModel& model,
                          const std::vector<brdf::HalfDiff>& directions);

/// Three materials of training_set(), three components.
Basis small_basis();

/// What read_basis() says of a file it finds fault with; "accepted" when there is none.
std::string refusal(const std::filesystem::path& path);

}  // namespace gonio::basis::test
