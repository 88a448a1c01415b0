// A program that opens emulated devices as any other would: the child of usb_process_test.

#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "gonio/usb_bus/usb_device.h"

namespace {

using namespace gonio::usb_bus;

std::shared_ptr<UsbDevice> open_stage(const std::string& serial) {
  return open_usb_device("stage", {0x0403, 0xFAF0, serial, std::nullopt});
}

int list() {
  for (const UsbDeviceInfo& device : list_usb_devices()) {
    std::cout << to_string_of_id(device.vendor, device.product) << ' ' << device.serial << '\n';
  }
  return 0;
}

int open_times(const std::string& serial, int times) {
  for (int time = 0; time < times; ++time) open_stage(serial);
  std::cout << "opened " << times << '\n';
  return 0;
}

/// Holds the device until its input ends.
int hold(const std::string& serial) {
  const auto device = open_stage(serial);
  std::cout << "held" << std::endl;
  std::string line;
  std::getline(std::cin, line);
  return 0;
}

/// Holds the device and reads from it, never out of a call for long, until it is killed.
[[noreturn]] void read_for_ever(const std::string& serial) {
  const auto device = open_stage(serial);
  std::cout << "reading" << std::endl;
  std::vector<std::uint8_t> room(device->layout().max_packet_in);
  while (true) device->bulk_in(room, std::chrono::seconds(1));
}

/// Sets a serial port up as RTU drives want it, says "ping" and prints what comes back.
int talk(const char* port) {
  const int file = open(port, O_RDWR | O_NOCTTY);
  termios line{};
  if (file < 0 || tcgetattr(file, &line) != 0) return 1;
  cfmakeraw(&line);
  cfsetspeed(&line, B115200);
  line.c_cflag |= PARENB | CLOCAL;
  if (tcsetattr(file, TCSANOW, &line) != 0 || tcflush(file, TCIOFLUSH) != 0) return 1;
  if (write(file, "ping", 4) != 4) return 1;
  char answer[16];
  const ssize_t size = read(file, answer, sizeof answer);
  std::cout << std::string(answer, size > 0 ? static_cast<std::size_t>(size) : 0) << '\n';
  close(file);
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  const std::vector<std::string> words(arguments + 1, arguments + count);
  try {
    if (words.at(0) == "list") return list();
    if (words.at(0) == "open") return open_times(words.at(1), std::stoi(words.at(2)));
    if (words.at(0) == "hold") return hold(words.at(1));
    if (words.at(0) == "read") read_for_ever(words.at(1));
    if (words.at(0) == "talk") return talk(words.at(1).c_str());
  } catch (const std::exception& error) {
    std::cout << error.what() << '\n';
    return 1;
  }
  return 2;
}
