#pragma once
// splitmix64 (Steele, Lea and Flood 2014): the same numbers with every standard library, unlike
// std::shuffle and the distributions of <random>.

#include <cstdint>

namespace weft::recipes {

constexpr std::uint64_t splitmix64_gamma = 0x9e3779b97f4a7c15;

constexpr std::uint64_t splitmix64_finish(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

constexpr std::uint64_t next_splitmix64(std::uint64_t& state) {
  state += splitmix64_gamma;
  return splitmix64_finish(state);
}

}  // namespace weft::recipes
