#pragma once
// Bytes that a stream splitter keeps between two chunks because they do not make a frame yet.

#include <algorithm>
#include <cstdint>

#include "protocols/base/bytes.hpp"

namespace weft {

/// A byte queue of at most `capacity` bytes: memory stays bounded if no reader drains it. Bytes
/// that become part of no frame are counted.
class StreamBuffer {
 public:
  explicit StreamBuffer(std::size_t capacity) : capacity_(capacity) {}

  /// Returns the number of `bytes` that did not fit; they are skipped.
  std::size_t push(ByteView bytes) {
    bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ = 0;
    const std::size_t fits = std::min(bytes.size(), capacity_ - bytes_.size());
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(fits));
    skipped_bytes_ += bytes.size() - fits;
    return bytes.size() - fits;
  }

  /// Unconsumed bytes; valid until the next push or clear.
  [[nodiscard]] ByteView view() const { return ByteView(bytes_).subspan(at_); }
  void consume(std::size_t count) { at_ += std::min(count, bytes_.size() - at_); }
  /// Consumes bytes that belong to no frame and counts them.
  void skip(std::size_t count) {
    consume(count);
    skipped_bytes_ += count;
  }
  /// Total; clear() does not reset it.
  [[nodiscard]] std::uint64_t skipped_bytes() const { return skipped_bytes_; }
  void clear() {
    bytes_.clear();
    at_ = 0;
  }

 private:
  std::size_t capacity_;
  Bytes bytes_;
  std::size_t at_ = 0;
  std::uint64_t skipped_bytes_ = 0;
};

}  // namespace weft
