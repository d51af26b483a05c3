#pragma once
// Seeds from texts: equal on every machine and with every standard library, unlike std::hash.
// FNV-1a 64, and splitmix64 (Steele, Lea and Flood 2014).

#include <cstdint>
#include <string_view>

namespace weft {

constexpr std::uint64_t splitmix64_gamma = 0x9e3779b97f4a7c15;

/// Every input bit affects every output bit.
constexpr std::uint64_t splitmix64_finish(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

constexpr std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) {
    hash ^= static_cast<std::uint8_t>(c);
    hash *= 0x100000001b3;
  }
  return hash;
}

/// FNV-1a alone leaves the high bits of short texts poorly mixed.
constexpr std::uint64_t seed_of(std::string_view key) {
  return splitmix64_finish(fnv1a(key) + splitmix64_gamma);
}

}  // namespace weft
