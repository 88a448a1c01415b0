#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <optional>
#include <utility>

#include "descriptors.h"
#include "machine.h"

namespace gonio::usb_emulator {

using emulator_faults::Fault;

namespace {

// An empty reap is answered after this long, not at once: usbfs wakes its readers, here they ask
// again and again.
constexpr std::chrono::microseconds kReapPatience{300};
// A kernel frees the claims of a program before anybody hears of its end; here the end of its
// socket may still be on the way.
constexpr std::chrono::milliseconds kClaimPatience{50};
constexpr std::size_t kSetupBytes = 8;
constexpr std::uint8_t kInward = 0x80;
constexpr std::uint8_t kStandardIn = 0x80;
constexpr std::uint8_t kGetDescriptor = 6;
constexpr std::uint8_t kGetStatus = 0;
constexpr std::uint16_t kStringType = 3;

/// The caller's memory at a pointer inside `data`; null when it cannot be read.
DataPtr resolve(UMockdevIoctlData* data, std::size_t offset, std::size_t size) {
  GError* error = nullptr;
  DataPtr resolved(umockdev_ioctl_data_resolve(data, offset, size, &error));
  g_clear_error(&error);
  return resolved;
}

CallPtr kept(UMockdevIoctlClient* call) {
  return CallPtr(static_cast<UMockdevIoctlClient*>(g_object_ref(call)));
}

template <class Plain>
Plain load(const UMockdevIoctlData& data, std::size_t offset = 0) {
  Plain plain;
  std::memcpy(&plain, data.data + offset, sizeof plain);
  return plain;
}

template <class Plain>
void store(UMockdevIoctlData& data, std::size_t offset, const Plain& plain) {
  std::memcpy(data.data + offset, &plain, sizeof plain);
}

}  // namespace

void Client::finish(Urb urb, int status, std::size_t moved) {
  urb.status = status;
  urb.moved = moved;
  done.push_back(std::move(urb));
}

void Client::answer_reap() {
  if (!reap) return;
  int error = 0;
  if (!done.empty()) {
    const Urb urb = std::move(done.front());
    done.pop_front();
    store(*urb.memory, offsetof(usbdevfs_urb, status), urb.status);
    store(*urb.memory, offsetof(usbdevfs_urb, actual_length), static_cast<int>(urb.moved));
    umockdev_ioctl_data_set_ptr(reap_argument.get(), 0, urb.memory.get());
  } else if (Wall::now() >= reap_until) {
    error = EAGAIN;
  } else {
    return;
  }
  const CallPtr call = std::move(reap);
  umockdev_ioctl_client_complete(call.get(), error == 0 ? 0 : -1, error);
  reap_argument.reset();
}

Client& Socket::client_of(UMockdevIoctlClient* call) {
  for (const auto& client : clients) {
    if (client->is(call)) return *client;
  }
  clients.push_back(std::make_unique<Client>(call));
  return *clients.back();
}

void Socket::forget_gone() {
  std::erase_if(clients, [](const std::unique_ptr<Client>& client) { return client->gone(); });
}

gboolean Machine::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* call, gpointer data) {
  auto& socket = *static_cast<Socket*>(data);
  socket.machine.load()->handle(socket, call);
  return 1;
}

void Machine::handle(Socket& socket, UMockdevIoctlClient* call) {
  const std::lock_guard lock(mutex_);
  Client& client = socket.client_of(call);
  UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(call);
  // The first member of most arguments: an interface or an endpoint.
  const auto number = [&] {
    const DataPtr data = resolve(argument, 0, sizeof(unsigned int));
    return data ? load<unsigned int>(*data) : ~0U;
  };
  int error = 0;
  const auto request = static_cast<unsigned int>(umockdev_ioctl_client_get_request(call));
  switch (request) {
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      reap(client, call);
      return;  // answers itself, perhaps later
    case USBDEVFS_DISCARDURB:
      error = discard(client, load<unsigned long>(*argument));
      break;
    case USBDEVFS_GET_CAPABILITIES: {
      const DataPtr data = resolve(argument, 0, sizeof(std::uint32_t));
      if (data) {
        store<std::uint32_t>(*data, 0,
                             USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                 USBDEVFS_CAP_REAP_AFTER_DISCONNECT);
      }
      break;
    }
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL:
      error = ENODATA;  // no kernel driver has it
      break;
    case USBDEVFS_RELEASEINTERFACE:
      client.claimed = false;
      break;
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
      if (socket.plugged && number() == 0) {  // all devices here have one interface
        claim(socket, client, call);
        return;  // answers itself, perhaps later
      }
      error = socket.plugged ? EINVAL : ENODEV;
      break;
    case USBDEVFS_SUBMITURB:
      error = socket.plugged ? submit(socket, client, argument) : ENODEV;
      break;
    case USBDEVFS_CLEAR_HALT:
      error = socket.plugged ? 0 : ENODEV;
      ((number() & kInward) != 0 ? socket.halted_in : socket.halted_out) = false;
      break;
    case USBDEVFS_RESET:
    case USBDEVFS_SETCONFIGURATION:
      error = socket.plugged ? 0 : ENODEV;
      break;
    default:
      error = ENOTTY;
      break;
  }
  umockdev_ioctl_client_complete(call, error == 0 ? 0 : -1, error);
  wake_.notify_one();
}

void Machine::claim(Socket& socket, Client& client, UMockdevIoctlClient* call) {
  client.claim = kept(call);
  client.claim_until = Wall::now() + kClaimPatience;
  socket.answer_claim(client);
}

bool Socket::held_by_another(const Client& client) const {
  return std::any_of(clients.begin(), clients.end(), [&](const std::unique_ptr<Client>& other) {
    return other.get() != &client && other->claimed && !other->gone();
  });
}

void Socket::answer_claim(Client& client) const {
  if (!client.claim) return;
  const bool held = held_by_another(client);
  if (held && Wall::now() < client.claim_until) return;
  client.claimed = !held;
  const CallPtr call = std::move(client.claim);
  umockdev_ioctl_client_complete(call.get(), held ? -1 : 0, held ? EBUSY : 0);
}

int Machine::submit(Socket& socket, Client& client, UMockdevIoctlData* argument) {
  Urb urb;
  urb.address = load<unsigned long>(*argument);
  urb.memory = resolve(argument, 0, sizeof(usbdevfs_urb));
  if (!urb.memory) return EFAULT;
  const auto plain = load<usbdevfs_urb>(*urb.memory);
  urb.since = Wall::now();
  if (plain.buffer_length > 0) {
    urb.buffer = resolve(urb.memory.get(), offsetof(usbdevfs_urb, buffer),
                         static_cast<std::size_t>(plain.buffer_length));
    if (!urb.buffer) return EFAULT;
  }
  if (plain.type == USBDEVFS_URB_TYPE_CONTROL) {
    const int status = control(socket, urb);
    const std::size_t moved = urb.moved;
    client.finish(std::move(urb), status, moved);
  } else if (plain.type != USBDEVFS_URB_TYPE_BULK || !client.claimed) {
    return EINVAL;
  } else if ((plain.endpoint & kInward) != 0) {
    client.pending.push_back(std::move(urb));
  } else {
    outward(socket, client, std::move(urb));
  }
  return 0;
}

void Machine::outward(Socket& socket, Client& client, Urb urb) {
  const std::string& name = socket.device->name();
  if (faults.strikes(Fault::unplug, name, clock.now())) {
    client.finish(std::move(urb), -ESHUTDOWN, 0);
    pull(socket);
    socket.comes_back = true;
    return;
  }
  if (faults.strikes(Fault::stall, name, clock.now())) socket.halted_out = true;
  const std::span<std::uint8_t> bytes = urb.bytes();
  if (socket.halted_out) {
    client.finish(std::move(urb), -EPIPE, 0);
  } else {
    socket.device->bulk_out(bytes);
    client.finish(std::move(urb), 0, bytes.size());
  }
}

/// Returns the status of the URB and leaves how much was moved in it.
int Machine::control(Socket& socket, Urb& urb) {
  const std::span<std::uint8_t> bytes = urb.bytes();
  if (bytes.size() < kSetupBytes) return -EINVAL;
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8U);
  };
  const Setup setup{bytes[0], bytes[1], word(2), word(4), word(6)};
  const std::span<std::uint8_t> room = bytes.subspan(kSetupBytes);
  std::optional<Bytes> reply;
  if (setup.request_type == kStandardIn && setup.request == kGetDescriptor &&
      setup.value >> 8U == kStringType) {
    reply = string_descriptor(socket.device->identity(), static_cast<std::uint8_t>(setup.value));
    if (reply->empty()) reply.reset();
  } else if (setup.request_type == kStandardIn && setup.request == kGetStatus) {
    reply = Bytes{0, 0};
  } else {
    reply = socket.device->control(setup, room);
  }
  if (!reply) return -EPIPE;
  urb.moved = room.size();
  if ((setup.request_type & kInward) == 0) return 0;
  urb.moved = std::min(room.size(), reply->size());
  std::copy_n(reply->begin(), urb.moved, room.begin());
  return 0;
}

int Machine::discard(Client& client, unsigned long address) {
  const auto found = std::find_if(client.pending.begin(), client.pending.end(),
                                  [&](const Urb& urb) { return urb.address == address; });
  if (found == client.pending.end()) return EINVAL;
  client.finish(std::move(*found), -ENOENT, 0);
  client.pending.erase(found);
  return 0;
}

void Machine::reap(Client& client, UMockdevIoctlClient* call) {
  client.reap_argument = resolve(umockdev_ioctl_client_get_arg(call), 0, sizeof(void*));
  if (!client.reap_argument) {
    umockdev_ioctl_client_complete(call, -1, EFAULT);
    return;
  }
  client.reap = kept(call);
  client.reap_until = Wall::now() + (ending_ ? std::chrono::microseconds(0) : kReapPatience);
  client.answer_reap();
  wake_.notify_one();
}

}  // namespace gonio::usb_emulator
