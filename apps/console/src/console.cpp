#include "gonio/console/console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "gonio/console/printable.h"
#include "gonio/errors/errors.h"

namespace gonio::cli {
namespace {

constexpr std::string_view kRed = "31";
constexpr std::string_view kYellow = "33";
/// To standard error, as far as it is still there: a reader that went away must never end a
/// measurement.
void print_error(std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::clearerr(stderr);
}

constexpr auto kFirstLineAfter = std::chrono::seconds(2);
constexpr auto kLineEvery = std::chrono::seconds(5);
constexpr double kEstimatedFrom = 0.05;
constexpr auto kDrawEvery = std::chrono::milliseconds(100);

}  // namespace

Console::Console()
    : error_is_terminal_(isatty(STDERR_FILENO) == 1),
      colour_(error_is_terminal_ && std::getenv("NO_COLOR") == nullptr) {}

void Console::result(std::string_view text) const {
  const std::string shown = printable_text(text);
  const bool written = std::fwrite(shown.data(), 1, shown.size(), stdout) == shown.size();
  if (written && std::fflush(stdout) == 0) return;
  const int error = errno;
  std::clearerr(stdout);
  // A reader that has seen enough ("gonio plan | head") is no error.
  if (error != EPIPE) throw FileError("standard output", "write", error);
}

void Console::say(std::string_view line) const {
  if (verbosity >= 0) print_error(printable_line(line) + "\n");
}

void Console::detail(std::string_view line) const {
  if (verbosity >= 1) print_error(printable_line(line) + "\n");
}

void Console::warn(std::string_view line) const {
  if (verbosity < 0) return;
  print_error(fmt::format("{} {}\n", marked("warning:", kYellow), printable_line(line)));
}

void Console::error(std::string_view message, std::string_view hint) const {
  print_error(fmt::format("{} {}\n", marked("gonio:", kRed), printable_line(message)));
  if (!hint.empty() && verbosity >= 0) print_error(fmt::format("  {}\n", printable_line(hint)));
}

std::string Console::marked(std::string_view word, std::string_view colour) const {
  if (!colour_) return std::string(word);
  return fmt::format("\033[{}m{}\033[0m", colour, word);
}

Progress::Progress(const Console& console, std::string_view label)
    : console_(console), label_(printable_line(label)) {
  if (!console_.error_is_terminal()) next_ = start_ + kFirstLineAfter;
}

Progress::~Progress() {
  if (drawn_) print_error(fmt::format("\r\033[K"));
}

void Progress::update(double fraction, std::string_view text) {
  const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
  // What the first steps took says little about the rest.
  const bool known = fraction >= kEstimatedFrom;
  update(fraction, text, known ? elapsed * (1.0 - fraction) / fraction : -1.0);
}

void Progress::update(double fraction, std::string_view text, double remaining_s) {
  if (console_.verbosity < 0) return;
  const Clock::time_point now = Clock::now();
  if (now < next_) return;
  fraction = std::clamp(fraction, 0.0, 1.0);
  const std::string left =
      remaining_s >= 0.0 ? ", " + duration_text(remaining_s) + " left" : std::string();
  const std::string words = text.empty() ? std::string() : " " + printable_line(text);
  if (console_.error_is_terminal()) {
    constexpr int kWidth = 24;
    const int full = static_cast<int>(std::lround(fraction * kWidth));
    print_error(fmt::format("\r\033[K{} [{}{}] {:3.0f} %{}{}", label_, std::string(full, '#'),
                            std::string(kWidth - full, '.'), 100.0 * fraction, words, left));
    std::fflush(stderr);
    drawn_ = true;
    next_ = now + kDrawEvery;
  } else {
    print_error(fmt::format("{}: {:.0f} %{}{}\n", label_, 100.0 * fraction, words, left));
    next_ = now + kLineEvery;
  }
}

PhaseTimer::PhaseTimer(const Console& console, std::string name)
    : console_(console), name_(std::move(name)) {}

PhaseTimer::~PhaseTimer() {
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  console_.detail(fmt::format("  {:<28} {:7.2f} s", name_, seconds));
}

std::string duration_text(double seconds) {
  const long total = std::lround(std::max(0.0, seconds));
  if (total < 60) return fmt::format("{} s", total);
  if (total < 3600) return fmt::format("{} min {} s", total / 60, total % 60);
  return fmt::format("{} h {} min", total / 3600, total % 3600 / 60);
}

}  // namespace gonio::cli
