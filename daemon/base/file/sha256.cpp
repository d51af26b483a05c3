#include "daemon/base/file/sha256.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

Sha256Compress fastest() {
  const Sha256Compress accelerated = sha256_compress_accelerated();
  return accelerated != nullptr ? accelerated : sha256_compress_portable;
}

}  // namespace

Sha256::Sha256() : Sha256(fastest()) {}

Sha256& Sha256::update(ByteView bytes) {
  total_bytes_ += bytes.size();
  if (held_ > 0) {
    const std::size_t taken = std::min(bytes.size(), block_.size() - held_);
    std::copy_n(bytes.begin(), taken, block_.begin() + static_cast<std::ptrdiff_t>(held_));
    held_ += taken;
    bytes = bytes.subspan(taken);
    if (held_ < block_.size()) return *this;
    compress_(state_, block_.data(), 1);
    held_ = 0;
  }
  const std::size_t whole_blocks = bytes.size() / block_.size();
  compress_(state_, bytes.data(), whole_blocks);
  bytes = bytes.subspan(whole_blocks * block_.size());
  std::ranges::copy(bytes, block_.begin());
  held_ = bytes.size();
  return *this;
}

Sha256& Sha256::text(std::string_view characters) {
  return update({reinterpret_cast<const std::uint8_t*>(characters.data()), characters.size()});
}

/// Section 5.1.1: a one bit, zeros up to 56 bytes of the last block, the length in bits.
void Sha256::pad(std::uint64_t message_bytes) {
  std::array<std::uint8_t, 72> tail{0x80};
  const std::size_t zeros_end = (held_ < 56 ? 56 : 120) - held_;
  for (std::size_t i = 0; i < 8; ++i)
    tail[zeros_end + i] = static_cast<std::uint8_t>((message_bytes * 8) >> (56 - 8 * i));
  update(std::span(tail).first(zeros_end + 8));
}

Sha256Digest Sha256::finish() {
  pad(total_bytes_);
  Sha256Digest digest;
  for (std::size_t i = 0; i < digest.size(); ++i)
    digest[i] = static_cast<std::uint8_t>(state_[i / 4] >> (24 - 8 * (i % 4)));
  return digest;
}

std::string to_hex(const Sha256Digest& digest) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : digest) {
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

std::string sha256_hex(std::string_view text) {
  return to_hex(Sha256().text(text).finish());
}

}  // namespace weft::daemon
