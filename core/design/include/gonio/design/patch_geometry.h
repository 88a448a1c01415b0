#pragma once

#include <vector>

#include "gonio/brdf/directions.h"

namespace gonio::design {

/// The part of the sample one frame shows. Camera and lamp stand at finite distance, so across it
/// the directions vary: a frame is a patch of directions, cut into grid x grid equal squares that
/// are sampled at their centres.
struct PatchGeometry {
  double half_width_mm = 0.0;  ///< 0: one point per pose
  int grid = 3;
  double camera_distance_mm = 350.0;
  double lamp_distance_mm = 500.0;

  /// A patch cut into squares of at most 10 mm, 3 x 3 to 7 x 7 of them: one lies in the middle.
  /// Beyond +-35 mm the 7 x 7 are larger. Five by five instead of three by three over +-25 mm are
  /// worth 0.15 dB (ten poses, 90 held-out materials: docs/results.md). Distances as above.
  static PatchGeometry of_half_width(double half_width_mm);

  /// Three by three squares whose outermost have the same centres: poses are chosen for these, at a
  /// third of the time and memory.
  PatchGeometry coarse() const;

  bool is_point() const { return half_width_mm == 0.0; }
  /// Of a frame.
  int sub_samples() const { return is_point() ? 1 : grid * grid; }

  /// Throws std::invalid_argument: a width that is negative or not finite, a grid outside 1 to 99,
  /// a patch without positive distances.
  void validate() const;
};

/// Directions of the sub-samples of a pose whose centre sees `centre` (phi_h is ignored), row by
/// row: the number in the list is the sub-sample's spot. All are above the horizon when the centre
/// is: camera and lamp stand above the sample's plane.
///
/// Frame    Sample frame with the half vector of the centre in the x-z plane; the squares lie along
///          x and y. Camera and lamp at their distances from the centre, along its wo and wi.
std::vector<brdf::DirectionPair> patch_pairs(const brdf::HalfDiff& centre,
                                             const PatchGeometry& patch);

/// Their directions as half/difference angles, phi_h = 0.
std::vector<brdf::HalfDiff> patch_directions(const brdf::HalfDiff& centre,
                                             const PatchGeometry& patch);

}  // namespace gonio::design
