
#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/analysis/report/trace.hpp"
#include "daemon/analysis/tradeoff/sim/sim_page.hpp"
#include "daemon/apps/weft/campaign_report.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/study_commands.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"

namespace weft::daemon::cli {
namespace {

namespace fs = std::filesystem;

bool out_of_plan(const CampaignSummary& summary) {
  return summary.trials_complete < summary.trials_planned &&
         summary.outcome != recipes::Outcome::interrupted;
}

/// Somebody ended it before its plan was done: the last order that does so counts.
void apply_journal_order(const JournalEntry& entry, recipes::Outcome& outcome) {
  if (entry.kind == "stop_requested") outcome = recipes::Outcome::aborted;
  if (entry.kind != "order") return;
  const auto payload = nlohmann::json::parse(entry.payload_json, nullptr, false);
  const std::string order = payload.is_object() ? payload.value("order", "") : "";
  if (order == "stop") outcome = recipes::Outcome::stopped;
  if (order == "abort" || order == "halt") outcome = recipes::Outcome::aborted;
}

/// What the journal tells: who ended it, how it was simulated, and how long it took on the bench's
/// clock.
Status add_journal(const fs::path& campaign, CampaignSummary& summary) {
  const auto journal = load_journal(campaign);
  if (!journal) return pass(journal.error());
  for (const JournalEntry& entry : *journal) {
    summary.virtual_s = std::max(summary.virtual_s, to_seconds(entry.time));
    if (out_of_plan(summary)) apply_journal_order(entry, summary.outcome);
    if (entry.kind != "simulation") continue;
    auto note = simulation_note_from(entry.payload_json);
    if (!note) return pass(note.error(), campaign.string());
    summary.simulation = std::move(*note);
  }
  return {};
}

void add_force(const Dataset& dataset, ForceTally& all) {
  for (const FabricForce& fabric : force_by_fabric(dataset, force_targets(dataset.info))) {
    all.samples += fabric.tally.samples;
    all.in_band += fabric.tally.in_band;
    all.sum_squares_n2 += fabric.tally.sum_squares_n2;
    all.worst_n = std::max(all.worst_n, fabric.tally.worst_n);
  }
}

/// Of the files. Whether somebody cleaned up and how the rig stands is not in them.
Result<CampaignSummary> load_summary(const fs::path& folder, const VerifyReport& verified,
                                     const Dataset& dataset) {
  CampaignSummary out;
  out.campaign_file = folder / campaign_file_name;
  out.dataset_file = folder / dataset_file_name;
  const auto history = load_history(out.campaign_file);
  if (!history) return pass(history.error());
  out.name = history->info.name;
  out.bench = history->info.kind;
  out.cleanup = recipes::Cleanup::skipped;
  out.rig = recipes::RigFact::unknown;
  out.trials_planned = history->progress.planned;
  out.trials_complete = history->complete();
  out.trials_ended_early = history->ended_early();
  out.attempts_rejected = history->rejected();
  out.dataset_sha256 = verified.dataset_sha256;
  if (out.trials_complete < out.trials_planned)
    out.outcome = verified.finished ? recipes::Outcome::failed : recipes::Outcome::interrupted;
  if (Status ok = add_journal(out.campaign_file, out); !ok) return pass(ok.error());
  out.level = out.simulation.level;
  add_force(dataset, out.force);
  return out;
}

/// Imprints, sweeps and slides that ended early have pages and commands of their own.
bool tradeoffs(const ReportArgs& args, const Dataset& dataset) {
  return !args.no_tradeoff && dataset.info.ended_early.empty() && !holds_imprints(dataset) &&
         dataset.info.factors.empty() && list_explorations(dataset).size() > 0;
}

Result<std::string> tradeoff_sections(const ReportArgs& args, const CampaignSummary& summary,
                                      Console& console) {
  TradeClassifierArgs how;
  how.datasets = {summary.dataset_file};
  how.vary = args.vary;
  how.splits = args.tradeoff_splits;
  std::string text;
  const auto report = measured_tradeoff(how, console, text);
  if (!report) return pass(report.error());
  auto sections = tradeoff_sections_html(*report);
  if (!sections) return sections;
  return "<section>\n<h2>Speed against accuracy</h2>\n<p>" + std::string(report->timing) +
         ".</p>\n</section>\n" + *sections;
}

Result<std::string> fidelity_section(const ReportArgs& args, const CampaignSummary& summary) {
  if (args.fidelity.empty() || summary.simulation.empty()) return std::string();
  const auto text = read_text_file(args.fidelity);
  if (!text) return pass(text.error());
  const auto table = sim::parse_fidelity(*text);
  if (!table) return pass(table.error(), args.fidelity.string());
  return fidelity_section_html(*table, summary.simulation.setting);
}

Status check_places(const ReportArgs& args) {
  for (const char* const name : {campaign_file_name, dataset_file_name}) {
    std::error_code none;
    if (!fs::exists(args.folder / name, none))
      return fail({.code = Errc::not_found,
                   .where = (args.folder / name).string(),
                   .what = "nothing to report of",
                   .expected = "the folder of a campaign that is over",
                   .hint = "weft dataset export makes a data set of a campaign file"});
    if (Status ok = refuse_same_file(args.folder / name, args.out); !ok) return ok;
  }
  if (args.out.extension() == ".html") return check_report_places(args.out);
  return fail({.code = Errc::invalid_argument,
               .where = "-o",
               .what = "the page's name does not say what it is",
               .expected = "a name that ends in .html",
               .got = args.out.string(),
               .hint = "The JSON document goes beside it"});
}

}  // namespace

void add_options(CLI::App& command, ReportArgs& args) {
  command.add_option("FOLDER", args.folder, "of a campaign, by weft run or weftd")
      ->required()
      ->check(CLI::ExistingDirectory);
  command.add_option("-o,--output", args.out, "page to write (.html); .json beside it")->required();
  command.add_option("--repeats", args.repeats, "random splits for the accuracies")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command.add_option("--vary", args.vary, "what speed against accuracy varies, see weft trade")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  command.add_option("--trade-splits", args.tradeoff_splits, "random splits of that")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command.add_flag("--no-trade", args.no_tradeoff, "leave speed against accuracy out");
  command
      .add_option("--fidelity", args.fidelity,
                  "table of weft trade sim, such as sim/fidelity.json: what the plant's fidelity "
                  "costs")
      ->check(CLI::ExistingFile);
}

Result<int> run_report(const ReportArgs& args, Console& console) {
  if (Status ok = check_places(args); !ok) return pass(ok.error());
  const auto verified = verify(args.folder);
  if (!verified) return pass(verified.error());
  const auto dataset = open_dataset(args.folder / dataset_file_name);
  if (!dataset) return pass(dataset.error());
  const auto summary = load_summary(args.folder, *verified, *dataset);
  if (!summary) return pass(summary.error());
  ReportExtras extras{&*verified, {}};
  if (tradeoffs(args, *dataset)) {
    auto sections = tradeoff_sections(args, *summary, console);
    const bool is_whole = summary->outcome == recipes::Outcome::complete;
    if (!sections && is_whole) return pass(sections.error());
    if (sections)
      extras.tradeoff_html = std::move(*sections);
    else  // too few trials to split, perhaps
      console.err << "speed against accuracy is left out: " << to_string(sections.error()) << '\n';
  }
  const auto fidelity = fidelity_section(args, *summary);
  if (!fidelity) return pass(fidelity.error());
  extras.tradeoff_html += *fidelity;
  const auto report = write_report_to(*summary, *dataset, args.out, args.repeats, extras, console);
  if (!report) return pass(report.error());
  if (report->not_classified)
    console.err << "not classified: " << to_string(*report->not_classified) << std::endl;
  nlohmann::json summary_json{{"command", "report"},
                              {"bench", to_string(summary->bench)},
                              {"report_html", report->html.string()},
                              {"report_json", report->json.string()},
                              {"verified", verify_json(*verified)}};
  print(console, report->summary + "Report: " + report->html.string() + "\n", summary_json);
  return verified->holds() ? exit_ok : exit_failure;
}

}  // namespace weft::daemon::cli
