#pragma once

// The only files that include umockdev are those that include this.

#include <umockdev.h>

#include <atomic>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "emulated_device.h"
#include "gonio/devices/clock.h"
#include "gonio/emulator_faults/fault_plan.h"

namespace gonio::usb_emulator {

struct UnrefObject {
  void operator()(void* object) const noexcept { g_object_unref(object); }
};
struct UnrefData {
  void operator()(UMockdevIoctlData* data) const noexcept { umockdev_ioctl_data_unref(data); }
};
using TestbedPtr = std::unique_ptr<UMockdevTestbed, UnrefObject>;
using HandlerPtr = std::unique_ptr<UMockdevIoctlBase, UnrefObject>;
using CallPtr = std::unique_ptr<UMockdevIoctlClient, UnrefObject>;
using DataPtr = std::unique_ptr<UMockdevIoctlData, UnrefData>;

/// One URB between its submission and its reaping.
struct Urb {
  unsigned long address = 0;  ///< in the caller's memory: its name for DISCARDURB
  DataPtr memory;             ///< the struct
  DataPtr buffer;             ///< what it points to; null when it has none
  Wall::time_point since;
  int status = 0;
  std::size_t moved = 0;

  std::span<std::uint8_t> bytes() const {
    if (!buffer) return {};
    return {buffer->data, static_cast<std::size_t>(buffer->data_len)};
  }
};

/// One opening of the device by a program.
struct Client {
  explicit Client(UMockdevIoctlClient* opened) { g_weak_ref_init(&connection, opened); }
  ~Client() { g_weak_ref_clear(&connection); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Weak: umockdev lets go of a program that was killed within a call without calling it
  /// disconnected, and a call that waits here has a reference of its own.
  mutable GWeakRef connection;
  bool claimed = false;  ///< the one interface
  CallPtr claim;         ///< a claim that waits, lest its holder has just been killed
  Wall::time_point claim_until;
  std::deque<Urb> pending;  ///< inward, waiting for the device
  std::deque<Urb> done;     ///< to be reaped
  CallPtr reap;             ///< a reap that waits
  DataPtr reap_argument;
  Wall::time_point reap_until;

  void finish(Urb urb, int status, std::size_t moved);
  /// Hands over what is done, or says that nothing is once the patience is over.
  void answer_reap();
  bool is(UMockdevIoctlClient* call) const { return opened().get() == call; }
  bool gone() const {
    const CallPtr call = opened();
    return !call || umockdev_ioctl_client_get_connected(call.get()) == 0;
  }

 private:
  CallPtr opened() const {
    return CallPtr(static_cast<UMockdevIoctlClient*>(g_weak_ref_get(&connection)));
  }
};

class Machine;

/// A device and the place where it is plugged in.
struct Socket {
  /// Atomic because it is how umockdev's thread, which comes here through a plain pointer, sees
  /// what the one that plugged the device in has made.
  std::atomic<Machine*> machine = nullptr;
  std::unique_ptr<EmulatedDevice> device;
  int port = 0;
  int address = 0;  ///< on the bus; another one at every plugging in
  bool plugged = false;
  bool comes_back = false;  ///< when the fault that pulled it wears off
  HandlerPtr handler;
  std::vector<std::unique_ptr<Client>> clients;
  bool halted_in = false;
  bool halted_out = false;

  std::string device_path() const;
  std::string node() const;
  Client& client_of(UMockdevIoctlClient* call);
  /// What a program that ended had claimed is free; its memory is gone.
  void forget_gone();
  bool held_by_another(const Client& client) const;
  void answer_claim(Client& client) const;
};

/// The emulated machine: sockets, what programs ask of them, and a thread that lets time pass.
class Machine {
 public:
  Machine(emulator_faults::FaultPlan& faults, devices::Clock& clock);
  ~Machine();
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  void add(std::unique_ptr<EmulatedDevice> device);
  void unplug(const std::string& name);
  void plug_in(const std::string& name);
  void cycle_power(const std::string& name);
  std::string directory() const;

  emulator_faults::FaultPlan& faults;
  devices::Clock& clock;

 private:
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* call, gpointer data);

  // usb_calls.cpp: one system call each, with the lock held. Results are errno values.
  void handle(Socket& socket, UMockdevIoctlClient* call);
  static void claim(Socket& socket, Client& client, UMockdevIoctlClient* call);
  int submit(Socket& socket, Client& client, UMockdevIoctlData* argument);
  void outward(Socket& socket, Client& client, Urb urb);
  static int control(Socket& socket, Urb& urb);
  static int discard(Client& client, unsigned long address);
  void reap(Client& client, UMockdevIoctlClient* call);

  void run();
  Wall::time_point step(Socket& socket);
  void plug(Socket& socket);
  void pull(Socket& socket);
  Socket& find(const std::string& name);

  TestbedPtr testbed_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_ = false;
  int last_address_ = 1;  // of the bus's only hub, which is not shown
  std::vector<std::unique_ptr<Socket>> sockets_;
  std::thread thread_;
};

}  // namespace gonio::usb_emulator
