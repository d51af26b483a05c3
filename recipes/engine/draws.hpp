#pragma once
// Random numbers from seeds. They are equal with every standard library, unlike std::shuffle and
// the distributions of <random>.

#include <cstdint>

#include "protocols/base/hash.hpp"

namespace weft::recipes {

constexpr std::uint64_t next_splitmix64(std::uint64_t& state) {
  state += splitmix64_gamma;
  return splitmix64_finish(state);
}

}  // namespace weft::recipes
