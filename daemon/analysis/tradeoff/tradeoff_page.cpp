#include "daemon/analysis/tradeoff/tradeoff_page.hpp"

#include <algorithm>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {
namespace {

/// fronts[k]: of costs[k], by rising cost.
using Fronts = std::vector<std::vector<std::size_t>>;

bool holds(const std::vector<std::size_t>& front, std::size_t i) {
  return std::ranges::find(front, i) != front.end();
}

ScatterPanel panel_of(const TradeoffSet& set, const TradeoffCost& cost, char letter,
                      const std::vector<std::string>& families,
                      const std::vector<std::size_t>& front) {
  ScatterPanel out{std::string("(") + letter + ") " + cost.words, cost.title, {}};
  for (std::size_t i = 0; i < set.points.size(); ++i) {
    const TradeoffPoint& p = set.points[i];
    const auto family = std::ranges::find(families, p.family) - families.begin();
    out.points.push_back({p.*cost.seconds, p.accuracy, p.ci95.low, p.ci95.high,
                          static_cast<std::size_t>(family), holds(front, i), p.name});
  }
  return out;
}

// A family looks the same in every section.
std::string picture(const TradeoffReport& report, const TradeoffSet& set, const Fronts& fronts) {
  const std::string stamp(bench_text(set.bench));
  Scatter scatter{"Accuracy against time, " + stamp + ", " + set.dataset,
                  "accuracy [%]",
                  stamp,
                  list_families(report.sets),
                  {}};
  for (std::size_t k = 0; k < report.costs.size(); ++k)
    scatter.panels.push_back(
        panel_of(set, report.costs[k], static_cast<char>('a' + k), scatter.families, fronts[k]));
  return "<div class=\"scroll\">" + scatter_figure(scatter) + "</div>\n";
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

std::string table(const TradeoffSet& set, const std::vector<TradeoffCost>& costs,
                  const Fronts& fronts) {
  HtmlTable out({"choice", "differs in", "on the front of", "accuracy %", "tested", "answer",
                 "of it features", "of it vote", "sliding", "training"},
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

std::string facts(const TradeoffSet& set) {
  std::string out = "<figure><dl>\n" + definition("data set", set.dataset) +
                    definition("SHA-256", set.sha256) +
                    definition("bench", std::string(to_string(set.bench)));
  for (const Setting& fact : set.facts) out += definition(fact.first, format_text(fact));
  for (const auto& [family, why] : set.left_out) out += definition("left out: " + family, why);
  return out + "</dl></figure>\n";
}

std::string simulated_note() {
  return "<div class=\"note\"><p><b>SIMULATED.</b> Every figure of this section comes from the "
         "plant model; no cloth was touched. It tells how the choices compare on this model, not "
         "how they would on cloth.</p></div>\n";
}

std::string methods_of(const TradeoffSet& set) {
  std::vector<std::string> out;
  for (const TradeoffPoint& p : set.points)
    if (std::ranges::find(out, p.ci95.method) == out.end()) out.push_back(p.ci95.method);
  return joined(out, "; ");
}

Result<std::string> section(const TradeoffReport& report, const TradeoffSet& set) {
  Fronts fronts;
  for (const TradeoffCost& cost : report.costs) {
    auto front = find_front(set, cost);
    if (!front) return pass(front.error(), set.dataset);
    fronts.push_back(std::move(*front));
  }
  std::string out =
      "<section>\n<h2>" + escape(set.dataset) + " " + bench_badge(set.bench) + "</h2>\n";
  if (set.bench == BenchKind::simulated) out += simulated_note();
  out += figure(picture(report, set, fronts),
                "Every mark is one choice; bars are 95 % intervals (" + escape(methods_of(set)) +
                    "). The front is of the measured values: where intervals overlap, the order "
                    "may be chance.",
                bench_badge(set.bench));
  out += figure(table(set, report.costs, fronts),
                "Settings of a choice: rest the pointer on its name, or see the JSON file.",
                bench_badge(set.bench));
  return out + facts(set) + "</section>\n";
}

std::string heading(const TradeoffReport& report) {
  std::string out = "<header>";
  std::vector<BenchKind> kinds;
  for (const TradeoffSet& set : report.sets) {
    if (std::ranges::find(kinds, set.bench) == kinds.end()) out += bench_badge(set.bench) + " ";
    kinds.push_back(set.bench);
  }
  out += "\n<h1>" + escape(report.title) + "</h1>\n";
  for (const std::string& note : report.notes) out += "<p>" + escape(note) + "</p>\n";
  return out + "</header>\n";
}

std::string provenance(const TradeoffReport& report) {
  return "<section>\n<h2>How it was measured</h2>\n<figure><dl>\n" +
         definition("timing", report.timing) + definition("training", report.training) +
         definition("machine", report.machine) +
         definition("software", "weft " + report.software +
                                    (report.commit.empty() ? "" : ", commit " + report.commit)) +
         "</dl></figure>\n</section>\n";
}

}  // namespace

Result<std::string> tradeoff_sections_html(const TradeoffReport& report) {
  std::string out;
  for (const TradeoffSet& set : report.sets) {
    const auto one = section(report, set);
    if (!one) return pass(one.error());
    out += *one;
  }
  return out + report.tables_html;
}

Result<std::string> tradeoff_html(const TradeoffReport& report) {
  const auto sections = tradeoff_sections_html(report);
  if (!sections) return pass(sections.error());
  return page_around(report.title, heading(report) + *sections + provenance(report));
}

}  // namespace weft::daemon
