#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/devices/frame.h"
#include "gonio/devices/target_changer.h"
#include "gonio/rig/rig_description.h"
#include "gonio/units/angle.h"

/// The hidden truth of a simulated rig, as plain data. Nothing that measures may read it; programs
/// read it to set a world up and to compare a result with what was true.
///
/// Every validate() throws std::invalid_argument naming the field, what was found and what is
/// expected.
namespace gonio::sim {

/// What one axis really does, beside its entry in the rig description (limits, speed,
/// acceleration, settling time, home angle).
///
/// True joint angle = shaft + zero_offset + homing error + eccentricity, where the shaft follows
/// the motor with play and the encoder sits on the motor.
struct AxisOptions {
  Angle zero_offset;                                     ///< true angle when the axis says 0
  Angle backlash;                                        ///< full play; the shaft is centred +-b/2
  Angle encoder_step = Angle::from_degrees(0.001);       ///< 0: not quantised
  Angle homing_sigma = Angle::from_degrees(0.002);       ///< new at every homing, unseen
  Angle positioning_sigma = Angle::from_degrees(0.001);  ///< where a move ends, seen by the encoder
  Angle eccentricity_cos;                                ///< times cos(shaft)
  Angle eccentricity_sin;                                ///< times sin(shaft)
  double ring_fraction = 0.01;                           ///< of the way moved, after arrival
  Angle ring_limit = Angle::from_degrees(0.05);
  std::chrono::milliseconds ring_decay{40};  ///< to 1/e
  double ring_hz = 15.0;
  std::chrono::milliseconds index_search{2000};  ///< of homing, beside the way there
  /// Where the encoder says it stands when it is switched on; none: anywhere.
  std::optional<Angle> stands_at;
  /// From `slips_at` on (session clock) the shaft is off by this, unseen by the encoder, until the
  /// next homing: lost steps, or a coupling that slipped.
  Angle slip;
  std::chrono::nanoseconds slips_at{0};
  /// Whether homing tells where it stood (devices::HomingReport): not every drive can.
  bool tells_home_delta = true;

  void validate(const std::string& axis) const;
};

/// How a target really lies, against the rig's sample frame: turned about the sample's x, then
/// about its new y axis, then lifted along the normal.
struct MountOptions {
  Angle tilt_about_x;
  Angle tilt_about_y;
  double height_mm = 0.0;

  void validate(const std::string& target) const;
};

/// Sensor, lens and exposure.
///
/// Electrons of a pixel per second = responsivity * V * (1 + prnu) * radiance; see SimCamera.
struct CameraOptions {
  std::string model = "gonio-sim";
  std::string serial = "0";
  int width_px = 320;
  int height_px = 256;
  devices::PixelFormat pixel_format = devices::PixelFormat::mono;

  // Pinhole with the polynomial distortion of Brown (1971); pixel centres are whole numbers.
  double fx_px = 1381.0;
  double fy_px = 1381.0;
  double cx_px = 159.5;
  double cy_px = 127.5;
  double k1 = 0.0;
  double k2 = 0.0;
  double p1 = 0.0;
  double p2 = 0.0;

  double responsivity_e_per_s = 205000.0;  ///< per W m^-2 sr^-1
  double dn_per_electron = 0.39;
  double read_noise_e = 2.4;
  double full_well_e = 10500.0;
  double black_level_dn = 64.0;
  int bits = 12;

  double dark_current_e_per_s = 5.0;  ///< median over the pixels
  double dark_current_spread = 0.3;   ///< sigma of its logarithm over the pixels
  double hot_pixel_fraction = 0.001;
  double hot_pixel_factor = 100.0;  ///< their dark current against the median
  double prnu = 0.006;              ///< relative sigma of the response over the pixels
  double dsnu_e = 1.2;              ///< sigma of the offset over the pixels

  /// V = 1 + v1 q + v2 q^2 + v3 q^3, q = ((u - cx)/fx)^2 + ((v - cy)/fy)^2: by field angle, so that
  /// a window of the sensor keeps its falloff. The default is that of a plain lens (cos^4).
  std::array<double, 3> vignetting{-1.8, 0.0, 0.0};
  double psf_sigma_px = 0.0;  ///< 0: none
  /// How much more the camera takes of light polarised along a direction (in the image, from
  /// columns) than of light across it: (along - across) / (along + across).
  double polarisation = 0.0;
  Angle polarisation_direction;
  double nonlinearity = 0.0;                   ///< y (1 - nonlinearity (y / y_max)^2)
  std::chrono::nanoseconds shutter_offset{0};  ///< the light falls this much longer than reported

  /// Row: pixel colour (R, G, B); column: colour of the light. Used with a Bayer format.
  std::array<std::array<double, 3>, 3> bayer_crosstalk{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

  std::chrono::nanoseconds min_exposure = std::chrono::microseconds(50);
  std::chrono::nanoseconds max_exposure = std::chrono::seconds(10);
  std::chrono::nanoseconds exposure_step = std::chrono::microseconds(1);  ///< rounded to it
  std::chrono::nanoseconds readout = std::chrono::milliseconds(10);

  void validate() const;
};

/// One switchable colour of the lamp.
struct LampChannelOptions {
  std::string name;
  double wavelength_nm = 0.0;    ///< centre; 0 for white
  brdf::Rgb intensity_w_per_sr;  ///< along the lamp's axis, in the R, G and B band
};

/// Something that happens to the light. From `at` on it goes over to `factor` times what it was, in
/// a straight line that takes `over`, and stays there.
struct LampEvent {
  std::chrono::nanoseconds at{0};  ///< session clock
  std::chrono::nanoseconds over{0};
  double factor = 1.0;
  bool seen_by_monitor = true;  ///< false: something in the path beside the monitor's
};

/// The light of the room from a time on.
struct AmbientStep {
  std::chrono::nanoseconds at{0};  ///< session clock
  double radiance = 0.0;           ///< W m^-2 sr^-1 on every pixel
};

/// The lamp: E(x) = I field(u) g(t) cos(theta_i) / r^2.
struct LampOptions {
  std::vector<LampChannelOptions> channels = rgb_channels();

  /// field = 1 + c[0] x + c[1] y + c[2] x^2 + c[3] x y + c[4] y^2 with x, y the tangents of the
  /// angles from the lamp's axis; never below 0.
  std::array<double, 5> field{0.0, 0.0, -2.0, 0.0, -2.0};

  // g(t) = (1 - amplitude exp(-(t + on_before) / tau)) (1 + drift(t)), drift its own slow random
  // walk (Ornstein-Uhlenbeck) in every channel.
  double warm_up_amplitude = 0.02;
  std::chrono::seconds warm_up_tau{600};
  std::chrono::seconds on_before{3600};
  double drift_sigma = 0.002;
  std::chrono::seconds drift_tau{600};

  std::vector<LampEvent> events;

  double monitor_sigma = 0.0005;  ///< of one reading; g = 1 reads 1

  double radius_mm = 2.5;  ///< of the emitting disc, across its axis: seen in polished targets
  /// Share of the light that is linearly polarised, and its direction about the lamp's axis, from
  /// the lamp's x. Only polished targets keep it.
  double polarisation = 0.0;
  Angle polarisation_direction;

  /// Radiance of a perfect white at the rig's centre under normal incidence that reaches every
  /// pixel by other ways, as long as the lamp is lit.
  double stray_fraction = 0.0;

  static std::vector<LampChannelOptions> rgb_channels();   ///< R 630, G 530, B 465 nm; 1 W/sr each
  static std::vector<LampChannelOptions> white_channel();  ///< "white"; 1 W/sr in each band

  void validate() const;
};

/// A printed board: cells of two inks, row by row from the top left as it lies, so that y of the
/// target's plane points up in it. Nothing lies outside the cells but the board's own white.
struct BoardOptions {
  int columns = 0;
  int rows = 0;
  std::vector<bool> white;  ///< columns * rows
  double cell_mm = 1.0;
  double x_mm = 0.0;  ///< centre of the cells in the target's plane
  double y_mm = 0.0;
  double margin_mm = 5.0;  ///< of white around the cells
  double white_albedo = 0.85;
  double black_albedo = 0.04;

  void validate() const;
};

/// A polished plane that shows the lamp's image: R times the lamp's radiance, where the reflected
/// ray meets its disc.
struct PolishedOptions {
  double half_width_mm = 29.0;
  /// Of a mirror, at every angle; one behind a neutral filter has 0.002 and does not saturate at
  /// the shortest exposures.
  double reflectance = 0.002;
  double refractive_index = 1.52;  ///< of black glass, by Fresnel's equations
  double diffuse_albedo = 0.0005;  ///< dust and scattering
  /// Transmittance, for there and back, of a neutral filter before it that keeps the lamp's image
  /// below saturation; 1: none.
  double filter = 1.0;

  void validate(const std::string& target) const;
};

/// Rows of patches of one size, each Lambertian; row by row from the top left.
struct ColourChartOptions {
  int columns = 6;
  std::vector<brdf::Rgb> albedos;
  double patch_mm = 8.0;
  double gap_mm = 1.0;  ///< of black between patches

  void validate() const;
};

/// What lies in the sample plane. All of it is flat and in one plane, the mount's; squares are
/// parallel to the sample's axes. Where they overlap the first listed is seen: target, patch,
/// holder, and else the black background.
struct SceneOptions {
  std::shared_ptr<const brdf::BrdfModel>
      sample;  ///< must be set; 1/sr as SI unless it says otherwise
  double sample_half_width_mm = 27.0;

  std::shared_ptr<const brdf::BrdfModel> white_tile;  ///< the changer's other target; null: 99 %
  double white_tile_half_width_mm = 29.0;             ///< Lambertian

  BoardOptions board;
  PolishedOptions mirror;
  PolishedOptions black_glass;
  double black_trap_albedo = 0.0005;
  double black_trap_half_width_mm = 29.0;
  ColourChartOptions colour_chart;

  bool white_patch = true;                       ///< in the frame beside the target
  std::shared_ptr<const brdf::BrdfModel> patch;  ///< null: 99 % Lambertian
  double patch_x_mm = 34.0;
  double patch_y_mm = 0.0;
  double patch_half_width_mm = 4.0;

  double holder_half_width_mm = 60.0;
  double holder_albedo = 0.03;

  double ambient_radiance = 0.0;           ///< W m^-2 sr^-1 on every pixel, lamp or not
  std::vector<AmbientStep> ambient_steps;  ///< what it is later, in time

  void validate() const;
};

/// A whole world.
struct SimOptions {
  rig::RigDescription rig;        ///< the true one
  std::vector<AxisOptions> axes;  ///< one per axis of the rig; empty: all defaults
  MountOptions sample_mount;
  MountOptions white_mount;
  std::map<devices::Target, MountOptions> mounts;  ///< of other targets; none: flat
  CameraOptions camera;
  LampOptions lamp;
  SceneOptions scene;
  std::chrono::milliseconds change_time{20000};  ///< of the target changer
  std::uint64_t seed = 1;
  /// Of what differs from session to session on one rig: shot and read noise, monitor readings.
  /// None: the seed.
  std::optional<std::uint64_t> noise_seed;
  /// How often it was switched on before: where the axes then stand and what homing misses the mark
  /// by are new each time.
  std::uint64_t power_ups = 0;
  std::chrono::nanoseconds begins_at{0};  ///< its clock, when it is switched on
  /// What is done twice, as the opening and the closing white, has the same noise both times: for
  /// comparing a session with an uninterrupted one to the byte. See SimGoniometer::begin_subject().
  bool same_noise_again = false;
  std::optional<double> time_scale;  ///< real pace, see VirtualClock
  bool runs_by_itself = false;       ///< time passes without anybody waiting; needs a time scale

  void validate() const;
};

/// Root mean square of the two angles by which a sample's normal is off on the nominal rig.
inline constexpr double kNominalTiltDeg = 0.05;

/// The world of the demonstration: the rig exactly as described, LA-2 with the camera at 350 mm
/// and the lamp at 500 mm, everything a session can know about camera and lamp at its default, and
/// one thing it cannot: the sample's normal is off by two angles of kNominalTiltDeg rms, drawn from
/// `seed`. The 320 x 256 px window sees 0.25 mm per px; the white tile under normal incidence comes
/// to half saturation in 20 ms. Throws std::invalid_argument without a material.
SimOptions nominal_options(std::shared_ptr<const brdf::BrdfModel> material, std::uint64_t seed);

}  // namespace gonio::sim
