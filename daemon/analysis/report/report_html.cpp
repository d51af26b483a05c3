#include "daemon/analysis/report/report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/promise_text.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {
namespace {

std::vector<std::string> tile_of(const Headline& headline) {
  return {percent(headline.accuracy.share) + " %",
          "accuracy " + headline.exploration + ", " + headline.unit + ", 95 %: " +
              percent(headline.accuracy.ci95_low) + " to " + percent(headline.accuracy.ci95_high)};
}

/// Accuracies first: the headline's, or those of the random splits if there is no headline.
Blocks tile_row(const ReportInput& input) {
  const CampaignSummary& run = input.run;
  std::vector<std::vector<std::string>> out;
  for (const Headline& headline : input.headlines) out.push_back(tile_of(headline));
  for (const ExplorationResult& result : input.results)
    if (const auto* e = result.find(classifier::Reduction::pvalue); e && input.headlines.empty())
      out.push_back({percent(e->accuracy) + " %",
                     "accuracy " + result.exploration + ", p-value selection, random splits"});
  out.push_back(
      {thousands(run.trials_complete) + " / " + thousands(run.trials_planned), "trials complete"});
  if (run.force.samples > 0)
    out.push_back({significant(run.force.rms_n() * 1e3) + " mN",
                   "RMS force error under force control, " + percent(in_band_share(run.force), 2) +
                       " % in band"});
  out.push_back({duration(run.virtual_s), "bench time"});
  if (run.wall_s > 0)
    out.push_back({duration(run.wall_s),
                   "wall time, " + fixed(realtime_factor(run), 0) + "\u00D7 real time"});
  return tiles(std::move(out));
}

/// The plant's level and error in one line; details follow below.
std::string fidelity_line(const SimulationNote& simulation) {
  return simulation.empty() ? std::string()
                            : escape(sentence(simulation)) + ". <a href=\"#method\">Method</a>.";
}

Blocks fidelity_method(const SimulationNote& simulation) {
  if (simulation.empty()) return {};
  Blocks out = paragraph("<b>" + escape(sentence(simulation)) + ".</b>");
  for (const std::string& line : error_lines(simulation)) out += paragraph(escape(line) + ".");
  if (!is_promise_missed(simulation) && simulation.promise)
    out += paragraph(escape(format_promise(simulation)) + ".");
  if (simulation.budget) out += paragraph("Speed: " + escape(format_budget(simulation)) + ".");
  return out;
}

Blocks simulated_method() {
  return paragraph(
             "<b>Everything measured here comes from a simulated bench.</b> Wire bytes, drivers, "
             "force loop, recipe engine, recorder and classifier are those of a real bench. "
             "Fabric, sensor and stages are a physics model. Most of its fabric parameters are "
             "estimates (<code>sim/fabrics.json</code> marks each number as sourced or "
             "estimated).") +
         paragraph(
             "Values marked <span class=\"paper\">paper</span> were measured on real "
             "samples with a real sensor. They are shown for orientation and are not "
             "directly comparable. A simulated accuracy shows that the method works on "
             "this model, not how well it works on real fabric.");
}

std::string verdict(const VerifyReport& report) {
  if (!report.holds())
    return "not verified: " + std::to_string(report.found_problems.size()) +
           (report.found_problems.size() == 1 ? " problem" : " problems");
  return report.certified ? "verified: every byte matches the certificate"
                          : "digests match; no certificate to compare with";
}

/// Problems and missing parts, one line each.
Blocks alert_lines(const ReportInput& input) {
  const CampaignSummary& run = input.run;
  Blocks out;
  if (is_promise_missed(run.simulation))
    out += alarm("<b>" + escape(format_promise(run.simulation)) + ".</b>");
  if (!is_complete(run))
    out += alarm("<b>Campaign not complete:</b> " + thousands(run.trials_complete) + " of " +
                 thousands(run.trials_planned) + " trials, outcome " +
                 escape(recipes::to_string(run.outcome)) +
                 ". All values use the complete trials only." +
                 (run.error ? " " + escape(to_string(*run.error)) : ""));
  if (run.attempts_rejected > 0)
    out += note("<b>" + thousands(run.attempts_rejected) +
                (run.attempts_rejected == 1 ? " attempt was" : " attempts were") +
                " rejected and repeated.</b> Rejected attempts stay in the campaign file as "
                "<code>rejected</code>; no value here counts them.");
  if (const std::string words = format_selection(input.dataset.info); !words.empty())
    out += alarm(escape(words) +
                 " All values except the number of trials use complete slides only. Nothing was "
                 "classified.");
  if (input.verified != nullptr && !input.verified->holds())
    out += alarm("<b>" + escape(verdict(*input.verified)) +
                 ".</b> <a href=\"#provenance\">Problems found by weft verify</a>.");
  return out;
}

std::string lead(const ReportInput& input) {
  std::set<std::string> fabrics, explorations;
  for (const TrialRecord& record : input.dataset.records) {
    fabrics.insert(record.spec.label);
    explorations.insert(record.spec.exploration);
  }
  const std::string names = joined(explorations, " and ");
  std::string out =
      thousands(fabrics.size()) +
      (holds_imprints(input.dataset) ? " objects, exploration" : " fabrics, exploration") +
      (explorations.size() == 1 ? " " : "s ") + escape(names) + ", seed " +
      std::to_string(input.dataset.info.seed);
  const std::string fidelity = fidelity_line(input.run.simulation);
  if (fidelity.empty() && !input.run.level.empty())
    out += ", plant level " + escape(input.run.level);
  return out + ". " + fidelity;
}

constexpr std::size_t most_problems = 20;  // on the page; `weft verify` lists all

/// For a report made after the run.
Blocks certificate_part(const ReportInput& input) {
  if (input.verified == nullptr) return {};
  const VerifyReport& report = *input.verified;
  std::vector<std::pair<std::string, std::string>> entries{
      {"verdict", verdict(report)},
      {"trials", thousands(report.complete) + " of " + thousands(report.planned) +
                     " complete, in " + thousands(report.attempts) + " attempts"},
      {"samples lost in recorded gaps", thousands(report.lost_samples)},
      {"finished", report.finished ? "yes" : "no"},
      {"data set SHA-256", report.dataset_sha256},
      {"recorded by", "weft " + report.software_version}};
  for (std::size_t i = 0; i < report.found_problems.size() && i < most_problems; ++i)
    entries.emplace_back(report.found_problems[i].where, report.found_problems[i].what);
  return section(
      "Verification",
      figure(definitions(entries),
             "Result of <code>weft verify</code> at the time of this report. It compares "
             "the digests of all trials, the campaign file and the data set with the "
             "certificate.",
             badge_html(input)));
}

constexpr std::size_t longest_recipe = 40'000;  // in bytes; keeps the page small

std::string device_list(const DatasetInfo& info) {
  std::string out;
  for (const DeviceInfo& device : info.devices)
    out += (out.empty() ? "" : ", ") + device.name + " (" + device.driver + ")";
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

/// Pages that the handover writes after this report. They are listed by name without links, because
/// the report is a self-contained file.
std::string handover_pages(const Dataset& dataset) {
  const auto recipe = nlohmann::json::parse(dataset.info.recipe_json, nullptr, false);
  if (!recipe.is_object() || !recipe.contains("hand_over") || !recipe["hand_over"].is_object())
    return {};
  const auto from = recipe["hand_over"].value("from", nlohmann::json("taxels"));
  if (from == "imprints") return "handover/imprints.html, handover/imprints.model";
  std::vector<std::string> out;
  for (const std::string& exploration : list_explorations(dataset))
    out.push_back("handover/" + exploration + ".html" +
                  (from == "vibration" ? " (sound and vibration)" : " (model)"));
  return joined(out);
}

/// Citations of the papers that the campaign repeats.
std::string papers_of(const ReportInput& input) {
  return std::string(holds_imprints(input.dataset) ? paper::imprint_citation : paper::citation);
}

Blocks provenance_part(const ReportInput& input) {
  const DatasetInfo& info = input.dataset.info;
  const SimulationNote& simulation = input.run.simulation;
  const std::string commit =
      input.commit.empty() ? std::string() : ", reported by commit " + input.commit;
  std::vector<std::pair<std::string, std::string>> entries{
      {"bench", std::string(to_string(info.kind))},
      {"data set SHA-256", input.run.dataset_sha256},
      {"recipe SHA-256", info.recipe_sha256},
      {"rig SHA-256", info.rig_sha256},
      {"seed", std::to_string(info.seed)},
      {"plant level",
       simulation.empty() ? input.run.level : simulation.setting + " (" + simulation.because + ")"},
      {"software", "recorded by weft " + info.software_version + commit},
      {"machine", input.machine},
      {"devices", device_list(info)},
      {"rates", rates(input.dataset)}};
  if (const std::string pages = handover_pages(input.dataset); !pages.empty())
    entries.emplace_back("pages of the handover", pages);
  entries.insert(entries.end(), {{"lost taxel frames", thousands(lost_samples(input.dataset))},
                                 {"campaign file", input.run.campaign_file.filename().string()},
                                 {"data set", input.run.dataset_file.filename().string()},
                                 {"paper", papers_of(input)}});
  Blocks out =
      figure(definitions(entries), "Origin of the data and of this report.", badge_html(input));
  if (!info.recipe_json.empty() && info.recipe_json.size() <= longest_recipe)
    out += details("Recipe (run with the seed above)", code_block(info.recipe_json));
  return out;
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
                 .what = "bench kinds of run and data set differ",
                 .expected = std::string(to_string(input.run.bench)),
                 .got = std::string(to_string(input.dataset.info.kind)),
                 .hint = "Report a campaign with its own data set"});
  return check(input.dataset);
}

std::string_view bench_name(BenchKind kind) {
  if (kind == BenchKind::simulated) return "SIMULATED";
  return kind == BenchKind::real ? "REAL BENCH" : "BENCH UNKNOWN";
}

std::string report_badge(BenchKind kind) {
  return badge_markup(bench_name(kind));
}

std::string badge_html(const ReportInput& input) {
  std::string out = report_badge(input.dataset.info.kind);
  if (!is_complete(input.run)) out += " " + badge_markup(format_incomplete(input.run));
  return out;
}

Document report_document(const ReportInput& input) {
  Document out{"campaign", "Campaign " + input.run.name};
  out.badge = bench_name(input.dataset.info.kind);
  if (const std::string missing = format_incomplete(input.run); !missing.empty())
    out.badge += ", " + missing;
  out.lead_html = lead(input);
  out.alerts = alert_lines(input);
  out.result = headline_section(input) + tile_row(input);
  out.pictures = trace_section(input) + force_section(input) + input.design.blocks +
                 accuracy_pictures(input) + input.tradeoff;
  out.tables = accuracy_section(input) + repetition_section(input) + audit_section(input) +
               core_section(input) +
               section("Timing", timing_details(input) + wall_time_details(input));
  if (input.dataset.info.kind == BenchKind::simulated) out.method = simulated_method();
  out.method += fidelity_method(input.run.simulation) + accuracy_method(input) + input.fidelity;
  const bool several = input.documents.size() > 1;
  const auto named = [&](const Document& one, const Blocks& blocks) {
    return several && !blocks.empty() ? paragraph("<b>" + escape(one.title) + ".</b>") + blocks
                                      : blocks;
  };
  for (const Document& one : input.documents) {
    // The headline already shows accuracy and matrix of sound and vibration.
    if (one.kind == "imprints") out.result += one.result;
    out.pictures += named(one, one.pictures);
    out.tables += named(one, one.tables);
    out.method += named(one, one.method);
  }
  out.provenance = certificate_part(input) + provenance_part(input);
  return out;
}

}  // namespace weft::daemon
