#include "daemon/analysis/report/report.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/promise_text.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {
namespace {

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
    out +=
        tile(fixed(run.force.rms_n() * 1e3, 1) + " mN",
             "RMS force error while held, " + percent(in_band_share(run.force), 2) + " % in band");
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
  if (!is_promise_missed(simulation) && simulation.promise)
    out += "<p>" + escape(format_promise(simulation)) + ".</p>";
  if (simulation.budget) out += "<p>Speed: " + escape(format_budget(simulation)) + ".</p>";
  return out + "</div>\n";
}

/// Above everything else on the page, where an accuracy was asked for and not kept.
std::string missed_note(const SimulationNote& simulation) {
  if (!is_promise_missed(simulation)) return {};
  return "<div class=\"note\"><p><b>" + escape(format_promise(simulation)) + ".</b></p></div>\n";
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

/// On paper: the campaign's name and its bench at the head of every page.
std::string paper_style(const ReportInput& input) {
  std::string bench(bench_name(input.dataset.info.kind));
  if (const std::string incomplete = format_incomplete(input.run); !incomplete.empty())
    bench += ", " + incomplete;
  return "@page{size:A4;margin:18mm 14mm 16mm;@top-left{content:" + css_text(input.run.name) +
         ";font:8pt sans-serif}@top-right{content:" + css_text(bench) +
         ";font:bold 8pt sans-serif}"
         "@bottom-right{content:counter(page) \" / \" counter(pages);font:8pt sans-serif}}\n";
}

/// Title, honesty note, tiles.
std::string heading_section(const ReportInput& input) {
  const BenchKind kind = input.dataset.info.kind;
  std::string out = "<header>" + badge_html(input) + "\n<h1>Campaign " + escape(input.run.name) +
                    "</h1>\n" + lead(input) + "</header>\n";
  out += missed_note(input.run.simulation);
  out += unfinished_note(input.run) + rejected_note(input.run) + selection_note(input);
  if (kind == BenchKind::simulated) out += simulated_note() + fidelity_note(input.run.simulation);
  return out + tiles(input);
}

constexpr std::size_t most_problems = 20;  // on the page; weft verify tells them all

/// An empty value stays empty, and shows no dash.
std::string entry(std::string_view name, const std::string& value) {
  return "<dt>" + escape(name) + "</dt><dd>" + escape(value) + "</dd>\n";
}

std::string verdict(const VerifyReport& report) {
  if (!report.holds())
    return "not as recorded: " + std::to_string(report.found_problems.size()) +
           (report.found_problems.size() == 1 ? " finding" : " findings");
  return report.certified ? "holds: every byte is as certified"
                          : "the files\u2019 own digests agree; there is no certificate";
}

std::string found_problems(const VerifyReport& report) {
  std::string out;
  for (std::size_t i = 0; i < report.found_problems.size() && i < most_problems; ++i)
    out += entry(report.found_problems[i].where, report.found_problems[i].what);
  return out;
}

/// Of a report made afterwards.
std::string certificate_section(const ReportInput& input) {
  if (input.verified == nullptr) return {};
  const VerifyReport& report = *input.verified;
  const std::string body =
      "<dl>\n" + entry("verdict", verdict(report)) +
      entry("trials", thousands(report.complete) + " of " + thousands(report.planned) +
                          " complete, in " + thousands(report.attempts) + " attempts") +
      entry("samples lost in gaps on record", thousands(report.lost_samples)) +
      entry("came to its end", report.finished ? "yes" : "no") +
      entry("data set SHA-256", report.dataset_sha256) +
      entry("recorded by", "weft " + report.software_version) + found_problems(report) + "</dl>\n";
  return "<section>\n<h2>Whether it is what was recorded</h2>\n" +
         figure(body,
                "What <code>weft verify</code> found when this report was made: digests of all "
                "trials, of the campaign file and of the data set against the certificate.",
                badge_html(input)) +
         "</section>\n";
}

constexpr std::size_t longest_recipe = 40'000;  // keeps the page small

std::string item(std::string_view name, const std::string& value_html) {
  return "<dt>" + std::string(name) + "</dt><dd>" +
         (value_html.empty() ? std::string(no_value) : value_html) + "</dd>\n";
}

std::string code(const std::string& text) {
  return text.empty() ? std::string() : "<code>" + escape(text) + "</code>";
}

std::string device_list(const DatasetInfo& info) {
  std::string out;
  for (const DeviceInfo& device : info.devices)
    out += (out.empty() ? "" : ", ") + escape(device.name) + " (" + escape(device.driver) + ")";
  return out;
}

std::size_t lost_samples(const Dataset& dataset) {
  std::size_t lost = 0;
  for (const TrialRecord& record : dataset.records) lost += record.lost_samples;
  return lost;
}

std::string rate_of(std::string_view name, const BlockFormat& format) {
  return format.readings == 0 ? std::string()
                              : ", " + std::string(name) + " " + fixed(format.rate_hz, 1) + " Hz";
}

std::string rates(const Dataset& dataset) {
  const DatasetInfo& info = dataset.info;
  const bool feels = dataset.trials.empty() || dataset.trials.front().taxels > 0;
  const std::string force =
      info.wrench_rate_hz > 0 ? "wrench " + fixed(info.wrench_rate_hz, 1) + " Hz" : "no wrench";
  return (feels ? "taxels " + fixed(info.taxel_rate_hz, 1) + " Hz" : std::string("no taxels")) +
         ", " + force + ", stages " + fixed(info.stage_rate_hz, 1) + " Hz" +
         rate_of("acceleration", info.acceleration) + rate_of("sound", info.sound);
}

/// Pages that the hand-over writes after this report, by name: it stands alone.
std::string handover_links(const Dataset& dataset) {
  const auto recipe = nlohmann::json::parse(dataset.info.recipe_json, nullptr, false);
  if (!recipe.is_object() || !recipe.contains("hand_over") || !recipe["hand_over"].is_object())
    return {};
  const auto from = recipe["hand_over"].value("from", nlohmann::json("taxels"));
  if (from == "imprints")
    return code("handover/imprints.html") + ", " + code("handover/imprints.model") + " (imprints)";
  const bool from_vibration = from == "vibration";
  std::string out;
  for (const std::string& exploration : list_explorations(dataset))
    out += (out.empty() ? "" : ", ") + code("handover/" + exploration + ".html") +
           (from_vibration ? " (sound and vibration)" : " (model)");
  return out;
}

std::string provenance_section(const ReportInput& input) {
  const DatasetInfo& info = input.dataset.info;
  std::string out = "<section>\n<h2>Where this came from</h2>\n<figure><dl>\n";
  out += item("bench", escape(to_string(info.kind)) + " " + badge_html(input));
  out += item("data set SHA-256", code(input.run.dataset_sha256));
  out += item("recipe SHA-256", code(info.recipe_sha256));
  out += item("rig SHA-256", code(info.rig_sha256));
  out += item("seed", std::to_string(info.seed));
  const SimulationNote& simulation = input.run.simulation;
  out += item("plant level",
              escape(simulation.empty() ? input.run.level
                                        : simulation.setting + ", because " + simulation.because));
  out += item("software",
              "recorded by weft " + escape(info.software_version) +
                  (input.commit.empty() ? "" : ", reported by commit " + code(input.commit)));
  out += item("machine", escape(input.machine));
  out += item("devices", device_list(info));
  out += item("rates", rates(input.dataset));
  if (const std::string pages = handover_links(input.dataset); !pages.empty())
    out += item("evaluated on, once handed over", pages);
  out += item("lost taxel frames", thousands(lost_samples(input.dataset)));
  out += item("campaign file", code(input.run.campaign_file.filename().string()));
  out += item("data set", code(input.run.dataset_file.filename().string()));
  out += item("paper", escape(paper::citation));
  out += "</dl>\n";
  if (!info.recipe_json.empty() && info.recipe_json.size() <= longest_recipe)
    out += "<details><summary>Recipe, run with the seed above</summary><pre>" +
           escape(info.recipe_json) + "</pre></details>\n";
  return out + "</figure>\n</section>\n";
}

/// Of the pictures in parts that were made beforehand.
std::string more_style(const ReportInput& input) {
  if (input.design.html.empty() && input.tradeoff_html.empty()) return {};
  return std::string(marks_style()) + std::string(scatter_style());
}

}  // namespace

bool is_complete(const CampaignSummary& run) {
  return run.trials_complete == run.trials_planned && !run.error;
}

std::string format_incomplete(const CampaignSummary& run) {
  if (is_complete(run)) return {};
  if (run.trials_complete == run.trials_planned) return "ENDED BY AN ERROR";
  return "INCOMPLETE, " + thousands(run.trials_complete) + " of " + thousands(run.trials_planned) +
         " trials";
}

Status check(const ReportInput& input) {
  if (input.run.bench != input.dataset.info.kind)
    return fail({.code = Errc::invalid_argument,
                 .where = "report",
                 .what = "run and data set disagree on the kind of bench",
                 .expected = std::string(to_string(input.run.bench)),
                 .got = std::string(to_string(input.dataset.info.kind)),
                 .hint = "Report a campaign together with its own data set"});
  return check(input.dataset);
}

std::string_view bench_name(BenchKind kind) {
  if (kind == BenchKind::simulated) return "SIMULATED";
  return kind == BenchKind::real ? "REAL BENCH" : "BENCH UNKNOWN";
}

std::string report_badge(BenchKind kind) {
  return "<span class=\"badge\">" + std::string(bench_name(kind)) + "</span>";
}

std::string badge_html(const ReportInput& input) {
  std::string out = report_badge(input.dataset.info.kind);
  if (!is_complete(input.run))
    out += " <span class=\"badge\">" + format_incomplete(input.run) + "</span>";
  return out;
}

std::string report_html(const ReportInput& input) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
      escape(input.run.name) + " (" + escape(to_string(input.dataset.info.kind)) +
      ") \u2013 Weft campaign report</title>\n<style>" + std::string(style_sheet()) +
      more_style(input) + paper_style(input) + "</style>\n</head>\n<body>\n<main>\n";
  out += heading_section(input) + trace_section(input) + accuracy_section(input) +
         repetition_section(input) + audit_section(input) + input.design.html +
         core_section(input) + timing_section(input) + input.tradeoff_html + force_section(input) +
         certificate_section(input) + wall_time_section(input) + provenance_section(input);
  return out + "</main>\n</body>\n</html>\n";
}

Status write_report_html(const ReportInput& input, const std::filesystem::path& path) {
  if (Status ok = check(input); !ok) return ok;
  return write_text_file(path, report_html(input));
}

}  // namespace weft::daemon
