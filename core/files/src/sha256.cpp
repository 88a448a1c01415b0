#include "gonio/files/sha256.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>

#include <array>
#include <stdexcept>
#include <vector>

#include "gonio/files/input_file.h"

namespace gonio::files {
namespace {

/// In the main thread, before any other: OpenSSL sets itself up at its first use, and what it then
/// keeps for a thread of a pool is never freed, since that thread lives until the process ends. No
/// configuration file is needed for a digest.
[[maybe_unused]] const int kOpensslIsReady =
    OPENSSL_init_crypto(OPENSSL_INIT_NO_LOAD_CONFIG, nullptr);

void check(int result) {
  if (result != 1) throw std::runtime_error("SHA-256: OpenSSL refused");
}

}  // namespace

struct Sha256::Context {
  struct Free {
    void operator()(EVP_MD_CTX* context) const noexcept { EVP_MD_CTX_free(context); }
  };
  std::unique_ptr<EVP_MD_CTX, Free> evp{EVP_MD_CTX_new()};
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {
  check(context_->evp ? 1 : 0);
  check(EVP_DigestInit_ex(context_->evp.get(), EVP_sha256(), nullptr));
}

Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

void Sha256::update(std::span<const std::byte> bytes) {
  check(EVP_DigestUpdate(context_->evp.get(), bytes.data(), bytes.size()));
}

void Sha256::update(std::string_view text) { update(std::as_bytes(std::span(text))); }

std::string Sha256::finish() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  check(EVP_DigestFinal_ex(context_->evp.get(), digest.data(), &size));
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string hex;
  hex.reserve(2 * std::size_t{size});
  for (const unsigned char byte : std::span(digest).first(size)) {
    hex += kDigits[byte >> 4U];
    hex += kDigits[byte & 15U];
  }
  return hex;
}

std::string sha256_of_file(const std::filesystem::path& path) {
  InputFile file(path);
  Sha256 sum;
  std::vector<std::byte> buffer(std::size_t{1} << 20U);
  while (const std::size_t count = file.read_some(buffer)) {
    sum.update(std::span(buffer).first(count));
  }
  return sum.finish();
}

std::string sha256_of_bytes(std::span<const std::byte> bytes) {
  Sha256 sum;
  sum.update(bytes);
  return sum.finish();
}

std::string sha256_of_bytes(std::string_view bytes) {
  return sha256_of_bytes(std::as_bytes(std::span(bytes)));
}

}  // namespace gonio::files
