#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/files/atomic_file.h"

namespace gonio::brdf {

/// What an isotropic RGL material (`.bsdf`) holds, in SI.
///
/// The file tabulates f cos theta_o over directions that are warped so that every cell matters
/// about equally. With theta_m, phi_m the half vector's angles and phi counted from the light's
/// azimuth, u = (sqrt(theta / 90 deg), (phi + 180 deg) / 360 deg):
///     f cos theta_o = rgb(W(u_m; theta_i); theta_i) ndf(u_m) / (4 sigma(u_i)),
/// where W makes vndf(.; theta_i) uniform. All tables are bilinear, between values of theta_i
/// linear. Without `jacobian` the factor ndf / (4 sigma) is left out.
///
/// Grids    Row-major, rows along u_y (azimuth), columns along u_x (polar angle).
/// Source   Dupuy and Jakob, ACM TOG 37(6), 2018, section 5; the layout is that of the database's
///          files.
struct RglTables {
  struct Grid {
    std::size_t height = 0;
    std::size_t width = 0;
    std::vector<float> values;  ///< [slice][channel] height x width
  };

  std::string description;
  std::vector<float> theta_i_rad;  ///< ascending in [0, pi/2], at least 2
  Grid ndf;                        ///< one slice; >= 0
  Grid sigma;                      ///< one slice; > 0
  Grid vndf;                       ///< a slice per theta_i; >= 0
  Grid rgb;                        ///< per theta_i three planes; may be negative by noise
  bool jacobian = true;
};

/// An RGL material as a BRDF in 1/sr.
class RglBrdf final : public BrdfModel {
 public:
  /// Throws std::invalid_argument ("vndf: ...") when the tables do not fit together or hold what
  /// they must not.
  explicit RglBrdf(RglTables tables);
  ~RglBrdf() override;

  /// f as the file has it for light from wi: not reciprocal, and noisy where theta_o is near 90
  /// deg, because what was measured there is f cos theta_o. Not below 0.
  Rgb one_way(const DirectionPair& pair) const;

  /// The reciprocal estimate from both ways round, sum of f cos theta_o over sum of cosines: each
  /// way counts by the light that was there to measure, and none is divided by a cosine near 0
  /// alone.
  using BrdfModel::evaluate;
  Rgb evaluate(const DirectionPair& pair) const override;

 private:
  Rgb f_cos(const DirectionPair& pair) const;

  struct Prepared;
  std::unique_ptr<const Prepared> prepared_;
};

/// Reads an isotropic RGB file of the EPFL RGL database, or one of write_rgl().
///
/// Throws   FileError when it cannot be opened or read. DataFormatError (path, byte or field,
///          found, expected): no tensor file, a broken head, fields that overlap or leave the file,
///          a missing or wrongly shaped field, an anisotropic or spectral material, numbers that
///          are not finite, angles that do not ascend, a negative density.
RglTables read_rgl(const std::filesystem::path& path);

/// Any isotropic BRDF, in SI, as an RGL material: grids fine enough for a measured lattice (a polar
/// node at every bin centre of theta_h, 64 x 64 warped directions for a light every 3 deg).
///
/// The ndf is what the material's own lobe looks like, azimuths and theta_d averaged; half of the
/// warped grid follows it and half is spread evenly, so that tails are kept as well.
/// Throws   NumericalError where the model is not finite.
RglTables rgl_tables(const BrdfModel& model, std::string description);

/// Writes tables as a `.bsdf` file that Mitsuba 3 and pbrt-v4 read as a measured material: besides
/// the fields of read_rgl() a sampling density (`luminance`) and smooth `spectra` at 400 to 700 nm
/// that have the colours of `rgb` under D65. Same tables, same bytes.
///
/// Throws   std::invalid_argument as RglBrdf(); FileError when the file exists (Overwrite::No) or
///          cannot be written.
void write_rgl(const std::filesystem::path& path, const RglTables& tables,
               files::Overwrite overwrite = files::Overwrite::No);

}  // namespace gonio::brdf
