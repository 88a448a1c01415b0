#include "machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <stdexcept>
#include <utility>

namespace gonio::usb_emulator {

using emulator_faults::Fault;

namespace {

constexpr std::chrono::microseconds kBusyTick{250};
constexpr std::chrono::milliseconds kIdleTick{5};

void require(bool ok, const char* what, GError* error) {
  const std::string text = error != nullptr ? error->message : "refused";
  g_clear_error(&error);
  if (!ok) throw std::runtime_error(fmt::format("umockdev: {}: {}", what, text));
}

}  // namespace

std::string Socket::device_path() const {
  return fmt::format("/devices/pci0000:00/0000:00:14.0/usb1/1-{}", port);
}

std::string Socket::node() const { return fmt::format("/dev/bus/usb/001/{:03}", address); }

Machine::Machine(emulator_faults::FaultPlan& faults_of, devices::Clock& clock_of)
    : faults(faults_of), clock(clock_of), testbed_(umockdev_testbed_new()) {
  if (!testbed_) throw std::runtime_error("umockdev: no testbed");
  thread_ = std::thread([this] { run(); });
}

Machine::~Machine() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_one();
  thread_.join();
  for (const auto& socket : sockets_) {
    if (socket->plugged)
      umockdev_testbed_detach_ioctl(testbed_.get(), socket->node().c_str(), nullptr);
  }
  testbed_.reset();  // ends umockdev's own thread: no callback comes after this
}

std::string Machine::directory() const {
  gchar* const root = umockdev_testbed_get_root_dir(testbed_.get());
  std::string text(root);
  g_free(root);
  return text;
}

void Machine::add(std::unique_ptr<EmulatedDevice> device) {
  const std::lock_guard lock(mutex_);
  for (const auto& other : sockets_) {
    if (other->device->name() == device->name()) {
      throw std::invalid_argument("two USB devices are called " + device->name());
    }
  }
  auto socket = std::make_unique<Socket>();
  socket->device = std::move(device);
  socket->port = static_cast<int>(sockets_.size()) + 1;
  socket->machine = this;
  sockets_.push_back(std::move(socket));
  plug(*sockets_.back());
}

void Machine::plug(Socket& socket) {
  if (socket.plugged) return;
  socket.address = ++last_address_;
  socket.halted_in = socket.halted_out = socket.comes_back = false;
  const Identity& identity = socket.device->identity();
  std::string hex;
  for (const std::uint8_t byte : identity.descriptors) hex += fmt::format("{:02X}", byte);
  const std::string text = fmt::format(
      "P: {0}\nN: {1}\nE: DEVNAME=/dev/{1}\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n"
      "E: BUSNUM=001\nE: DEVNUM={2:03}\nE: MAJOR=189\nE: MINOR={3}\n"
      "A: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum={2}\\n\nA: speed=12\\n\n"
      "H: descriptors={4}\n",
      socket.device_path(), socket.node().substr(5), socket.address, socket.address - 1, hex);
  GError* error = nullptr;
  const bool added = umockdev_testbed_add_from_string(testbed_.get(), text.c_str(), &error) != 0;
  require(added, "adding a device", error);
  socket.handler.reset(umockdev_ioctl_base_new());
  g_signal_connect(socket.handler.get(), "handle-ioctl", G_CALLBACK(on_ioctl), &socket);
  error = nullptr;
  const bool attached = umockdev_testbed_attach_ioctl(testbed_.get(), socket.node().c_str(),
                                                      socket.handler.get(), &error) != 0;
  require(attached, "attaching a device", error);
  socket.device->restart();
  socket.plugged = true;
}

void Machine::pull(Socket& socket) {
  if (!socket.plugged) return;
  socket.plugged = false;
  for (const auto& client : socket.clients) {
    for (Urb& urb : client->pending) client->finish(std::move(urb), -ESHUTDOWN, 0);
    client->pending.clear();
    client->answer_reap();
  }
  umockdev_testbed_detach_ioctl(testbed_.get(), socket.node().c_str(), nullptr);
  const std::string path = "/sys" + socket.device_path();
  umockdev_testbed_uevent(testbed_.get(), path.c_str(), "remove");
  umockdev_testbed_remove_device(testbed_.get(), path.c_str());
  socket.device->restart();  // it has no power
}

Socket& Machine::find(const std::string& name) {
  for (const auto& socket : sockets_) {
    if (socket->device->name() == name) return *socket;
  }
  throw std::out_of_range("no USB device called " + name);
}

void Machine::unplug(const std::string& name) {
  const std::lock_guard lock(mutex_);
  pull(find(name));
}

void Machine::plug_in(const std::string& name) {
  const std::lock_guard lock(mutex_);
  plug(find(name));
}

void Machine::cycle_power(const std::string& name) {
  const std::lock_guard lock(mutex_);
  find(name).device->cycle_power();
}

void Machine::run() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    Wall::time_point next = Wall::now() + kIdleTick;
    for (const auto& socket : sockets_) next = std::min(next, step(*socket));
    wake_.wait_until(lock, next);
  }
  for (const auto& socket : sockets_) {
    for (const auto& client : socket->clients) {
      client->reap_until = client->claim_until = Wall::now();
      client->answer_reap();
      socket->answer_claim(*client);
    }
  }
}

Wall::time_point Machine::step(Socket& socket) {
  socket.forget_gone();
  if (socket.comes_back && !socket.plugged &&
      !faults.strikes(Fault::unplug, socket.device->name(), clock.now())) {
    plug(socket);
  }
  if (socket.plugged) socket.device->step();
  Wall::time_point next = Wall::time_point::max();
  for (const auto& client : socket.clients) {
    while (socket.plugged && !client->pending.empty()) {
      Urb& urb = client->pending.front();
      const std::span<std::uint8_t> room = urb.bytes();
      std::optional<Bytes> reply = Bytes{};
      if (!socket.halted_in) reply = socket.device->bulk_in(room.size(), urb.since);
      if (!reply) break;
      std::copy(reply->begin(), reply->end(), room.begin());
      client->finish(std::move(urb), socket.halted_in ? -EPIPE : 0, reply->size());
      client->pending.pop_front();
    }
    client->answer_reap();
    socket.answer_claim(*client);
    if (client->claim) next = std::min(next, Wall::now() + kBusyTick);
    if (client->reap) next = std::min(next, client->reap_until);
    if (!client->pending.empty()) next = std::min(next, Wall::now() + kBusyTick);
  }
  return next;
}

}  // namespace gonio::usb_emulator
