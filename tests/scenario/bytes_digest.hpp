#pragma once
// Used by same_bytes.cc and learnt_bytes.cc: one digest of the bits of many numbers.

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include "protocols/base/result.hpp"

namespace weft::testing {

/// FNV-1a over the bits of numbers, low byte first, and over text.
class Digest {
 public:
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(std::uint64_t bits) {
    for (int i = 0; i < 8; ++i) add_byte((bits >> (8 * i)) & 0xFF);
  }
  void add(std::string_view text) {
    for (const char c : text) add_byte(static_cast<unsigned char>(c));
  }
  void print(const std::string& what) const {
    std::printf("%-28s %016llx\n", what.c_str(), static_cast<unsigned long long>(hash_));
  }

 private:
  void add_byte(std::uint64_t byte) { hash_ = (hash_ ^ byte) * 0x100000001B3ULL; }
  std::uint64_t hash_ = 0xCBF29CE484222325ULL;
};

/// The value of a call that cannot fail here.
template <class T>
T expected(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", to_string(result.error()).c_str());
    std::exit(2);
  }
  return std::move(*result);
}

}  // namespace weft::testing
