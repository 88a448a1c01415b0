#include "gonio/setup/rig_file.h"

#include <fmt/format.h>

#include <cmath>

#include "config_ranges.h"
#include "config_reader.h"
#include "config_writer.h"
#include "device_keys.h"
#include "gonio/errors/errors.h"
#include "gonio/files/text_file.h"
#include "keep_out_keys.h"
#include "toml_limits.h"

namespace gonio::cli {
namespace {

void visit_axis(ConfigVisitor& v, rig::Axis& axis) {
  v.angle("min_deg", axis.min, kAnyDegrees, "soft limits, inclusive");
  v.angle("max_deg", axis.max, kAnyDegrees, "");
  v.angle("home_deg", axis.home, kAnyDegrees, "where it stands after homing");
  v.number("max_speed_deg_per_s", axis.max_speed_deg_per_s, kPositive, "");
  v.number("acceleration_deg_per_s2", axis.acceleration_deg_per_s2, kPositive, "");
  v.duration("settle_ms", axis.settle, kMillisecond, {0.0, 6e5}, "waited after every move");
  v.angle("approach_overshoot_deg", axis.approach_overshoot, {0.0, 90.0},
          "falling moves go this far below the target first; 0: no");
}

void visit_chain(ConfigVisitor& v, const std::string& name, std::string_view comment,
                 rig::Chain& chain, const std::vector<std::string>& axis_names) {
  v.table(name, comment, [&] {
    Eigen::Vector3d origin = chain.home_pose.translation();
    Eigen::Vector3d z = chain.home_pose.linear().col(2);
    Eigen::Vector3d x = chain.home_pose.linear().col(0);
    v.numbers("origin_mm", {origin.data(), 3}, kMillimetres, "tip at joint angles 0, world frame");
    v.numbers("z_axis", {z.data(), 3}, {-1e3, 1e3}, "of the tip, world frame");
    v.numbers("x_axis", {x.data(), 3}, {-1e3, 1e3}, "at right angles to it");
    z.normalize();
    x.normalize();
    chain.home_pose.linear().col(0) = x;
    chain.home_pose.linear().col(1) = z.cross(x);
    chain.home_pose.linear().col(2) = z;
    chain.home_pose.translation() = origin;
    v.array(
        "link", "base to tip", chain.links.size(),
        [&](std::size_t count) {
          rig::ChainLink fresh;
          fresh.direction = Eigen::Vector3d::UnitZ();
          fresh.point_mm = Eigen::Vector3d::Zero();
          chain.links.assign(count, fresh);
        },
        [&](std::size_t i) {
          rig::ChainLink& link = chain.links[i];
          v.choice("axis", link.axis, axis_names, "");
          v.numbers("direction", {link.direction.data(), 3}, {-1e3, 1e3},
                    "of the screw, world frame at joint angles 0");
          v.numbers("point_mm", {link.point_mm.data(), 3}, kMillimetres, "on the axis");
          v.number("scale", link.scale, {-1e3, 1e3}, "-1: the stage counts the other way");
          v.angle("offset_deg", link.offset, kAnyDegrees, "");
          v.number("lead_mm_per_turn", link.lead_mm_per_turn, kMillimetres,
                   "not 0: a slide along `direction`");
        });
  });
}

std::vector<std::string> axis_names(const rig::RigDescription& rig) {
  std::vector<std::string> names;
  for (const rig::Axis& axis : rig.axes) names.push_back(axis.name);
  return names;
}

void visit_rig(ConfigVisitor& v, RigFile& file) {
  v.table("rig", "The goniometer", [&] {
    v.text("name", file.rig.name, "");
    v.enumeration("driver", file.driver, {"simulated", "hardware"},
                  "a world in this program, or the devices named below");
    const RigFile::Kind kind_before = file.kind;
    v.enumeration("type", file.kind, {"la2", "chains"},
                  "the reference rig, or any by its serial chains");
    if (file.kind == RigFile::Kind::la2) {
      v.number("camera_distance_mm", file.camera_distance_mm, {10.0, 1e5}, "from the axes' centre");
      v.number("lamp_distance_mm", file.lamp_distance_mm, {10.0, 1e5}, "");
      const std::string name = file.rig.name;
      if (!file.rig.axes.empty()) {  // an example or a resolved file: only the distances may differ
        file.rig.camera.home_pose =
            rig::la2(file.camera_distance_mm, file.lamp_distance_mm).camera.home_pose;
        file.rig.lamp.home_pose =
            rig::la2(file.camera_distance_mm, file.lamp_distance_mm).lamp.home_pose;
      }
      file.rig.name = name;
    } else {
      std::vector<std::string> names =
          kind_before == RigFile::Kind::chains ? axis_names(file.rig) : std::vector<std::string>{};
      v.texts("axes", names, "their names; each has a table [axis.NAME]");
      if (names != axis_names(file.rig)) {
        file.rig.axes.assign(names.size(), {});
        for (std::size_t i = 0; i < names.size(); ++i) file.rig.axes[i].name = names[i];
      }
      if (kind_before == RigFile::Kind::la2) {
        file.rig.camera = {};
        file.rig.lamp = {};
        file.rig.sample = {};
      }
    }
    v.text("calibration", file.calibration,
           "calibration file, relative to this one; empty: nominal constants");
    v.flag("collimated_lamp", file.rig.collimated_lamp, "");
    v.flag("simultaneous_axes", file.rig.simultaneous_axes, "false: one axis moves at a time");
    v.flag("use_reciprocity", file.branches.reciprocal, "may exchange light and detector");
    v.flag("use_other_side", file.branches.other_side, "may use the mirrored poses");
  });
  v.table("axis", "", [&] {
    file.devices.axes.resize(file.rig.axes.size());
    for (std::size_t i = 0; i < file.rig.axes.size(); ++i) {
      v.table(file.rig.axes[i].name, "", [&] {
        visit_axis(v, file.rig.axes[i]);
        if (file.driver == RigFile::Driver::hardware) visit_axis_device(v, file.devices.axes[i]);
      });
    }
  });
  if (file.kind == RigFile::Kind::chains) {
    const std::vector<std::string> names = axis_names(file.rig);
    visit_chain(v, "camera_chain", "z forward, x right in the image", file.rig.camera, names);
    visit_chain(v, "lamp_chain", "origin at the source, z towards the sample", file.rig.lamp,
                names);
    visit_chain(v, "sample_chain", "z = surface normal, x = sample mark", file.rig.sample, names);
  }
  v.table("limits", "What may be measured besides the axes' limits", [&] {
    rig::MeasurementLimits& limits = file.rig.limits;
    v.angle("theta_i_max_deg", limits.theta_i_max, {0.0, 90.0}, "of the light, from the normal");
    v.angle("theta_o_max_deg", limits.theta_o_max, {0.0, 90.0}, "of the camera");
    v.angle("theta_d_min_deg", limits.theta_d_min, {0.0, 90.0},
            "closer, the lamp head hides the camera");
    v.number("min_projected_half_width_mm", limits.footprint.min_projected_half_width_mm,
             {0.0, 1e4}, "of the used sample, seen by the camera; 0: not checked");
    v.angle("camera_half_field_deg", limits.footprint.camera_half_field, {0.0, 89.0},
            "holds all of it about the camera's axis; 0: not checked");
  });
  visit_keep_outs(v, file.rig);
}

void visit_camera(ConfigVisitor& v, sim::CameraOptions& camera) {
  v.table(
      "camera", "Sensor and lens: of the simulated camera, and nominal without a calibration", [&] {
        v.integer("width_px", camera.width_px, {8, 16384}, "");
        v.integer("height_px", camera.height_px, {8, 16384}, "");
        v.enumeration("pixel_format", camera.pixel_format,
                      {"mono", "bayer_rggb", "bayer_grbg", "bayer_gbrg", "bayer_bggr"}, "");
        v.number("fx_px", camera.fx_px, kPositive, "focal length over pixel pitch");
        v.number("fy_px", camera.fy_px, kPositive, "");
        v.number("cx_px", camera.cx_px, {-1e5, 1e5}, "principal point; pixel centres are whole");
        v.number("cy_px", camera.cy_px, {-1e5, 1e5}, "");
        v.number("k1", camera.k1, {-100.0, 100.0}, "distortion (Brown 1971)");
        v.number("k2", camera.k2, {-100.0, 100.0}, "");
        v.number("p1", camera.p1, {-10.0, 10.0}, "");
        v.number("p2", camera.p2, {-10.0, 10.0}, "");
        v.number("responsivity_e_per_s", camera.responsivity_e_per_s, kPositive,
                 "electrons per second and W/m2/sr");
        v.number("gain_dn_per_e", camera.dn_per_electron, kPositive, "");
        v.number("read_noise_e", camera.read_noise_e, kNotNegative, "");
        v.number("full_well_e", camera.full_well_e, kPositive, "");
        v.number("black_level_dn", camera.black_level_dn, kNotNegative, "");
        v.integer("bits", camera.bits, {8, 16}, "");
        v.number("dark_current_e_per_s", camera.dark_current_e_per_s, kNotNegative, "");
        v.number("prnu", camera.prnu, kShare, "relative spread of the pixels' response");
        v.number("dsnu_e", camera.dsnu_e, kNotNegative, "spread of their offsets");
        v.numbers("vignetting", camera.vignetting, {-1e3, 1e3},
                  "powers 1, 2, 3 of tan^2 of the angle");
        v.duration("min_exposure_us", camera.min_exposure, kMicrosecond, kExposure, "");
        v.duration("max_exposure_us", camera.max_exposure, kMicrosecond, kExposure, "");
        v.duration("readout_us", camera.readout, kMicrosecond, {0.0, 1e8}, "");
      });
}

void visit_session(ConfigVisitor& v, RigFile& file) {
  acquisition::SessionOptions& session = file.session;
  acquisition::ReductionOptions& reduction = file.reduction;
  v.table("sample", "What is measured of a sample", [&] {
    v.number("half_width_mm", session.sample_half_width_mm, {0.1, 1e4}, "used part of the sample");
    v.number("edge_margin_mm", session.edge_margin_mm, {0.0, 1e3}, "kept clear of its edge");
    v.number("spot_half_width_mm", session.spot_half_width_mm, {0.01, 1e3},
             "averaged to one value");
    v.integer("grid", reduction.grid, {1, 64}, "grid x grid values per pose");
  });
  v.table("white", "The white reference", [&] {
    v.enumeration("placement", session.white, {"in_frame", "changer", "manual"}, "");
    v.text("id", file.white.id, "");
    v.numbers("reflectance", {file.white.reflectance.data(), 3}, {0.01, 1.0}, "R, G, B");
    v.text("certificate", file.certificate,
           "CSV of its angular factor, relative to this file; empty: 1");
    v.number("u_relative", file.white.u_relative, kShare, "its standard uncertainty");
    double half_width_mm = session.white_half_width_mm.value_or(session.sample_half_width_mm);
    v.number("half_width_mm", half_width_mm, {0.1, 1e4},
             "used part of it in the sample plane; left out: as the sample");
    session.white_half_width_mm = half_width_mm;
    v.numbers("patch_mm", {session.white_patch_mm.data(), 2}, kMillimetres,
              "centre of the in-frame patch");
    v.number("patch_half_width_mm", session.white_patch_half_width_mm, {0.1, 1e3}, "");
  });
  v.table("targets", "What a calibration puts on the holder", [&] {
    TargetThickness& targets = file.targets;
    v.number("mirror_raised_mm", targets.mirror_raised_mm, kMillimetres,
             "its face before the board's: thickness less the board's");
    v.number("u_mirror_raised_mm", targets.u_mirror_raised_mm, {0.0, 10.0},
             "standard uncertainty of that");
    v.number("sample_raised_mm", targets.sample_raised_mm, kMillimetres,
             "a sample's face before the board's");
    v.number("u_sample_raised_mm", targets.u_sample_raised_mm, {0.0, 10.0}, "");
    v.number("black_glass_index", targets.black_glass_index, {1.01, 4.0}, "refractive");
  });
  v.table("session", "How a session measures", [&] {
    v.duration("first_exposure_us", session.first_exposure, kMicrosecond, kExposure, "");
    v.duration("max_exposure_us", session.max_exposure, kMicrosecond, kExposure,
               "longest one a bracket may use");
    v.number("bracket_ratio", session.bracket_ratio, {1.01, 64.0}, "to the next shorter one");
    v.integer("max_exposures", session.max_exposures, {1, 64}, "per channel and point");
    v.number("relative_sigma", session.relative_sigma, {1e-5, 0.99}, "wanted at the dimmest spot");
    v.integer("white_frames", session.white_frames, {1, 1000}, "per channel, opening and closing");
    v.integer("dark_frames", session.dark_frames, {1, 1000}, "");
    v.integer("sentinel_every", session.sentinel_every, {0, 100000},
              "points between checks of home marks and sentinel; 0: none");
    v.duration("sentinel_interval_min", session.sentinel_interval, 60.0, {0.1, 1e5},
               "time after which there is one all the same");
    v.duration("white_interval_min", session.white_interval, 60.0, {0.0, 1e5},
               "at most between two whites; 0: opening and closing alone");
    v.integer("repeat_pairs", file.pairs.repeats, {0, 1000},
              "points measured again, half a session later");
    v.integer("reciprocity_pairs", file.pairs.reciprocals, {0, 1000},
              "points measured again, light and camera exchanged");
    v.integer("retries", session.retries, {0, 100}, "of a failed device call");
    v.duration("move_timeout_s", session.move_timeout, 1.0, {0.1, 1e5}, "");
  });
}

void visit_simulation(ConfigVisitor& v, RigFile& file) {
  v.table("simulation", "What is true in the simulated world and unknown to the session", [&] {
    sim::SimOptions& world = file.world;
    v.text("material", file.material, "on the rig unless `measure --material` names another");
    v.flag("hidden", file.hidden, "true: a world off these values, by the seed, to be calibrated");
    v.angle("tilt_rms_deg", file.tilt_rms, {0.0, 10.0}, "of the sample's normal, about x and y");
    v.angle("zero_offset_deg", file.axis_errors.zero_offset, {-10.0, 10.0}, "of every axis");
    v.angle("backlash_deg", file.axis_errors.backlash, {0.0, 5.0}, "");
    v.angle("encoder_step_deg", file.axis_errors.encoder_step, {0.0, 5.0}, "");
    v.angle("homing_sigma_deg", file.axis_errors.homing_sigma, {0.0, 5.0}, "");
    v.angle("positioning_sigma_deg", file.axis_errors.positioning_sigma, {0.0, 5.0}, "");
    v.flag("white_light", file.white_light, "one white lamp channel instead of R, G, B");
    v.number("lamp_drift_sigma", world.lamp.drift_sigma, kShare, "0: its light is steady");
    v.number("stray_fraction", world.lamp.stray_fraction, kShare, "of the lamp's light");
    v.number("lamp_polarisation", world.lamp.polarisation, kShare,
             "share of its light that is linearly polarised");
    v.angle("lamp_polarisation_deg", world.lamp.polarisation_direction, {-180.0, 180.0},
            "its direction about the lamp's axis");
    v.number("camera_polarisation", world.camera.polarisation, kShare,
             "how much more it takes of one direction than of the other");
    v.angle("camera_polarisation_deg", world.camera.polarisation_direction, {-180.0, 180.0},
            "that direction in the image, from its x axis");
    v.number("ambient_radiance", world.scene.ambient_radiance, kNotNegative, "W/m2/sr");
    v.duration("change_time_s", world.change_time, 1.0, {0.0, 1e5}, "of the target changer");
    v.flag("same_noise_again", world.same_noise_again,
           "closing white as noisy as the opening one: to compare sessions by the byte");
    double time_scale = world.time_scale.value_or(0.0);
    v.number("time_scale", time_scale, kNotNegative,
             "virtual seconds per real one; 0: as fast as it goes");
    world.time_scale = time_scale > 0.0 ? std::optional(time_scale) : std::nullopt;
  });
}

void visit(ConfigVisitor& v, RigFile& file) {
  visit_rig(v, file);
  if (file.driver == RigFile::Driver::hardware) visit_devices(v, file.devices);
  visit_camera(v, file.world.camera);
  visit_session(v, file);
  visit_simulation(v, file);
}

void check_file(const RigFile& file, const ConfigReader& reader,
                const std::filesystem::path& place) {
  const auto refuse = [&](const std::string& key, const std::string& why) {
    throw ConfigError(place, reader.line_of(key), key, why);
  };
  for (const rig::Axis& axis : file.rig.axes) {
    const std::string key = "axis." + axis.name;
    if (!(axis.min < axis.max)) {
      refuse(key + ".min_deg", fmt::format("found {:g}, expected below max_deg = {:g}",
                                           axis.min.degrees(), axis.max.degrees()));
    }
    if (axis.home < axis.min || axis.home > axis.max) {
      refuse(key + ".home_deg",
             fmt::format("found {:g}, expected {:g} to {:g}", axis.home.degrees(),
                         axis.min.degrees(), axis.max.degrees()));
    }
  }
  check_keep_outs(file.rig, reader, place);
  if (file.driver == RigFile::Driver::hardware) {
    check_devices(file.devices, axis_names(file.rig), reader, place);
    const ChangerDevice& changer = file.devices.changer;
    if (file.session.white == acquisition::WhitePlacement::changer &&
        (!changer.carries(devices::Target::sample) || !changer.carries(devices::Target::white))) {
      refuse("white.placement",
             "found changer, expected in_frame or manual, or a [changer] that carries sample and "
             "white");
    }
  }
  const auto validated = [&](const std::string& key, const auto& part) {
    try {
      part();
    } catch (const std::invalid_argument& error) {
      refuse(key, error.what());
    }
  };
  validated("rig", [&] { file.rig.validate(); });
  validated("session", [&] { file.session.validate(); });
  validated("sample", [&] { file.reduction.validate(); });
  validated("camera", [&] { file.world.camera.validate(); });
  const auto beside = [&](double patch_mm) {
    return std::abs(patch_mm) - file.session.white_patch_half_width_mm >=
           file.session.sample_half_width_mm;
  };
  if (file.reduction.white_in_frame && !beside(file.session.white_patch_mm.x()) &&
      !beside(file.session.white_patch_mm.y())) {
    refuse("white.patch_mm",
           fmt::format("found ({:g}, {:g}), which lies on the sample of half width {:g}, expected "
                       "the patch beside it",
                       file.session.white_patch_mm.x(), file.session.white_patch_mm.y(),
                       file.session.sample_half_width_mm));
  }
  if (file.hidden && (file.kind != RigFile::Kind::la2 || file.white_light)) {
    refuse("simulation.hidden",
           "found true, which is made for rig.type = \"la2\" with R, G, B channels");
  }
  if (file.white_light != (file.world.camera.pixel_format != devices::PixelFormat::mono)) {
    refuse("simulation.white_light",
           "white light needs a Bayer camera, and R, G, B channels a mono one");
  }
}

}  // namespace

std::string_view to_string(RigFile::Driver driver) {
  return driver == RigFile::Driver::simulated ? "simulated" : "hardware";
}

RigFile default_rig_file() {
  RigFile file;
  file.rig = rig::la2(file.camera_distance_mm, file.lamp_distance_mm);
  file.rig.name = "simulated LA-2";
  file.white.id = "simulated tile";
  file.white.reflectance = brdf::Rgb::Constant(0.99);
  file.white.u_relative = 0.005;
  return file;
}

RigFile rig_file_from_text(const std::string& text, const std::filesystem::path& place) {
  RigFile file = default_rig_file();
  ConfigReader reader(text, place);
  visit(reader, file);
  reader.finish();
  // Said once in the file, needed by runner and reduction.
  acquisition::set_geometry(file.session, file.reduction);
  rig::FootprintLimits& footprint = file.rig.limits.footprint;
  if (footprint.min_projected_half_width_mm > 0.0 || footprint.camera_half_field > Angle()) {
    footprint.sample_half_width_mm = file.session.sample_half_width_mm;
    footprint.edge_margin_mm = file.reduction.edge_margin_mm;
    footprint.spot_half_width_mm = file.session.spot_half_width_mm;
  }
  if (file.white_light) file.world.lamp.channels = sim::LampOptions::white_channel();
  check_file(file, reader, place);
  file.path = place;
  return file;
}

RigFile read_rig_file(const std::filesystem::path& path) {
  return rig_file_from_text(files::read_text_file(path, kMaxTomlBytes), path);
}

std::string rig_file_text(RigFile file, bool comments) {
  ConfigWriter writer(comments);
  visit(writer, file);
  return writer.text_so_far();
}

std::string example_rig_text(const RigFile& rig) {
  return "# A rig file for gonio. Every key is optional and stands here with its default; unknown "
         "keys\n"
         "# are errors. `gonio rig check FILE` says what a rig can reach. Angles are in degrees,\n"
         "# lengths in millimetres; a calibration file brings the measured constants.\n" +
         rig_file_text(rig, true) + keep_out_example(rig.rig);
}

}  // namespace gonio::cli
