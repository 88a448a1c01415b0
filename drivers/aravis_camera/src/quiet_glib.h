#pragma once

namespace gonio::aravis_camera {

/// From now on GLib and Aravis print nothing of what they think of a device's answers: the calls'
/// own errors say it, and a library prints nothing. For the whole process; any thread.
void quiet_glib();

}  // namespace gonio::aravis_camera
