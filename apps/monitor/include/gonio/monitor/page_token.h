#pragma once

#include <string>
#include <string_view>

namespace gonio::monitor {

/// What a page has to show before it may pause or stop a session: 128 random bits, new with every
/// object, that the program tells its user and nobody else.
///
/// Threads  const, may be shared.
/// Errors   std::system_error when the system has no random numbers.
class PageToken {
 public:
  PageToken();

  /// 32 hexadecimal digits.
  const std::string& text() const { return text_; }
  /// Takes the same time wherever the first wrong character stands.
  bool is(std::string_view shown) const;

 private:
  std::string text_;
};

}  // namespace gonio::monitor
