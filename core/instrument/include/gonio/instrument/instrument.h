#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/instrument/camera_model.h"
#include "gonio/instrument/response_curve.h"
#include "gonio/rig/rig_description.h"

namespace gonio::instrument {

/// A pixel by its place in the frame, from 0.
struct PixelPlace {
  int column = 0;
  int row = 0;

  bool operator==(const PixelPlace&) const = default;
};

/// Noise model of a nearly linear sensor (EMVA 1288 terms) and what makes its values linear.
struct SensorModel {
  double gain_dn_per_e = 0.0;
  double read_noise_e = 0.0;
  double full_well_e = 0.0;
  double black_level_dn = 0.0;
  double saturation_dn = 0.0;  ///< a pixel at or above it carries no value
  double dark_current_e_per_s = 0.0;
  double prnu = 0.0;              ///< relative sd of the pixels' responsivity
  ResponseCurve response = {};    ///< straight unless found otherwise
  double shutter_offset_s = 0.0;  ///< light falls for this much longer than an exposure says
  std::vector<PixelPlace> bad_pixels = {};  ///< that carry no value, in any order
};

/// Relative responsivity over the image, 1 at the principal point: V = 1 + v1 q + v2 q^2 + v3 q^3,
/// q = ((u - cx)/fx)^2 + ((v - cy)/fy)^2. By field angle, so that a window of the sensor keeps its
/// falloff.
struct Vignetting {
  double v1 = 0.0;
  double v2 = 0.0;
  double v3 = 0.0;
};

/// Radiant intensity over the lamp's field, 1 on its axis: 1 + c10 x + c01 y + c20 x^2 + c11 x y +
/// c02 y^2 with x, y the tangents of the angle from the lamp's z axis about its own x and y.
struct LampField {
  double c10 = 0.0;
  double c01 = 0.0;
  double c20 = 0.0;
  double c11 = 0.0;
  double c02 = 0.0;
};

/// Light that reaches every pixel by other ways than the sample, in proportion to the lamp's.
struct StrayLight {
  double fraction = 0.0;    ///< of a perfect white lit along its normal at the rig's centre
  double u_fraction = 0.0;  ///< standard uncertainty, also of what changes from pose to pose
};

/// D of a white reference at the nodes of a grid of directions.
struct AngularTable {
  std::vector<double> theta_i_deg;    ///< ascending, 0 .. 90
  std::vector<double> theta_o_deg;    ///< ascending, 0 .. 90; a single one: not looked at
  std::vector<double> delta_phi_deg;  ///< between light and detector, ascending, 0 .. 180; the same
  std::vector<double> factor;         ///< [theta_i][theta_o][delta_phi], above 0

  bool empty() const { return factor.empty(); }

  /// Of a certificate that knows the angle of incidence only.
  static AngularTable of_incidence(std::vector<double> theta_i_deg, std::vector<double> factor);
};

/// The white reference: f_w = R / pi * D(theta_i, theta_o, delta_phi), D from the certificate's
/// table.
struct WhiteReference {
  std::string id;
  brdf::Rgb reflectance = brdf::Rgb::Ones();
  AngularTable angular;     ///< empty: D = 1 everywhere
  double u_relative = 0.0;  ///< standard uncertainty of f_w
};

/// The calibrated instrument as plain data: all that turns raw frames into BRDF values. Kept in a
/// file in the calibration-archive format (calibration_file.h).
struct Instrument {
  std::string id;  ///< who and when; free text, no newline
  rig::RigDescription rig;
  CameraModel camera;
  SensorModel sensor;
  Vignetting vignetting;
  LampField lamp_field;
  StrayLight stray;
  WhiteReference white;
  Angle u_normal;                     ///< sd per tangential axis of the sample normal's direction
  Angle u_lamp_direction;             ///< sd of where the lamp stands, per axis across the light
  Angle u_joint;                      ///< sd of where an axis comes to stand about its reading
  double u_lamp_relative = 0.0;       ///< lamp field and monitor, per pose
  double u_linearity_relative = 0.0;  ///< what the response curve leaves

  /// Throws std::invalid_argument naming the field and its value.
  void validate() const;
};

/// Not 0 where a pixel carries no value, row-major. Throws std::invalid_argument for a bad pixel
/// outside the frame.
std::vector<std::uint8_t> bad_pixel_mask(const SensorModel& sensor, int width_px, int height_px);

/// Response of a pixel relative to the principal point.
double relative_response(const Instrument& instrument, double column, double row);

/// Relative intensity of the lamp towards `direction_in_lamp` (lamp frame, z along the axis).
double relative_intensity(const LampField& field, const Eigen::Vector3d& direction_in_lamp);

/// BRDF of the white reference in 1/sr. `directions` are above its plane. D is linear in each of
/// the three angles between the nodes and constant beyond the outermost. With light or detector on
/// the normal delta_phi has no meaning and counts as 0: a table has the same value for all there.
brdf::Rgb white_brdf(const WhiteReference& white, const brdf::DirectionPair& directions);

}  // namespace gonio::instrument
