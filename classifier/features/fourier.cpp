#include "classifier/features/fourier.hpp"

#include <cmath>
#include <numbers>

namespace weft::classifier::fourier {
namespace {

// exp(-2 pi i part / whole)
template <class Doubles>
void append_turn(Doubles& out, std::size_t part, std::size_t whole) {
  const double angle =
      -2.0 * std::numbers::pi * static_cast<double>(part) / static_cast<double>(whole);
  out.push_back(std::cos(angle));
  out.push_back(std::sin(angle));
}

}  // namespace

simd::AlignedDoubles twiddles(std::size_t radix, std::size_t part) {
  simd::AlignedDoubles out;
  out.reserve(2 * (radix - 1) * part + 2 * part);
  for (std::size_t j = 0; j < part; ++j)
    for (std::size_t power = 1; power < radix; ++power) append_turn(out, power * j, radix * part);
  for (; part >= 4; part /= 4)
    for (std::size_t j = 0; j < part / 4; ++j)
      for (std::size_t power = 1; power <= 3; ++power) append_turn(out, power * j, part);
  return out;
}

std::vector<double> roots_of_unity(std::size_t radix) {
  std::vector<double> out;
  for (std::size_t k = 0; k < radix; ++k) append_turn(out, radix - k, radix);
  for (double& v : out) v = std::abs(v) < 1e-12 ? 0.0 : v;
  return out;
}

std::vector<std::uint32_t> places(std::size_t size) {
  std::vector<std::uint32_t> out(size);
  for (std::size_t p = 0; p < size; ++p) {
    std::size_t bin = 0, at = p, stride = 1;
    for (std::size_t part = size; part > 1; part /= part == 2 ? 2 : 4) {
      const std::size_t share = part == 2 ? 1 : part / 4;
      bin += stride * (at / share);
      at %= share;
      stride *= 4;
    }
    out[bin] = static_cast<std::uint32_t>(p);
  }
  return out;
}

}  // namespace weft::classifier::fourier
