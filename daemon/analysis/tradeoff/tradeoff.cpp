#include "daemon/analysis/tradeoff/tradeoff.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

Status check(const TradeoffSet& set, const TradeoffPoint& point, double cost_s) {
  if (point.bench != set.bench)
    return fail({.code = Errc::invalid_argument,
                 .where = point.name,
                 .what = "bench kinds of point and data set differ",
                 .expected = std::string(to_string(set.bench)),
                 .got = std::string(to_string(point.bench)),
                 .hint = "Draw real and simulated data in separate figures"});
  for (const double value : {point.accuracy, point.ci95.low, point.ci95.high})
    if (!(value >= 0 && value <= 1))
      return fail({.code = Errc::range,
                   .where = point.name,
                   .what = "accuracy out of range",
                   .expected = "0 to 1",
                   .got = std::to_string(value)});
  if (!(cost_s > 0) || !std::isfinite(cost_s))
    return fail({.code = Errc::range,
                 .where = point.name,
                 .what = "time out of range",
                 .expected = "above 0 s, finite",
                 .got = std::to_string(cost_s) + " s"});
  return {};
}

/// fronts[k] is the front of costs[k], by rising cost.
using Fronts = std::vector<std::vector<std::size_t>>;

Result<Fronts> find_fronts(const TradeoffSet& set, const std::vector<TradeoffCost>& costs) {
  Fronts out;
  for (const TradeoffCost& cost : costs) {
    auto front = find_front(set, cost);
    if (!front) return pass(front.error(), set.dataset);
    out.push_back(std::move(*front));
  }
  return out;
}

bool holds(const std::vector<std::size_t>& front, std::size_t i) {
  return std::ranges::find(front, i) != front.end();
}

// A family has the same marks in every section.
chart::Plot plot_of(const TradeoffReport& report, const TradeoffSet& set, const Fronts& fronts) {
  const std::string stamp(bench_text(set.bench));
  const std::vector<std::string> families = list_families(report.sets);
  chart::Plot out{"Accuracy against time, " + stamp + ", " + set.dataset, stamp,
                  report.costs.size()};
  out.width = report.costs.size() > 1 ? 1100 : 760;
  out.panel_height = 300;
  out.shared_y = true;
  out.front_name = "Pareto front";
  for (std::size_t k = 0; k < report.costs.size(); ++k) {
    const TradeoffCost& cost = report.costs[k];
    std::vector<chart::FamilySample> points;
    for (std::size_t i = 0; i < set.points.size(); ++i) {
      const TradeoffPoint& p = set.points[i];
      const bool front = holds(fronts[k], i);
      points.push_back(
          {static_cast<std::size_t>(std::ranges::find(families, p.family) - families.begin()),
           {p.*cost.seconds, p.accuracy * 100, p.ci95.low * 100, p.ci95.high * 100,
            front ? p.name : "", front}});
    }
    const std::string letter(1, static_cast<char>('a' + k));
    out.panels.push_back({"(" + letter + ") " + cost.words,
                          {.title = cost.title, .logarithmic = true, .seconds = true},
                          chart::percent_axis(report.measure + " [%]", points)});
    out.panels.back().series = chart::series_of(families, points);
  }
  return out;
}

std::string fronts_text(std::size_t i, const std::vector<TradeoffCost>& costs,
                        const Fronts& fronts) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < costs.size(); ++k)
    if (holds(fronts[k], i)) out.push_back("\u25C6 " + costs[k].words);
  return joined(out);
}

std::string settings_text(const TradeoffPoint& p) {
  std::vector<std::string> out;
  for (const Setting& setting : p.settings)
    out.push_back(setting.first + " " + format_text(setting));
  return joined(out);
}

Blocks table(const TradeoffSet& set, const std::vector<TradeoffCost>& costs, const Fronts& fronts,
             const std::string& measure) {
  HtmlTable out({"choice", "differs in", "Pareto front", escape(measure) + " [%]", "tested",
                 "prediction time", "feature time", "vote time", "sliding time", "training time"},
                3);
  for (std::size_t i = 0; i < set.points.size(); ++i) {
    const TradeoffPoint& p = set.points[i];
    const std::string on = fronts_text(i, costs, fronts);
    out.row({"<span title=\"" + escape(settings_text(p)) + "\">" + escape(p.name) + "</span>",
             escape(p.family), on,
             percent(p.accuracy) + "<span class=\"interval-text\">" + percent(p.ci95.low) + " to " +
                 percent(p.ci95.high) + "</span>",
             thousands(p.tested), duration(p.answer_s), duration(p.features_s), duration(p.vote_s),
             fixed(p.contact_s, 2) + " s", duration(p.train_s)},
            on.empty() ? "" : "on-front");
  }
  return out.finish();
}

Blocks facts(const TradeoffSet& set) {
  std::vector<std::pair<std::string, std::string>> out{
      {"data set", set.dataset},
      {"SHA-256", set.sha256},
      {"bench", std::string(to_string(set.bench))}};
  for (const Setting& fact : set.facts) out.emplace_back(fact.first, format_text(fact));
  for (const auto& [family, why] : set.left_out) out.emplace_back("skipped: " + family, why);
  return details("Settings and skipped factors", definitions(out));
}

Blocks simulated_note() {
  return paragraph(
      "<b>SIMULATED.</b> All values come from the plant model; no fabric was touched. They "
      "compare the choices on this model, not on real fabric.");
}

std::string methods_of(const TradeoffSet& set) {
  std::vector<std::string> out;
  for (const TradeoffPoint& p : set.points)
    if (std::ranges::find(out, p.ci95.method) == out.end()) out.push_back(p.ci95.method);
  return joined(out, "; ");
}

Result<Blocks> set_section(const TradeoffReport& report, const TradeoffSet& set) {
  const auto found = find_fronts(set, report.costs);
  if (!found) return pass(found.error());
  const Fronts& fronts = *found;
  Blocks out =
      figure(picture(plot_of(report, set, fronts)),
             "Each mark is one choice; bars are 95 % intervals (" + escape(methods_of(set)) +
                 "). The Pareto front uses the measured values. Where intervals overlap, the "
                 "order may be chance.",
             bench_badge(set.bench));
  out += details("All choices as a table",
                 figure(table(set, report.costs, fronts, report.measure),
                        "Point at the name of a choice to see its settings, or read the JSON file.",
                        bench_badge(set.bench)));
  if (set.bench == BenchKind::simulated) out += simulated_note();
  return section(set.dataset + ", " + std::string(bench_text(set.bench)), out + facts(set));
}

std::string badge_of(const TradeoffReport& report) {
  std::vector<std::string> kinds;
  for (const TradeoffSet& set : report.sets)
    if (const std::string text(bench_text(set.bench));
        std::ranges::find(kinds, text) == kinds.end())
      kinds.push_back(text);
  return joined(kinds, " AND ");
}

/// The choice with the highest measured value in each set.
Blocks best_choices(const TradeoffReport& report) {
  Blocks out;
  for (const TradeoffSet& set : report.sets) {
    const auto best = std::ranges::max_element(set.points, {}, &TradeoffPoint::accuracy);
    out += paragraph("<b>" + escape(set.dataset) + ": " + escape(report.measure) + " " +
                     percent(best->accuracy) + " %</b> (95 %: " + percent(best->ci95.low) + " to " +
                     percent(best->ci95.high) + ") with " + escape(best->name) + ", in " +
                     duration(best->answer_s) + " per prediction; best of " +
                     std::to_string(set.points.size()) + " measured choices. " +
                     bench_badge(set.bench));
  }
  return section("Result", std::move(out));
}

using nlohmann::ordered_json;

constexpr int schema_version = 1;

ordered_json number_json(double value) {
  constexpr double most = 1e15;  // whole numbers up to here are written without a decimal point
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
  const auto fronts = find_fronts(set, costs);
  if (!fronts) return pass(fronts.error());
  for (std::size_t k = 0; k < costs.size(); ++k) {
    const std::string& key = costs[k].key;
    for (ordered_json& point : out["points"]) point["front"][key] = false;
    out["fronts"][key] = ordered_json::array();
    for (const std::size_t i : (*fronts)[k]) {
      out["points"][i]["front"][key] = true;
      out["fronts"][key].push_back(set.points[i].name);
    }
  }
  return out;
}

}  // namespace

Result<std::vector<std::size_t>> find_front(const TradeoffSet& set, const TradeoffCost& cost) {
  if (set.points.empty())
    return fail(
        {.code = Errc::invalid_argument, .where = set.dataset, .what = "no points to compare"});
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
           .what = "gain or cost not finite",
           .got = std::to_string(choices[i].gain) + " for " + std::to_string(choices[i].cost)});
  std::vector<std::size_t> order(choices.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    if (choices[a].cost != choices[b].cost) return choices[a].cost < choices[b].cost;
    return choices[a].gain > choices[b].gain;
  });
  std::vector<std::size_t> front;
  double most = -std::numeric_limits<double>::infinity();  // highest gain so far, at lower cost
  for (const std::size_t i : order) {
    const TradeoffChoice& choice = choices[i];
    const bool duplicate = !front.empty() && choices[front.back()].cost == choice.cost &&
                           choices[front.back()].gain == choice.gain;
    if (choice.gain > most || duplicate) front.push_back(i);
    most = std::max(most, choice.gain);
  }
  return front;
}

Result<Blocks> tradeoff_sections(const TradeoffReport& report) {
  Blocks out;
  for (const TradeoffSet& set : report.sets) {
    auto one = set_section(report, set);
    if (!one) return pass(one.error());
    out += std::move(*one);
  }
  return out + report.tables;
}

Result<Document> tradeoff_document(const TradeoffReport& report) {
  auto sections = tradeoff_sections(report);
  if (!sections) return pass(sections.error());
  Document out{"tradeoff", report.title, badge_of(report)};
  out.result = best_choices(report);
  out.pictures = std::move(*sections);
  for (const std::string& note : report.notes) out.method += paragraph(escape(note));
  out.provenance =
      definitions({{"timing", report.timing},
                   {"training", report.training},
                   {"machine", report.machine},
                   {"software", "weft " + report.software +
                                    (report.commit.empty() ? "" : ", commit " + report.commit)}});
  return out;
}

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
