#pragma once
// Which choices are worth considering when more of one thing costs more of another.

#include <cstddef>
#include <span>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// What a choice brings (more is better) and what it costs (less is better).
struct TradeoffChoice {
  double gain = 0;
  double cost = 0;
};

/// The Pareto front: indices of all choices that no other one dominates, by rising cost (equal cost
/// means equal gain there; those in the order given). A choice dominates another when it gains at
/// least as much for at most the cost, and is better in one of the two. Choices equal in both do
/// not dominate each other, so all of them are on the front or none. Refuses a gain or cost that is
/// not finite, by its index. O(n log n).
Result<std::vector<std::size_t>> pareto_front(std::span<const TradeoffChoice> choices);

}  // namespace weft::daemon
