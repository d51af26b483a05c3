#include "daemon/analysis/tradeoff/tradeoff_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

Status check(const TradeoffSet& set, const TradeoffPoint& point, double cost_s) {
  if (point.bench != set.bench)
    return fail({.code = Errc::invalid_argument,
                 .where = point.name,
                 .what = "a point of another bench than its data set",
                 .expected = std::string(to_string(set.bench)),
                 .got = std::string(to_string(point.bench)),
                 .hint = "Real and simulated data have pictures of their own"});
  for (const double value : {point.accuracy, point.ci95.low, point.ci95.high})
    if (!(value >= 0 && value <= 1))
      return fail({.code = Errc::range,
                   .where = point.name,
                   .what = "an accuracy must be a share",
                   .expected = "0 to 1",
                   .got = std::to_string(value)});
  if (!(cost_s > 0) || !std::isfinite(cost_s))
    return fail({.code = Errc::range,
                 .where = point.name,
                 .what = "a time must be positive and finite",
                 .got = std::to_string(cost_s) + " s"});
  return {};
}

}  // namespace

Result<std::vector<std::size_t>> find_front(const TradeoffSet& set, const TradeoffCost& cost) {
  if (set.points.empty())
    return fail(
        {.code = Errc::invalid_argument, .where = set.dataset, .what = "no point to compare"});
  std::vector<TradeoffChoice> choices;
  for (const TradeoffPoint& point : set.points) {
    if (Status ok = check(set, point, point.*cost.seconds); !ok) return pass(ok.error());
    choices.push_back({point.accuracy, point.*cost.seconds});
  }
  return pareto_front(choices);
}

std::vector<std::string> list_families(std::span<const TradeoffSet> sets) {
  std::vector<std::string> out;
  for (const TradeoffSet& set : sets)
    for (const TradeoffPoint& point : set.points)
      if (std::ranges::find(out, point.family) == out.end()) out.push_back(point.family);
  return out;
}

std::string format_text(const Setting& setting) {
  const auto* number = std::get_if<double>(&setting.second);
  return number == nullptr ? std::get<std::string>(setting.second) : general(*number);
}

double compute_median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

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
