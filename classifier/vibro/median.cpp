#include "classifier/vibro/median.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace weft::classifier::vibro {
namespace {

constexpr std::size_t cells = 1024;
constexpr std::size_t few = 64;  // are looked through as they are

using At = std::ptrdiff_t;

// Where a value lies between the smallest and the largest; never falls as the value rises.
struct Ruler {
  double low = 0.0, scale = 0.0;

  // Halves, so that the range of the largest numbers does not overflow.
  Ruler(double smallest, double largest)
      : low(0.5 * smallest),
        scale(static_cast<double>(cells - 1) / (0.5 * largest - 0.5 * smallest)) {}
  [[nodiscard]] bool usable() const { return std::isfinite(scale) && scale > 0.0; }
  [[nodiscard]] std::size_t cell(double value) const {
    return std::min(cells - 1, static_cast<std::size_t>((0.5 * value - low) * scale));
  }
};

}  // namespace

MedianFinder::Pair MedianFinder::by_counting(std::span<const double> values, std::size_t rank) {
  double low = values.front(), high = low;
  for (const double v : values) {
    low = v < low ? v : low;
    high = v > high ? v : high;
  }
  if (low == high) return {low, low};
  const Ruler ruler(low, high);
  std::size_t before = 0;
  candidates_.clear();
  if (values.size() <= few || !ruler.usable()) {
    candidates_.assign(values.begin(), values.end());
  } else {
    count_.assign(cells, 0);
    for (const double v : values) ++count_[ruler.cell(v)];
    std::size_t first = 0;
    while (before + count_[first] <= rank) before += count_[first++];
    std::size_t last = first, reached = before + count_[first];
    while (reached <= rank + 1 && last + 1 < cells) reached += count_[++last];
    for (const double v : values)
      if (const std::size_t c = ruler.cell(v); c >= first && c <= last) candidates_.push_back(v);
  }
  const auto middle = candidates_.begin() + static_cast<At>(rank - before);
  std::nth_element(candidates_.begin(), middle, candidates_.end());
  return {*middle, middle + 1 == candidates_.end()
                       ? *middle
                       : *std::min_element(middle + 1, candidates_.end())};
}

double MedianFinder::median(std::span<const double> values) {
  if (values.empty()) return 0.0;
  const Pair pair = by_counting(values, (values.size() - 1) / 2);
  return values.size() % 2 == 1 ? pair.at : 0.5 * pair.at + 0.5 * pair.next;
}

}  // namespace weft::classifier::vibro
