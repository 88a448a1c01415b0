#include "gonio/private_network/private_network.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace gonio::private_network {
namespace {

std::string failed(const std::string& what) { return what + ": " + std::strerror(errno); }

bool write_line(const char* path, const std::string& line) {
  std::ofstream file(path);
  file << line << std::flush;
  return file.good();
}

/// As ordinary user: in a user namespace of our own we may have a network namespace.
std::string unshare_as_user() {
  const std::string uid = std::to_string(getuid());
  const std::string gid = std::to_string(getgid());
  if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return failed("unshare");
  // The kernel wants setgroups given up before an ordinary user maps groups.
  write_line("/proc/self/setgroups", "deny");
  if (!write_line("/proc/self/uid_map", uid + " " + uid + " 1") ||
      !write_line("/proc/self/gid_map", gid + " " + gid + " 1")) {
    return "mapping the user failed";
  }
  return {};
}

std::string set_up(const std::vector<std::string>& further_addresses) {
  const int control = socket(AF_INET, SOCK_DGRAM, 0);
  if (control < 0) return failed("socket");
  std::string refused;
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP | IFF_RUNNING | IFF_LOOPBACK;
  if (ioctl(control, SIOCSIFFLAGS, &request) != 0) refused = failed("loopback up");
  for (std::size_t index = 0; refused.empty() && index < further_addresses.size(); ++index) {
    request = {};
    std::strcpy(request.ifr_name, ("lo:" + std::to_string(index + 1)).c_str());
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, further_addresses[index].c_str(), &address.sin_addr);
    std::memcpy(&request.ifr_addr, &address, sizeof address);
    // An address that is there already, 127.0.0.1 or one named twice, is no failure.
    if (ioctl(control, SIOCSIFADDR, &request) != 0 && errno != EEXIST) {
      refused = failed(further_addresses[index]);
    }
  }
  close(control);
  return refused;
}

}  // namespace

std::string enter(const std::vector<std::string>& further_addresses) {
  // As root a network namespace is enough, also with the threads that a sanitizer brings along.
  if (unshare(CLONE_NEWNET) != 0) {
    const std::string refused = unshare_as_user();
    if (!refused.empty()) return refused;
  }
  return set_up(further_addresses);
}

}  // namespace gonio::private_network
