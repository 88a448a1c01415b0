#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/sim/angular_white.h"
#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// Pixels of a hidden world's camera; the field of view is the same.
enum class HiddenImage {
  small,     ///< 612 x 512 px, f = 1381 px: for continuous integration
  full_size  ///< 2448 x 2048 px, f = 5525 px
};

/// What is written in the certificate of a hidden world's white tile, and true of it. A tile is one
/// object, the same in every world.
struct WhiteCertificate {
  brdf::Rgb reflectance;
  AngularFactor angular;    ///< reciprocal; 1 from 0 to 45 deg
  double u_relative = 0.0;  ///< standard uncertainty
};

WhiteCertificate hidden_white();

/// Linear R, G, B of the patches of a hidden world's colour chart: a row of greys, then three of
/// primary and mixed colours, paler from row to row. The same in every world.
std::vector<brdf::Rgb> hidden_chart();

/// A world to be calibrated: LA-2 with everything a calibration has to find somewhat off its
/// nominal value, each by a draw of its own from `seed`, uniform within
///
///   rig      axes 0.3 deg and 0.5 mm (each coordinate); camera 0.3 deg and 0.5 mm; lamp 0.3 deg,
///            500 +- 2 mm along and 0.5 mm across
///   axes     zeros +-0.5 deg, backlash 0.02 .. 0.08 deg; encoder step 0.001, homing and
///            positioning 0.002 deg
///   camera   f +-0.5 %, principal point +-8 px at 2448 px width, k1 -0.12 and k2 0.05 +-10 %, p1
///            and p2 +-4e-4; gain 0.39 DN/e- +-3 %, read noise 2.4 e-, full well 10,500 e-, DSNU
///            1.2 e-, PRNU 0.6 % +-5 % each, dark current 5 e-/s +-10 %; 15 +- 1 % darker in the
///            corner; PSF 0.6 +- 0.05 px; non-linearity 0.3 +- 0.05 %; shutter 3 +- 0.5 us late
///   lamp     just switched on: warm-up 1 % +-20 % within 10 min +-10 %, drift 0.1 % in 10 min;
///            colours +-10 %, 8 +- 0.8 % less light in a corner of the sample; stray light 0.05 %
///            of white +-10 %
///   mounts   sample +-0.3 deg about x and y, other targets +-0.05 deg; all +-0.02 mm
///
/// 0.02 % of the pixels are hot: a sensor of the default's 0.1 % has as many bad pixels as may be
/// left out, so that it passes or not by chance. White tile and patch are hidden_white(). Axes have
/// no eccentricity, for the description of a rig has no room for one and a calibration none to
/// find.
///
/// The board has no pattern: whoever mounts one says which.
///
/// Throws   std::invalid_argument without a material.
/// Source   The magnitudes are typical of machine-vision cameras and of stages that were aligned
///          with a spirit level; no instrument was measured.
SimOptions hidden_options(std::shared_ptr<const brdf::BrdfModel> material, std::uint64_t seed,
                          HiddenImage image = HiddenImage::small);

}  // namespace gonio::sim
