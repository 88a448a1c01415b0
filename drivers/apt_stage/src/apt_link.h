#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "gonio/apt_stage/apt_decoder.h"
#include "gonio/usb_bus/byte_stream.h"

namespace gonio::apt_stage {

/// Questions and answers with one unit, and what it says unasked.
///
/// Retries  A question is asked up to kAttempts times when no answer or a broken one comes; what
///          moves is sent once. Answers carry no number: after one that stayed away, what comes
///          within kLate is thrown away before the question is repeated, and of the answers to the
///          repetition the last within kLate counts.
/// Bounds   Nothing here takes longer than its own deadlines on a line that never falls silent.
/// Threads  send() from any thread; the rest belongs to the controlling one.
class AptLink {
 public:
  static constexpr int kAttempts = 3;
  static constexpr std::chrono::milliseconds kAnswer{250};  ///< for one answer, host time
  static constexpr std::chrono::milliseconds kLate{100};    ///< how late an answer may be, as well
  static constexpr std::chrono::milliseconds kDrain{50};    ///< for what is there unasked
  static constexpr std::size_t kMostUnasked = 4096;         ///< bytes of it, at once
  /// The unit falls silent after 50 status messages without an acknowledgement (issue 25,
  /// MOT_ACK_DCSTATUSUPDATE), whoever asked for them: acknowledge() before the first question.
  static constexpr int kAcknowledgeAfter = 10;

  /// What came unasked since forget().
  struct Notices {
    bool homed = false;
    bool completed = false;
    bool stopped = false;
  };

  explicit AptLink(std::shared_ptr<usb_bus::ByteStream> port) : port_(std::move(port)) {}

  usb_bus::ByteStream& port() { return *port_; }

  void send(const Bytes& bytes) { port_->write(bytes); }

  /// Throws Timeout (nothing came), Protocol (something broken did), Disconnected.
  Message ask(const Bytes& question, MessageId answer);
  StatusUpdate ask_status();
  /// So that the unit goes on answering ask_status(), which does this by itself from then on.
  void acknowledge();

  /// Reads what has come, within kDrain and kMostUnasked, and forgets all notices, so that what is
  /// told from now on belongs to the command that follows.
  void forget();
  const Notices& notices() const { return notices_; }

  /// Throws away what has come and what is half read: the next message begins with the next byte.
  void resynchronise();

  /// After a reconnection nothing of what was half read is left.
  void reset();

 private:
  Message ask_once(const Bytes& question, MessageId answer);
  void drain();
  void let_pass_what_is_late();
  std::size_t receive(std::chrono::milliseconds deadline);
  std::optional<Message> next();

  std::shared_ptr<usb_bus::ByteStream> port_;
  AptDecoder decoder_;
  Notices notices_;
  int unacknowledged_ = 0;
  bool answer_is_late_ = false;  ///< one to an earlier question may still come
};

}  // namespace gonio::apt_stage
