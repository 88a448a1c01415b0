#include "quiet_glib.h"

#include <glib.h>

#include <array>
#include <mutex>

namespace gonio::aravis_camera {
namespace {

constexpr auto kAllButErrors =
    static_cast<GLogLevelFlags>(G_LOG_LEVEL_MASK & ~static_cast<int>(G_LOG_LEVEL_ERROR));

void ignore(const gchar*, GLogLevelFlags, const gchar*, gpointer) {}

}  // namespace

void quiet_glib() {
  static std::once_flag once;
  std::call_once(once, [] {
    // Aravis has the nameless one, libxml the other.
    for (const char* domain :
         std::array<const char*, 5>{nullptr, "XML", "GLib", "GLib-GIO", "GLib-GObject"}) {
      g_log_set_handler(domain, kAllButErrors, &ignore, nullptr);
    }
  });
}

}  // namespace gonio::aravis_camera
