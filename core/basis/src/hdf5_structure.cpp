#include "hdf5_structure.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gonio/errors/errors.h"
#include "gonio/files/input_file.h"

namespace gonio::basis::detail {
namespace {

constexpr std::string_view kSignature("\x89HDF\r\n\x1a\n", 8);
constexpr std::uint64_t kUndefined = ~std::uint64_t{0};

/// Of the headers of all objects together; ours take a few thousand bytes.
constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 20U;

/// Types of messages in an object header.
enum MessageType : unsigned {
  kNil = 0x00,
  kDataspace = 0x01,
  kLinkInfo = 0x02,
  kDatatype = 0x03,
  kFillValue = 0x05,
  kLink = 0x06,
  kLayout = 0x08,
  kGroupInfo = 0x0a,
  kAttribute = 0x0c,
  kContinuation = 0x10,
  kAttributeInfo = 0x15,
};

struct Message {
  unsigned type;
  std::vector<std::byte> data;
};

class Structure {
 public:
  explicit Structure(const std::filesystem::path& path) : path_(path), file_(path) {}

  void check() {
    for (const Message& message : messages(root_address())) check_of_root(message);
    for (const auto& [place, address] : data_sets_) {
      for (const Message& message : messages(address)) check_of_data_set(message, place);
    }
  }

 private:
  /// Little-endian numbers one after the other; ends where a message does.
  class Cursor {
   public:
    Cursor(const Structure& structure, std::span<const std::byte> bytes, std::string place)
        : structure_(structure), bytes_(bytes), place_(std::move(place)) {}

    std::uint64_t number(std::size_t size) {
      std::uint64_t value = 0;
      const auto from = take(size);
      for (std::size_t i = size; i-- > 0;) value = value << 8U | std::to_integer<unsigned>(from[i]);
      return value;
    }
    std::span<const std::byte> take(std::size_t size) {
      if (size > bytes_.size()) structure_.fail(place_, "a header ends too early");
      const auto taken = bytes_.first(size);
      bytes_ = bytes_.subspan(size);
      return taken;
    }
    std::size_t left() const { return bytes_.size(); }

   private:
    const Structure& structure_;
    std::span<const std::byte> bytes_;
    std::string place_;
  };

  static std::string byte(std::uint64_t address) { return "byte " + std::to_string(address); }

  [[noreturn]] void fail(const std::string& place, const std::string& message) const {
    throw DataFormatError(path_, place, message);
  }
  [[noreturn]] void fail_as_not_ours(const std::string& place, const std::string& found) const {
    fail(place, "found " + found +
                    ", expected what gonio writes: of an earlier gonio or another program, train "
                    "again");
  }

  std::vector<std::byte> block(std::uint64_t address, std::uint64_t size) {
    if (address > file_.size() || size > file_.size() - address) {
      fail(byte(address), "a header lies beyond the end of the file");
    }
    if (size > kMostHeaderBytes - header_bytes_) fail(byte(address), "the headers are too long");
    header_bytes_ += static_cast<std::size_t>(size);
    std::vector<std::byte> bytes(static_cast<std::size_t>(size));
    file_.read_at(address, bytes);
    return bytes;
  }

  std::uint64_t root_address() {
    std::array<char, kSignature.size() + 1> head{};
    // The library would find a signature behind a block of another program's, too.
    if (file_.read_some(std::as_writable_bytes(std::span(head))) < head.size() ||
        std::string_view(head.data(), kSignature.size()) != kSignature) {
      throw DataFormatError(path_, "file", "not a readable HDF5 file, expected a gonio basis");
    }
    const int version = static_cast<unsigned char>(head.back());
    if (version != 2 && version != 3) {
      fail_as_not_ours("superblock", "version " + std::to_string(version) +
                                         (version < 2 ? " without checksums" : ""));
    }
    constexpr std::size_t kSuperblock = 48;
    const std::vector<std::byte> bytes = block(0, kSuperblock);
    Cursor cursor(*this, std::span(bytes).subspan(head.size()), "superblock");
    const auto offset_size = cursor.number(1);
    const auto length_size = cursor.number(1);
    cursor.take(1);  // flags of writers
    const auto base = cursor.number(8);
    const auto extension = cursor.number(8);
    cursor.take(8);  // end of the file
    if (offset_size != 8 || length_size != 8 || base != 0) {
      fail_as_not_ours("superblock", "addresses of another form");
    }
    if (extension != kUndefined) fail_as_not_ours("superblock", "an extension");
    return cursor.number(8);
  }

  /// All messages of an object, those in continuation blocks too.
  std::vector<Message> messages(std::uint64_t address) {
    constexpr std::size_t kLongestPrefix = 4 + 2 + 16 + 4 + 8;
    constexpr unsigned kTimes = 0x20;
    constexpr unsigned kPhaseChange = 0x10;
    const std::uint64_t in_file = file_.size() - std::min<std::uint64_t>(address, file_.size());
    const std::vector<std::byte> prefix =
        block(address, std::min<std::uint64_t>(kLongestPrefix, in_file));
    Cursor cursor(*this, prefix, byte(address));
    if (cursor.number(4) != 0x5244484f || cursor.number(1) != 2) {  // "OHDR"
      fail_as_not_ours(byte(address), "no object header of version 2");
    }
    const auto flags = static_cast<unsigned>(cursor.number(1));
    if ((flags & kTimes) != 0) cursor.take(16);
    if ((flags & kPhaseChange) != 0) cursor.take(4);
    const std::uint64_t size = cursor.number(std::size_t{1} << (flags & 3U));
    std::vector<Message> found;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> continuations;
    const std::uint64_t begin = address + prefix.size() - cursor.left();
    add_messages(begin, block(begin, size), flags, found, continuations);
    while (!continuations.empty()) {
      const auto [at, length] = continuations.back();
      continuations.pop_back();
      constexpr std::size_t kAround = 4;  // signature and checksum
      const std::vector<std::byte> bytes = block(at, length);
      Cursor next(*this, bytes, byte(at));
      if (bytes.size() < 2 * kAround || next.number(kAround) != 0x4b48434f) {  // "OCHK"
        fail(byte(at), "found no continuation of a header");
      }
      add_messages(at + kAround, {bytes.begin() + kAround, bytes.end() - kAround}, flags, found,
                   continuations);
    }
    return found;
  }

  void add_messages(std::uint64_t address, const std::vector<std::byte>& bytes, unsigned flags,
                    std::vector<Message>& found,
                    std::vector<std::pair<std::uint64_t, std::uint64_t>>& continuations) const {
    constexpr unsigned kCreationOrder = 0x04;
    const std::size_t head = (flags & kCreationOrder) != 0 ? 6 : 4;
    Cursor cursor(*this, bytes, byte(address));
    while (cursor.left() >= head) {  // fewer are a gap
      Message message{static_cast<unsigned>(cursor.number(1)), {}};
      const auto size = static_cast<std::size_t>(cursor.number(2));
      const auto message_flags = static_cast<unsigned>(cursor.number(1));
      cursor.take(head - 4);
      const auto data = cursor.take(size);
      if (message.type == kContinuation) {
        Cursor place(*this, data, byte(address));
        const std::uint64_t at = place.number(8);
        continuations.emplace_back(at, place.number(8));
        continue;
      }
      constexpr unsigned kShared = 0x02;
      if ((message_flags & kShared) != 0) fail_as_not_ours(byte(address), "a shared message");
      message.data.assign(data.begin(), data.end());
      found.push_back(std::move(message));
    }
  }

  void check_of_root(const Message& message) {
    const std::string place = "root group";
    switch (message.type) {
      case kNil:
      case kGroupInfo:
        return;
      case kAttribute:
        return require_plain_attribute(message, place);
      case kLinkInfo:
        return require_no_heap(message, 8, place);
      case kAttributeInfo:
        return require_no_heap(message, 2, place);
      case kLink:
        return add_link(message, place);
      default:
        fail_as_not_ours(place, "a message of type " + std::to_string(message.type));
    }
  }

  void check_of_data_set(const Message& message, const std::string& place) const {
    switch (message.type) {
      case kNil:
      case kDataspace:
      case kFillValue:
        return;
      case kDatatype: {
        Cursor cursor(*this, message.data, place);
        return require_plain_type(cursor, place);
      }
      case kAttribute:
        return require_plain_attribute(message, place);
      case kAttributeInfo:
        return require_no_heap(message, 2, place);
      case kLayout: {
        constexpr std::uint64_t kContiguous = 1;
        Cursor cursor(*this, message.data, place);
        if (cursor.number(1) < 3) fail_as_not_ours(place, "an old layout");
        if (cursor.number(1) != kContiguous) {
          fail(place, "is not stored contiguously (h5repack -l CONTI makes it so)");
        }
        return;
      }
      default:
        fail_as_not_ours(place, "a message of type " + std::to_string(message.type));
    }
  }

  /// `order_size`  Of the creation order that links or attributes may have.
  void require_no_heap(const Message& message, std::size_t order_size,
                       const std::string& place) const {
    Cursor cursor(*this, message.data, place);
    cursor.take(1);  // version
    const auto flags = static_cast<unsigned>(cursor.number(1));
    if ((flags & 1U) != 0) cursor.take(order_size);
    const int addresses = (flags & 2U) != 0 ? 3 : 2;  // heap, names, creation order
    for (int i = 0; i < addresses; ++i) {
      if (cursor.number(8) != kUndefined) {
        fail_as_not_ours(place,
                         message.type == kLinkInfo ? "links in a heap" : "attributes in a heap");
      }
    }
  }

  void require_plain_attribute(const Message& attribute, const std::string& place) const {
    Cursor cursor(*this, attribute.data, place);
    const std::uint64_t version = cursor.number(1);
    if (version < 2 || cursor.number(1) != 0) {
      fail_as_not_ours(place, "an attribute of a shared type");
    }
    const auto name_size = static_cast<std::size_t>(cursor.number(2));
    cursor.take(2 + 2);                // sizes of type and space
    if (version >= 3) cursor.take(1);  // character set
    cursor.take(name_size);
    require_plain_type(cursor, place);
  }

  void require_plain_type(Cursor& cursor, const std::string& place) const {
    constexpr std::array<std::uint64_t, 3> kPlain{0, 1, 3};  // whole numbers, floats, texts
    constexpr std::uint64_t kVariable = 9;
    const std::uint64_t type = cursor.number(1) & 0xfU;
    if (type == kVariable) fail_as_not_ours(place, "a text of variable length");
    if (std::find(kPlain.begin(), kPlain.end(), type) == kPlain.end()) {
      fail_as_not_ours(place, "a type of class " + std::to_string(type));
    }
  }

  void add_link(const Message& message, const std::string& place) {
    Cursor cursor(*this, message.data, place);
    cursor.take(1);  // version
    const auto flags = static_cast<unsigned>(cursor.number(1));
    const std::uint64_t type = (flags & 0x08U) != 0 ? cursor.number(1) : 0;
    if ((flags & 0x04U) != 0) cursor.take(8);  // creation order
    if ((flags & 0x10U) != 0) cursor.take(1);  // character set
    const auto name =
        cursor.take(static_cast<std::size_t>(cursor.number(std::size_t{1} << (flags & 3U))));
    constexpr std::uint64_t kHard = 0;
    if (type != kHard) return;
    const std::uint64_t address = cursor.number(8);
    const std::string_view text(reinterpret_cast<const char*>(name.data()), name.size());
    constexpr std::size_t kLongestName = 64;
    const bool short_and_plain =
        text.size() <= kLongestName && std::all_of(text.begin(), text.end(), [](char letter) {
          return letter >= ' ' && letter <= '~';
        });
    data_sets_.emplace_back(short_and_plain ? std::string(text) : byte(address), address);
  }

  std::filesystem::path path_;
  files::InputFile file_;
  std::size_t header_bytes_ = 0;
  std::vector<std::pair<std::string, std::uint64_t>> data_sets_;  ///< place and address
};

}  // namespace

void require_plain_structure(const std::filesystem::path& path) { Structure(path).check(); }

}  // namespace gonio::basis::detail
