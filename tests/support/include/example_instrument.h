#pragma once

#include "gonio/instrument/instrument.h"

namespace gonio::instrument {

/// A complete instrument with plain numbers: LA-2, 320 x 256 px at 0.25 mm per pixel.
inline Instrument example_instrument() {
  Instrument instrument;
  instrument.id = "example";
  instrument.rig = rig::la2(350.0, 500.0);
  instrument.camera = {.width_px = 320,
                       .height_px = 256,
                       .fx_px = 1400.0,
                       .fy_px = 1400.0,
                       .cx_px = 159.5,
                       .cy_px = 127.5};
  instrument.sensor = {.gain_dn_per_e = 0.39,
                       .read_noise_e = 2.4,
                       .full_well_e = 10500.0,
                       .black_level_dn = 64.0,
                       .saturation_dn = 4095.0,
                       .dark_current_e_per_s = 5.0,
                       .prnu = 0.006};
  instrument.white.id = "tile";
  instrument.white.reflectance = {0.99, 0.985, 0.98};
  instrument.white.u_relative = 0.005;
  instrument.u_normal = Angle::from_degrees(0.05);
  return instrument;
}

}  // namespace gonio::instrument
