#include "apt_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace gonio::apt_stage {

using devices::DeviceErrc;
using devices::DeviceError;
using Wall = std::chrono::steady_clock;

Message AptLink::ask(const Bytes& question, MessageId answer) {
  for (int attempt = 1;; ++attempt) {
    try {
      return ask_once(question, answer);
    } catch (const DeviceError& error) {
      const bool may_help =
          error.code() == DeviceErrc::Timeout || error.code() == DeviceErrc::Protocol;
      answer_is_late_ = may_help;
      if (!may_help || attempt == kAttempts) throw;
    }
  }
}

Message AptLink::ask_once(const Bytes& question, MessageId answer) {
  if (answer_is_late_) {
    let_pass_what_is_late();
  } else {
    drain();
  }
  const std::size_t skipped = decoder_.skipped();
  port_->write(question);
  Wall::time_point end = Wall::now() + kAnswer;
  std::optional<Message> found;
  do {
    receive(std::chrono::ceil<std::chrono::milliseconds>(end - Wall::now()));
    while (std::optional<Message> message = next()) {
      if (!message->is(answer) || !is_of_our_channel(*message)) continue;
      if (!answer_is_late_) return *message;
      if (!found) end = Wall::now() + kLate;  // it may be the late one
      found = std::move(message);
    }
  } while (Wall::now() < end);
  if (found) {
    answer_is_late_ = false;
    return *found;
  }
  const std::size_t broken = decoder_.pending() + decoder_.skipped() - skipped;
  const auto id = static_cast<unsigned>(answer);
  if (broken == 0) {
    throw DeviceError(DeviceErrc::Timeout, port_->name(),
                      fmt::format("no answer {:#06x} within {} ms; is the stage switched on?", id,
                                  kAnswer.count()));
  }
  throw DeviceError(DeviceErrc::Protocol, port_->name(),
                    fmt::format("{} bytes came that are no whole answer {:#06x}", broken, id));
}

StatusUpdate AptLink::ask_status() {
  const Message answer = ask(request_status(), MessageId::MOT_GET_DCSTATUSUPDATE);
  if (unacknowledged_ >= kAcknowledgeAfter) acknowledge();
  return status_update(answer).value();  // its length was checked by the decoder
}

void AptLink::acknowledge() {
  send(acknowledge_status());
  unacknowledged_ = 0;
}

void AptLink::forget() {
  drain();
  notices_ = {};
}

void AptLink::drain() {
  const Wall::time_point end = Wall::now() + kDrain;
  std::size_t drained = 0;
  while (drained < kMostUnasked && Wall::now() < end) {
    const std::size_t count = receive(std::chrono::milliseconds(0));
    if (count == 0) break;
    drained += count;
  }
  while (next()) {
  }
}

/// What the unit tells of its own accord is noted all the same.
void AptLink::let_pass_what_is_late() {
  const Wall::time_point end = Wall::now() + kLate;
  try {
    do {
      receive(std::chrono::ceil<std::chrono::milliseconds>(end - Wall::now()));
      while (next()) {
      }
    } while (Wall::now() < end);
  } catch (const DeviceError& error) {
    // A line that garbles is for the question to find out.
    if (error.code() == DeviceErrc::Disconnected) throw;
  }
  resynchronise();
}

void AptLink::reset() {
  decoder_.clear();
  notices_ = {};
  unacknowledged_ = 0;
  answer_is_late_ = false;
}

std::size_t AptLink::receive(std::chrono::milliseconds deadline) {
  std::array<std::uint8_t, 512> bytes{};
  const std::size_t count = port_->read(bytes, std::max(deadline, std::chrono::milliseconds(0)));
  decoder_.feed(std::span(bytes).first(count));
  return count;
}

std::optional<Message> AptLink::next() {
  std::optional<Message> message = decoder_.next();
  if (!message || !is_of_our_channel(*message)) return message;
  if (message->is(MessageId::MOT_MOVE_HOMED)) notices_.homed = true;
  if (message->is(MessageId::MOT_MOVE_COMPLETED)) notices_.completed = true;
  if (message->is(MessageId::MOT_MOVE_STOPPED)) notices_.stopped = true;
  if (status_update(*message)) ++unacknowledged_;
  return message;
}

void AptLink::resynchronise() {
  port_->purge();
  decoder_.clear();
}

}  // namespace gonio::apt_stage
