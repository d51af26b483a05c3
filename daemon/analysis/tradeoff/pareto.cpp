#include "daemon/analysis/tradeoff/pareto.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace weft::daemon {

Result<std::vector<std::size_t>> pareto_front(std::span<const TradeoffChoice> choices) {
  for (std::size_t i = 0; i < choices.size(); ++i)
    if (!std::isfinite(choices[i].gain) || !std::isfinite(choices[i].cost))
      return fail(
          {.code = Errc::invalid_argument,
           .where = "choice " + std::to_string(i),
           .what = "gain and cost must be finite",
           .got = std::to_string(choices[i].gain) + " for " + std::to_string(choices[i].cost)});
  std::vector<std::size_t> order(choices.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    if (choices[a].cost != choices[b].cost) return choices[a].cost < choices[b].cost;
    return choices[a].gain > choices[b].gain;
  });
  std::vector<std::size_t> front;
  double most = -std::numeric_limits<double>::infinity();  // gain of all that cost less
  for (const std::size_t i : order) {
    const TradeoffChoice& choice = choices[i];
    const bool duplicate = !front.empty() && choices[front.back()].cost == choice.cost &&
                           choices[front.back()].gain == choice.gain;
    if (choice.gain > most || duplicate) front.push_back(i);
    most = std::max(most, choice.gain);
  }
  return front;
}

}  // namespace weft::daemon
