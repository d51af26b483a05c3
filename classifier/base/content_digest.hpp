#pragma once
// A number that tells whether two recordings hold the same samples.

#include <bit>
#include <cstdint>
#include <span>

#include "protocols/base/hash.hpp"

namespace weft::classifier {

/// 64 bits of everything added, in order: equal contents give equal digests on every machine; of a
/// million unlike ones two agree with a probability below 1e-7. Not made against forgery.
class ContentDigest {
 public:
  void add(std::uint64_t word) { value_ = splitmix64_finish((value_ ^ word) + splitmix64_gamma); }
  /// Bit for bit, but -0 counts as 0.
  void add(std::span<const double> samples) {
    add(samples.size());
    for (const double sample : samples) add(std::bit_cast<std::uint64_t>(sample + 0.0));
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

}  // namespace weft::classifier
