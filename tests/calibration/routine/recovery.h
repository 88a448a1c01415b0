#pragma once

#include <string>
#include <vector>

#include "gonio/calibration/routine/routine.h"
#include "gonio/sim/sim_options.h"

namespace gonio::calibration::routine::test {

/// One quantity of a calibration against the hidden truth.
struct Recovered {
  std::string name;
  std::string unit;
  double error = 0.0;  ///< found minus true; of a direction: the angle between
  double sigma = 0.0;  ///< as the calibration says, of one component; 0: it says none
  int components = 1;  ///< of a direction: two
  double limit = 0.0;  ///< of |error|
};

/// Where the axes really stand when they say `readings`, approached from below.
rig::Joints true_joints(const sim::SimOptions& truth, const rig::Joints& readings);

/// All that the specification sets a limit for (rig_and_calibration, 3.8). `angles` is what the
/// limits of angles are multiplied by: a quarter of the pixels see a quarter of the angle.
std::vector<Recovered> recovered(const Routine& routine, const sim::SimOptions& truth,
                                 double angles);

}  // namespace gonio::calibration::routine::test
