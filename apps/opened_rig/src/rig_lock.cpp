#include "gonio/opened_rig/rig_lock.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <set>
#include <string>
#include <thread>

#include "gonio/console/failures.h"
#include "gonio/files/sha256.h"

namespace gonio::cli {
namespace {

std::filesystem::path lock_folder() {
  // An emulated machine (docs/adr/0004) has devices of its own, and goes away with its folder.
  if (const char* emulated = std::getenv("UMOCKDEV_DIR")) return emulated;
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  for (const char* folder : {"/run/lock", runtime}) {
    if (folder != nullptr && ::access(folder, W_OK | X_OK) == 0) return folder;
  }
  return std::filesystem::temp_directory_path();
}

/// What a stable name of a port, a link as in /dev/serial/by-id, stands for. Link by link:
/// umockdev's realpath(3), which would do it at once, writes beyond its result where a port of an
/// emulated machine is a link out of it.
std::filesystem::path port_behind(std::filesystem::path port) {
  constexpr int kMostLinks = 40;  // as many as Linux follows
  for (int link = 0; link < kMostLinks; ++link) {
    std::error_code no_link;
    const std::filesystem::path target = std::filesystem::read_symlink(port, no_link);
    if (no_link) break;
    port = (port.parent_path() / target).lexically_normal();
  }
  return port;
}

std::string bus_address(const BusEntry& bus) {
  if (bus.kind == BusEntry::Kind::modbus_tcp) return fmt::format("{}:{}", bus.host, bus.tcp_port);
  return port_behind(bus.port).string();
}

/// What is driven, as one process at a time may: in an order that all keep to.
std::set<std::string> addresses_of(const RigFile& rig, Parts parts) {
  std::set<std::string> addresses;
  const auto add_bus = [&](const std::string& name) {
    if (const BusEntry* bus = rig.devices.bus(name)) addresses.insert(bus_address(*bus));
  };
  for (const AxisDevice& axis : rig.devices.axes) {
    if (axis.driver == AxisDevice::Driver::apt) {
      addresses.insert("stage " + axis.serial);
    } else {
      add_bus(axis.bus);
    }
  }
  add_bus(rig.devices.lamp.bus);
  if (parts == Parts::all) {
    add_bus(rig.devices.changer.bus);
    addresses.insert("camera " + rig.devices.camera.id);
    if (!rig.devices.monitor.serial.empty()) {
      addresses.insert("monitor " + rig.devices.monitor.serial);
    }
  }
  return addresses;
}

/// Longer than a watchdog takes (stop_rig.cpp).
constexpr std::chrono::seconds kWatchdogPatience{35};
constexpr std::chrono::milliseconds kBetweenLooks{20};

/// Held by a process that is gone: the watchdog it left holds it until the rig is stopped.
bool is_gone(pid_t holder) { return holder > 0 && ::kill(holder, 0) != 0 && errno == ESRCH; }

files::ProcessLock lock_after_watchdog(const std::filesystem::path& path) {
  const auto deadline = std::chrono::steady_clock::now() + kWatchdogPatience;
  while (true) {
    try {
      return files::ProcessLock(path);
    } catch (const files::HeldByAnother& error) {
      if (!is_gone(error.holder()) || std::chrono::steady_clock::now() >= deadline) throw;
    }
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

}  // namespace

RigLock::RigLock(const RigFile& rig, Parts parts, const std::filesystem::path& folder) {
  for (const std::string& address : addresses_of(rig, parts)) {
    const std::string name = "gonio-" + files::sha256_of_bytes(address) + ".lock";
    try {
      locks_.push_back(lock_after_watchdog((folder.empty() ? lock_folder() : folder) / name));
    } catch (const files::HeldByAnother& error) {
      throw UsageError(
          fmt::format("{}: {} is used by process {}", rig.rig.name, address, error.holder()),
          "one process at a time drives a rig: wait for it, or end it");
    }
  }
}

std::vector<int> RigLock::descriptors() const {
  std::vector<int> all;
  for (const files::ProcessLock& lock : locks_) all.push_back(lock.descriptor());
  return all;
}

}  // namespace gonio::cli
