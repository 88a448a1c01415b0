#include "gonio/monitor/page_token.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <sys/random.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace gonio::monitor {

PageToken::PageToken() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::system_error(errno, std::generic_category(), "getrandom");
  }
  for (const unsigned char byte : bytes) text_ += fmt::format("{:02x}", byte);
}

bool PageToken::is(std::string_view shown) const {
  return shown.size() == text_.size() &&
         ::CRYPTO_memcmp(shown.data(), text_.data(), text_.size()) == 0;
}

}  // namespace gonio::monitor
