#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/tradeoff_page.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

constexpr int schema_version = 1;

ordered_json number_json(double value) {
  constexpr double most = 1e15;  // whole numbers up to here look like whole numbers
  if (std::nearbyint(value) == value && std::abs(value) < most)
    return static_cast<std::int64_t>(value);
  return value;
}

ordered_json settings_json(const std::vector<Setting>& settings) {
  ordered_json out = ordered_json::object();
  for (const auto& [name, value] : settings) {
    const double* number = std::get_if<double>(&value);
    out[name] =
        number != nullptr ? number_json(*number) : ordered_json(std::get<std::string>(value));
  }
  return out;
}

ordered_json point_json(const TradeoffPoint& p) {
  return {{"name", p.name},
          {"family", p.family},
          {"settings", settings_json(p.settings)},
          {"bench", to_string(p.bench)},
          {"accuracy", p.accuracy},
          {"ci95", {p.ci95.low, p.ci95.high}},
          {"ci95_method", p.ci95.method},
          {"tested", p.tested},
          {"answer_s", p.answer_s},
          {"features_s", p.features_s},
          {"vote_s", p.vote_s},
          {"timings_s", p.timings_s},
          {"contact_s", p.contact_s},
          {"train_s", p.train_s},
          {"front", ordered_json::object()}};
}

Result<ordered_json> set_json(const TradeoffSet& set, const std::vector<TradeoffCost>& costs) {
  ordered_json out = {{"dataset", set.dataset},
                      {"dataset_sha256", set.sha256},
                      {"bench", to_string(set.bench)},
                      {"facts", settings_json(set.facts)},
                      {"left_out", ordered_json::object()},
                      {"points", ordered_json::array()},
                      {"fronts", ordered_json::object()}};
  for (const auto& [family, why] : set.left_out) out["left_out"][family] = why;
  for (const TradeoffPoint& point : set.points) out["points"].push_back(point_json(point));
  for (const TradeoffCost& cost : costs) {
    const auto front = find_front(set, cost);
    if (!front) return pass(front.error(), set.dataset);
    for (ordered_json& point : out["points"]) point["front"][cost.key] = false;
    ordered_json names = ordered_json::array();
    for (const std::size_t i : *front) {
      out["points"][i]["front"][cost.key] = true;
      names.push_back(set.points[i].name);
    }
    out["fronts"][cost.key] = std::move(names);
  }
  return out;
}

}  // namespace

Result<ordered_json> tradeoff_json(const TradeoffReport& report) {
  ordered_json out = {{"schema_version", schema_version},    {"command", report.command},
                      {"software_version", report.software}, {"commit", report.commit},
                      {"machine", report.machine},           {"timing", report.timing},
                      {"training", report.training},         {"data_sets", ordered_json::array()}};
  for (const TradeoffSet& set : report.sets) {
    auto one = set_json(set, report.costs);
    if (!one) return pass(one.error());
    out["data_sets"].push_back(std::move(*one));
  }
  return out;
}

}  // namespace weft::daemon
