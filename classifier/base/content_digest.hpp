#pragma once
// A number for comparing the samples of two recordings.

#include <bit>
#include <cstdint>
#include <span>

#include "protocols/base/hash.hpp"

namespace weft::classifier {

/// A 64-bit digest of the values added, in order. Equal contents give equal digests on every
/// machine. Two of a million different contents agree with a probability below 1e-7. The digest
/// gives no protection against forgery.
class ContentDigest {
 public:
  void add(std::uint64_t word) { value_ = splitmix64_finish((value_ ^ word) + splitmix64_gamma); }
  /// Adds the exact bits of the samples; -0 counts as 0.
  void add(std::span<const double> samples) {
    add(samples.size());
    for (const double sample : samples) add(std::bit_cast<std::uint64_t>(sample + 0.0));
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

}  // namespace weft::classifier
