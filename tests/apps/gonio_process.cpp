#include "gonio_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <stdexcept>

namespace gonio {

GonioProcess::GonioProcess(const std::vector<std::string>& arguments,
                           const std::filesystem::path& folder, std::uint64_t max_file_bytes,
                           const std::string& program, Input input) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe");
  std::array<int, 2> typed{-1, -1};
  if (input == Input::open && ::pipe2(typed.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("pipe");
  }
  input_ = typed[1];
  out_file_ = ::memfd_create("gonio-out", MFD_CLOEXEC);
  if (out_file_ < 0) throw std::runtime_error("memfd_create");
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ == 0) {
    const int from = typed[0] >= 0 ? typed[0] : ::open("/dev/null", O_RDONLY);
    if (::chdir(folder.c_str()) != 0 || ::dup2(from, 0) < 0 || ::dup2(out_file_, 1) < 0 ||
        ::dup2(pipe[1], 2) < 0) {
      ::_exit(126);
    }
    const rlimit limit{max_file_bytes, max_file_bytes};
    if (max_file_bytes > 0 && ::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(126);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(pipe[1]);
  if (typed[0] >= 0) ::close(typed[0]);
  error_pipe_ = pipe[0];
}

GonioProcess::~GonioProcess() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  ::close(error_pipe_);
  if (input_ >= 0) ::close(input_);
  ::close(out_file_);
}

bool GonioProcess::read_more() {
  std::array<char, 4096> bytes{};
  ssize_t count = 0;
  do {
    count = ::read(error_pipe_, bytes.data(), bytes.size());
  } while (count < 0 && errno == EINTR);
  if (count <= 0) return false;
  error_.append(bytes.data(), static_cast<std::size_t>(count));
  return true;
}

bool GonioProcess::wait_for(const std::string& text) {
  while (error_.find(text) == std::string::npos) {
    if (!read_more()) return false;
  }
  return true;
}

void GonioProcess::answer(const std::string& text) const {
  if (::write(input_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw std::runtime_error("write");
  }
}

void GonioProcess::send(int signal) { ::kill(pid_, signal); }

bool GonioProcess::ends_within(std::chrono::nanoseconds time) const {
  pollfd ended{static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)), POLLIN, 0};
  if (ended.fd < 0) throw std::runtime_error("pidfd_open");
  const timespec deadline{time.count() / 1'000'000'000, time.count() % 1'000'000'000};
  const int ready = ::ppoll(&ended, 1, &deadline, nullptr);
  ::close(ended.fd);
  return ready > 0;
}

Ended GonioProcess::wait() {
  while (read_more()) {
  }
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  Ended ended;
  if (WIFEXITED(status)) ended.exit_code = WEXITSTATUS(status);
  ended.error = error_;
  ::lseek(out_file_, 0, SEEK_SET);
  std::array<char, 65536> bytes{};
  for (ssize_t count = 0; (count = ::read(out_file_, bytes.data(), bytes.size())) > 0;) {
    ended.out.append(bytes.data(), static_cast<std::size_t>(count));
  }
  return ended;
}

Ended run_gonio(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                std::uint64_t max_file_bytes) {
  return GonioProcess(arguments, folder, max_file_bytes).wait();
}

}  // namespace gonio
