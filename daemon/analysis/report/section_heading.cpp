#include <algorithm>
#include <cstdio>
#include <set>

#include "daemon/analysis/report/figures.hpp"
#include "daemon/analysis/report/json_parts.hpp"
#include "daemon/base/text/format.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {
namespace {

std::string_view bench_of(const ReportInput& input) {
  const BenchKind kind = input.dataset.info.kind;
  if (kind == BenchKind::simulated) return "SIMULATED";
  return kind == BenchKind::real ? "REAL BENCH" : "BENCH UNKNOWN";
}

/// A text of a style sheet. Letters and figures as they are, other printable characters by their
/// number: no name can end the text.
std::string css_text(std::string_view text) {
  constexpr std::string_view plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-,";
  std::string out = "\"";
  for (const char c : text) {
    char number[8] = "?";
    if (c >= ' ' && c <= '~')
      std::snprintf(number, sizeof number, "\\%x ", static_cast<unsigned>(c));
    out += plain.find(c) != std::string_view::npos ? std::string(1, c) : number;
  }
  return out + "\"";
}

std::string tile(const std::string& value, const std::string& words) {
  return "<div class=\"tile\"><b>" + escape(value) + "</b><span>" + escape(words) +
         "</span></div>\n";
}

double realtime_factor(const CampaignSummary& run) {
  return run.wall_s > 0 ? run.virtual_s / run.wall_s : 0;
}

std::string tiles(const ReportInput& input) {
  const CampaignSummary& run = input.run;
  std::string out = "<div class=\"tiles\">\n";
  out += tile(thousands(run.trials_complete) + " / " + thousands(run.trials_planned),
              "trials complete");
  out += tile(duration(run.virtual_s), "on the bench's clock");
  if (run.wall_s > 0) {
    out += tile(duration(run.wall_s), "of wall time for the run");
    out += tile(fixed(realtime_factor(run), 0) + "\u00D7", "real time");
  }
  if (run.force.samples > 0)
    out += tile(
        fixed(run.force.rms_n() * 1e3, 1) + " mN",
        "RMS force error while held, " +
            percent(static_cast<double>(run.force.in_band) / static_cast<double>(run.force.samples),
                    2) +
            " % in band");
  for (const ExplorationResult& result : input.results)
    if (const auto* e = result.find(classifier::Reduction::pvalue))
      out += tile(percent(e->accuracy) + " %",
                  "accuracy " + result.exploration + ", p-value selection");
  return out + "</div>\n";
}

std::string fidelity_note(const SimulationNote& simulation) {
  if (simulation.empty()) return {};
  std::string out = "<div class=\"note\"><p><b>" + escape(sentence(simulation)) + ".</b></p>";
  for (const std::string& line : error_lines(simulation)) out += "<p>" + escape(line) + ".</p>";
  return out + "</div>\n";
}

std::string simulated_note() {
  return "<div class=\"note\"><p><b>Everything measured here comes from a simulated bench.</b> "
         "Wire "
         "bytes, drivers, force loop, recipe engine, recorder and classifier are the ones a real "
         "bench uses; cloth, sensor and stages are a physics model. Most of its fabric parameters "
         "are estimates (<code>sim/fabrics.json</code> marks each number as sourced or "
         "estimated).</p><p>Figures marked <span class=\"paper\">paper</span> were measured by "
         "Khan et al. on real fabrics with a real sensor. They stand beside ours for orientation "
         "and are not comparable one to one: a simulated accuracy says that the method works on "
         "this model, not how well it would work on cloth.</p></div>\n";
}

std::string unfinished_note(const CampaignSummary& run) {
  if (is_complete(run)) return {};
  std::string out = "<div class=\"note alarm\"><p><b>The campaign is not complete:</b> " +
                    thousands(run.trials_complete) + " of " + thousands(run.trials_planned) +
                    " trials, outcome " + escape(recipes::to_string(run.outcome)) +
                    ". Every figure is of the complete trials alone.";
  if (run.error) out += " " + escape(to_string(*run.error));
  return out + "</p></div>\n";
}

std::string rejected_note(const CampaignSummary& run) {
  if (run.attempts_rejected == 0) return {};
  return "<div class=\"note\"><p><b>" + thousands(run.attempts_rejected) +
         (run.attempts_rejected == 1 ? " take was" : " takes were") +
         " bad and repeated.</b> What was recorded of them is kept in the campaign file as "
         "<code>rejected</code>; no figure here counts it.</p></div>\n";
}

std::string selection_note(const ReportInput& input) {
  const std::string words = format_selection(input.dataset.info);
  if (words.empty()) return {};
  return "<div class=\"note alarm\"><p>" + escape(words) +
         " Every figure here but the trials' number is of the whole slides alone, and nothing was "
         "classified.</p></div>\n";
}

std::string lead(const ReportInput& input) {
  std::set<std::string> fabrics, explorations;
  for (const TrialRecord& record : input.dataset.records) {
    fabrics.insert(record.spec.label);
    explorations.insert(record.spec.exploration);
  }
  const std::string names = joined(explorations, " and ");
  std::string out = "<p class=\"lead\">" + thousands(fabrics.size()) + " fabrics, exploration" +
                    (explorations.size() == 1 ? " " : "s ") + escape(names) + ", seed " +
                    std::to_string(input.dataset.info.seed);
  if (!input.run.level.empty()) out += ", plant level " + escape(input.run.level);
  return out + ".</p>\n";
}

}  // namespace

std::string badge_html(const ReportInput& input) {
  std::string out = "<span class=\"badge\">" + std::string(bench_of(input)) + "</span>";
  if (!is_complete(input.run))
    out += " <span class=\"badge\">" + format_incomplete(input.run) + "</span>";
  return out;
}

std::string paper_style(const ReportInput& input) {
  std::string bench(bench_of(input));
  if (const std::string incomplete = format_incomplete(input.run); !incomplete.empty())
    bench += ", " + incomplete;
  return "@page{size:A4;margin:18mm 14mm 16mm;@top-left{content:" + css_text(input.run.name) +
         ";font:8pt sans-serif}@top-right{content:" + css_text(bench) +
         ";font:bold 8pt sans-serif}"
         "@bottom-right{content:counter(page) \" / \" counter(pages);font:8pt sans-serif}}\n";
}

std::string heading_section(const ReportInput& input) {
  const BenchKind kind = input.dataset.info.kind;
  std::string out = "<header>" + badge_html(input) + "\n<h1>Campaign " + escape(input.run.name) +
                    "</h1>\n" + lead(input) + "</header>\n";
  out += unfinished_note(input.run) + rejected_note(input.run) + selection_note(input);
  if (kind == BenchKind::simulated) out += simulated_note() + fidelity_note(input.run.simulation);
  return out + tiles(input);
}

}  // namespace weft::daemon
