#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "command.h"
#include "gonio/basis/basis.h"
#include "gonio/design/near_field.h"

namespace gonio::cli {

/// How near-field shots are taken, as options say it.
struct NearFieldWords {
  double fov_deg = 25.0;
  double camera_mm = 350.0;
  double lamp_mm = 0.0;    ///< 0: a directional lamp
  double sample_mm = 0.0;  ///< half width; 0: no edge in sight
};
design::NearFieldSetup near_field_setup(const NearFieldWords& words);

/// --fov, --camera-mm, --lamp-mm, --sample-mm
void add_near_field_options(const Command& command, NearFieldWords& words);

/// Throws UsageError for the first of these that was given: they go with the option `asked_by`
/// only.
void refuse_near_field_options(const NearFieldWords& words, const std::string& asked_by);

/// Chooses shots and shows the progress. A stop ends the search with the best so far.
std::vector<brdf::HalfDiff> choose_shots(const Console& console, const basis::Basis& basis,
                                         const Eigen::MatrixXd& importance,
                                         const design::NearFieldSetup& setup,
                                         const design::NearFieldOptions& options,
                                         const std::stop_token& stop);

/// How large the sample must be for these shots: usable share of the pixels and expected error
/// against its half width.
///
/// `noise`  Its independent part is of a pixel.
std::string near_field_text(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                            const std::vector<brdf::HalfDiff>& shots,
                            const design::NearFieldSetup& setup, const design::PoseNoise& noise);

}  // namespace gonio::cli
