#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "command.h"
#include "gonio/acquisition/frame_file.h"
#include "gonio/devices/device_error.h"
#include "gonio/monitor/frame_picture.h"
#include "gonio/monitor/setup_page.h"
#include "gonio/render/png.h"
#include "hands_on.h"
#include "json_text.h"
#include "monitoring.h"
#include "outputs.h"

namespace gonio::cli {
namespace {

struct SnapOptions : HandsOnOptions {
  std::string out;
  std::string channel;
  double exposure_ms = 20.0;
  bool force = false;
  MonitorOptions watching;
};

std::chrono::nanoseconds exposure_of(const SnapOptions& options) {
  return std::chrono::nanoseconds(std::llround(options.exposure_ms * 1e6));
}

void light(HandsOn& rig, const SnapOptions& options) {
  if (options.channel.empty()) return;
  try {
    rig.guarded().light(options.channel);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

/// Frame after frame for a page, as long as one looks on, until Ctrl-C.
int snap_live(Context& context, const SnapOptions& options) {
  if (!options.out.empty()) throw UsageError("--monitor takes no frame to keep: found --out");
  const monitor::HttpAddress address = monitor_address(context.console, options.watching);
  HandsOn rig(context, options, Parts::all);
  light(rig, options);
  monitor::SetupView view;
  std::optional<monitor::SetupPage> page;
  listening([&] {
    page.emplace(address, view,
                 rig.file().rig.name +
                     (options.channel.empty() ? ", shutter closed" : ", " + options.channel));
  });
  context.console.say("live image: " + page->url() + " (Ctrl-C ends)");
  while (view.wait_until_asked(context.stop)) {
    try {
      view.show(rig.guarded().capture(exposure_of(options)));
    } catch (const devices::DeviceError& error) {
      if (context.stop.stop_requested()) break;
      const bool may_pass = error.code() == devices::DeviceErrc::Timeout ||
                            error.code() == devices::DeviceErrc::Protocol;
      if (!may_pass) throw;
      view.show_error(error.what());
    }
  }
  rig.finish();
  return kSuccess;
}

int snap(Context& context, const SnapOptions& options) {
  if (options.watching.port) return snap_live(context, options);
  if (options.out.empty()) throw UsageError("--out is required, or --monitor");
  const std::filesystem::path out(options.out);
  const bool picture = out.extension() == ".png";
  if (!picture && out.extension() != ".tif" && out.extension() != ".tiff") {
    throw UsageError(options.out + ": expected a name ending in .png (to look at) or .tif (raw)");
  }
  require_output(options.out, options.force, {options.rig});
  HandsOn rig(context, options, Parts::all);
  light(rig, options);
  const devices::Frame frame = rig.guarded().capture(exposure_of(options));
  rig.finish();
  if (picture) {
    render::write_png(out, monitor::frame_picture(frame, frame.width_px), overwrite(options.force));
  } else {
    acquisition::write_frame_file(out, frame, overwrite(options.force));
  }
  const monitor::FrameFigures figures = monitor::figures_of(frame);
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
  const Command command = root.add("snap", "Take one frame, or show live ones",
                                   "gonio snap rigs/lab_example.toml --channel G --out frame.png");
  add_hands_on_options(command, *options, false);
  command.text("--out", options->out, "Picture (.png) or raw frame (.tif) to create");
  command.text("--channel", options->channel, "Lit meanwhile (default: the shutter stays closed)");
  command.number("--exposure-ms", options->exposure_ms, 0.001, 3.6e6, "How long to expose");
  command.force(options->force);
  add_page_options(command, options->watching, "Serve live images for focusing and aiming instead");
  command.on_call(options, snap);
}

}  // namespace gonio::cli
