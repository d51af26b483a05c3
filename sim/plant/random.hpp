#pragma once
// Seeded random numbers that are equal on every machine and standard library. The seed of a stream
// is mixed from the seeds of its owners, so that more draws of one never shift another.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

#include "protocols/base/hash.hpp"

namespace weft::sim {

/// A step of SplitMix64: every bit of the input affects every bit.
constexpr std::uint64_t scramble(std::uint64_t x) {
  return splitmix64_finish(x + splitmix64_gamma);
}

/// The seed of a part; the order of the arguments matters.
constexpr std::uint64_t mix(std::uint64_t whole, std::uint64_t part) {
  return scramble(scramble(whole) ^ (part * 0xD6E8FEB86659FD93ULL));
}

/// FNV-1a, for streams with names.
constexpr std::uint64_t mix(std::uint64_t whole, std::string_view part) {
  return mix(whole, fnv1a(part));
}

/// A sequence of numbers from one seed.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}

  constexpr std::uint64_t bits() {
    state_ += splitmix64_gamma;
    return scramble(state_);
  }
  /// In [0, 1).
  constexpr double uniform() { return uniform_of(bits()); }
  /// The same from 64 random bits; the lowest eleven are not used.
  static constexpr double uniform_of(std::uint64_t bits) {
    // From a signed number, because processors have an instruction for it.
    return static_cast<double>(static_cast<std::int64_t>(bits >> 11)) * 0x1.0p-53;
  }
  constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double angle() { return uniform(0, 2 * std::numbers::pi); }
  /// Mean 0, standard deviation 1 (Box-Muller; the second number is not kept).
  double gaussian() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(angle());
  }

 private:
  std::uint64_t state_;
};

}  // namespace weft::sim
