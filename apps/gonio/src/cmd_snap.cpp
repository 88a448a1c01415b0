#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "command.h"
#include "gonio/acquisition/frame_file.h"
#include "gonio/render/png.h"
#include "hands_on.h"
#include "json_text.h"
#include "outputs.h"

namespace gonio::cli {
namespace {

struct SnapOptions : HandsOnOptions {
  std::string out;
  std::string channel;
  double exposure_ms = 20.0;
  bool force = false;
};

struct FrameFigures {
  double mean_dn = 0.0;
  std::uint16_t min_dn = 0;
  std::uint16_t max_dn = 0;
  double saturated_share = 0.0;
};

FrameFigures figures_of(const devices::Frame& frame) {
  FrameFigures figures;
  const auto [low, high] = std::minmax_element(frame.pixels_dn.begin(), frame.pixels_dn.end());
  figures.min_dn = *low;
  figures.max_dn = *high;
  std::size_t saturated = 0;
  double sum = 0.0;
  for (const std::uint16_t dn : frame.pixels_dn) {
    sum += dn;
    if (dn >= frame.saturation_level_dn) ++saturated;
  }
  const auto count = static_cast<double>(frame.pixels_dn.size());
  figures.mean_dn = sum / count;
  figures.saturated_share = static_cast<double>(saturated) / count;
  return figures;
}

/// The frame from black level to saturation as a person looks at it: square root for the eye,
/// saturated pixels red.
render::Image preview(const devices::Frame& frame) {
  render::Image image(frame.width_px, frame.height_px);
  const double range = std::max(1.0, frame.saturation_level_dn - frame.black_level_dn);
  for (int y = 0; y < frame.height_px; ++y) {
    for (int x = 0; x < frame.width_px; ++x) {
      const std::uint16_t dn = frame.at(y, x);
      if (dn >= frame.saturation_level_dn) {
        image.at(x, y) = {230, 30, 30, 255};
        continue;
      }
      const double level = std::clamp((dn - frame.black_level_dn) / range, 0.0, 1.0);
      const auto grey = static_cast<std::uint8_t>(std::lround(255.0 * std::sqrt(level)));
      image.at(x, y) = {grey, grey, grey, 255};
    }
  }
  return image;
}

int snap(Context& context, const SnapOptions& options) {
  const std::filesystem::path out(options.out);
  const bool picture = out.extension() == ".png";
  if (!picture && out.extension() != ".tif" && out.extension() != ".tiff") {
    throw UsageError(options.out + ": expected a name ending in .png (to look at) or .tif (raw)");
  }
  require_output(options.out, options.force, {options.rig});
  HandsOn rig(context, options, Parts::all);
  if (!options.channel.empty()) {
    try {
      rig.guarded().light(options.channel);
    } catch (const std::invalid_argument& error) {
      throw UsageError(error.what());
    }
  }
  const std::chrono::nanoseconds exposure(std::llround(options.exposure_ms * 1e6));
  const devices::Frame frame = rig.guarded().capture(exposure);
  rig.finish();
  if (picture) {
    render::write_png(out, preview(frame), overwrite(options.force));
  } else {
    acquisition::write_frame_file(out, frame, overwrite(options.force));
  }
  const FrameFigures figures = figures_of(frame);
  if (options.json) {
    const nlohmann::ordered_json result = {
        {"width_px", frame.width_px},
        {"height_px", frame.height_px},
        {"pixel_format", to_string(frame.pixel_format)},
        {"exposure_us", devices::to_seconds(frame.exposure) * 1e6},
        {"black_level_dn", frame.black_level_dn},
        {"saturation_level_dn", frame.saturation_level_dn},
        {"mean_dn", figures.mean_dn},
        {"min_dn", figures.min_dn},
        {"max_dn", figures.max_dn},
        {"saturated_share", figures.saturated_share}};
    context.console.result(json_text(result));
  } else {
    context.console.result(fmt::format(
        "{} x {} px, {:g} ms: mean {:.1f}, {} to {} DN, black {:g}, {:.2f} % saturated\n",
        frame.width_px, frame.height_px, devices::to_seconds(frame.exposure) * 1e3, figures.mean_dn,
        figures.min_dn, figures.max_dn, frame.black_level_dn, 100.0 * figures.saturated_share));
  }
  return kSuccess;
}

}  // namespace

void add_snap(const Command& root) {
  auto options = std::make_shared<SnapOptions>();
  const Command command = root.add("snap", "Take one frame",
                                   "gonio snap rigs/lab_example.toml --channel G --out frame.png");
  add_hands_on_options(command, *options, false);
  command.text("--out", options->out, "Picture (.png) or raw frame (.tif) to create",
               Need::required);
  command.text("--channel", options->channel, "Lit meanwhile (default: the shutter stays closed)");
  command.number("--exposure-ms", options->exposure_ms, 0.001, 3.6e6, "How long to expose");
  command.force(options->force);
  command.on_call(options, snap);
}

}  // namespace gonio::cli
