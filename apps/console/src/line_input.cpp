#include "gonio/console/line_input.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <deque>
#include <functional>
#include <system_error>

namespace gonio::cli {
namespace {

constexpr std::size_t kLongestLine = 4096;

/// What poll() can wait for besides standard input.
class Alarm {
 public:
  Alarm() : descriptor_(::eventfd(0, EFD_CLOEXEC)) {
    if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  ~Alarm() { ::close(descriptor_); }
  Alarm(const Alarm&) = delete;
  Alarm& operator=(const Alarm&) = delete;
  int descriptor() const { return descriptor_; }
  void ring() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(descriptor_, &one, sizeof one);
  }

 private:
  int descriptor_;
};

}  // namespace

LineInput read_line(std::initializer_list<std::stop_token> until) {
  const Alarm alarm;
  std::deque<std::stop_callback<std::function<void()>>> heard;  // ends before the alarm does
  for (const std::stop_token& token : until) heard.emplace_back(token, [&alarm] { alarm.ring(); });
  LineInput input;
  while (true) {
    std::array<pollfd, 2> waiting{pollfd{STDIN_FILENO, POLLIN, 0},
                                  pollfd{alarm.descriptor(), POLLIN, 0}};
    if (::poll(waiting.data(), waiting.size(), -1) < 0) {
      if (errno == EINTR) continue;
      throw std::system_error(errno, std::generic_category(), "poll");
    }
    if (waiting[1].revents != 0) {
      input.ended = LineInput::Ended::stopped;
      return input;
    }
    if (waiting[0].revents == 0) continue;
    // Byte by byte: the next prompt's answer must stay where poll() sees it.
    char byte = 0;
    const ssize_t count = ::read(STDIN_FILENO, &byte, 1);
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count <= 0) {
      input.ended = LineInput::Ended::end;
      return input;
    }
    if (byte == '\n' || input.text.size() == kLongestLine) {
      input.ended = LineInput::Ended::line;
      return input;
    }
    input.text += byte;
  }
}

}  // namespace gonio::cli
