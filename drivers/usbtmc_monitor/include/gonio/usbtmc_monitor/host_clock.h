#pragma once

#include <chrono>
#include <functional>

namespace gonio::usbtmc_monitor {

/// The host's time, by which deadlines of the protocol are counted.
using HostClock = std::function<std::chrono::steady_clock::time_point()>;

}  // namespace gonio::usbtmc_monitor
