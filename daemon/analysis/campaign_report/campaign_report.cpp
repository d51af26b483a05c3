#include "daemon/analysis/campaign_report/campaign_report.hpp"

#include <sys/utsname.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/analysis/design/design_page.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

bool out_of_plan(const CampaignSummary& summary) {
  return summary.trials_complete < summary.trials_planned &&
         summary.outcome != recipes::Outcome::interrupted;
}

/// Applies an order that ended the run before its plan was complete; the last such order counts.
void apply_journal_order(const JournalEntry& entry, recipes::Outcome& outcome) {
  if (entry.kind == "stop_requested") outcome = recipes::Outcome::aborted;
  if (entry.kind != "order") return;
  const auto payload = nlohmann::json::parse(entry.payload_json, nullptr, false);
  const std::string order = payload.is_object() ? payload.value("order", "") : "";
  if (order == "stop") outcome = recipes::Outcome::stopped;
  if (order == "abort" || order == "halt") outcome = recipes::Outcome::aborted;
}

/// Reads from the journal how the run was ended, how it was simulated, and its duration on the
/// bench clock.
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

void note(const ReportOptions& options, const std::string& text) {
  if (options.note) options.note(text);
}

Result<std::vector<CampaignBeside>> evaluated_beside(const ReportOptions& options,
                                                     const EvaluateOptions& evaluate) {
  std::vector<CampaignBeside> out;
  for (const fs::path& folder : options.beside) {
    auto dataset = read_hdf5(folder / dataset_file_name);
    if (!dataset) return pass(dataset.error(), "--beside");
    auto one = evaluate_beside(std::move(*dataset), evaluate, options.progress);
    if (!one) return pass(one.error(), "--beside " + folder.string());
    out.push_back(std::move(*one));
  }
  return out;
}

/// `can_measure`: the slides can be classified. Empty, with a note, if the classifier refuses.
std::vector<Headline> headlines_of(const Dataset& dataset, bool can_measure,
                                   const ReportOptions& options) {
  if (options.handover != nullptr) return handover_headlines(*options.handover, dataset);
  if (!can_measure) return {};
  note(options, "classify: headline accuracy, cross-validated by group of repetitions");
  auto measured = measure_headlines(dataset, options.threads);
  if (measured) return std::move(*measured);
  note(options, "weft: headline accuracy not available: " + to_string(measured.error()));
  return {};
}

std::string_view text_of(const std::vector<HandoverText>& files, const std::string& name) {
  const auto found = std::ranges::find(files, name, &HandoverText::name);
  return found == files.end() ? std::string_view() : std::string_view(found->text);
}

/// Adds the handover's confusion matrices and its pages of imprints, or of sound and vibration. The
/// report also works without them.
std::vector<Document> add_handover(const std::vector<HandoverText>& files,
                                   std::vector<Headline>& headlines) {
  if (const auto text = text_of(files, evaluation_file_name); !text.empty())
    add_confusions(text, headlines);
  std::vector<std::string> names{"imprints"};
  for (const Headline& headline : headlines)
    if (headline.exploration != names.front()) names.push_back(headline.exploration);
  std::vector<Document> out;
  for (const std::string& name : names) {
    const auto record =
        nlohmann::ordered_json::parse(text_of(files, name + ".json"), nullptr, false);
    if (!record.is_object() || !record.contains("page")) continue;
    auto document = document_from(record["page"]);
    if (document && document->kind != "evaluation" && document->kind != "campaign")
      out.push_back(std::move(*document));
  }
  return out;
}

EvaluateOptions evaluate_options(const ReportOptions& options) {
  EvaluateOptions out;
  out.repeats = options.repeats;
  out.threads = options.threads;
  out.stop = options.stop;
  if (!options.beside.empty()) out.best_splits = 3;  // about 3 s per row of the demo on two cores
  return out;
}

/// False for three kinds of data. Slides left by a live vote do not represent all slides. Imprints
/// have their own rules, in the handover. In a sweep cells are compared, see `weft design analyse`.
bool splits_at_random(const Dataset& dataset) {
  return dataset.info.ended_early.empty() && !holds_imprints(dataset) &&
         dataset.info.factors.empty();
}

}  // namespace

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

std::string machine_text() {
  utsname system{};
  std::string text = std::to_string(std::thread::hardware_concurrency()) + " threads";
  if (uname(&system) == 0)
    text += std::string(", ") + system.sysname + " " + system.release + " " + system.machine;
  return text + ", compiler " + __VERSION__;
}

Result<CampaignReport> make_report(const CampaignSummary& summary, const Dataset& dataset,
                                   const ReportOptions& options) {
  const EvaluateOptions evaluate = evaluate_options(options);
  const auto results =
      splits_at_random(dataset)
          ? evaluate_campaign(dataset, evaluate, steady_wall_seconds, options.progress)
          : Result<std::vector<ExplorationResult>>();
  if (options.stop && options.stop()) return pass(stopped_early("the report"));
  CampaignReport report;
  report.selected = !dataset.info.ended_early.empty();
  if (!results) report.not_classified = results.error();
  const bool has_design = !report.selected && !holds_imprints(dataset) && results;
  const auto say = [&](const std::string& what) { note(options, "design: " + what); };
  const DesignParts design =
      has_design ? analyse_design(dataset, say, options.threads, options.stop) : DesignParts{};
  if (options.stop && options.stop()) return pass(stopped_early("the report"));
  const std::vector<ExplorationResult> none;
  ReportInput input{summary,        dataset,           results ? *results : none,
                    machine_text(), software_commit(), design};
  const auto beside = evaluated_beside(options, evaluate);
  if (!beside) return pass(beside.error());
  if (!beside->empty()) input.beside = &*beside;
  input.headlines = headlines_of(dataset, results && !results->empty(), options);
  input.verified = options.verified;
  input.tradeoff = options.tradeoff;
  input.fidelity = options.fidelity;
  if (options.handover != nullptr)
    input.documents = add_handover(options.handover_files, input.headlines);
  if (options.audit) input.audit = options.audit();
  if (Status ok = check(input); !ok) return pass(ok.error());
  const Document document = report_document(input);
  report.json = record_with_page(report_record(input), document);
  auto page = page_of_record(report.json);
  if (!page) return pass(page.error(), "report");
  report.html = std::move(*page);
  report.summary = summary_text(input);
  return report;
}

std::vector<HandoverText> load_handover_files(const fs::path& folder) {
  std::vector<HandoverText> out;
  std::error_code unseen;
  for (const auto& entry : fs::directory_iterator(folder / handover_folder_name, unseen)) {
    if (entry.path().extension() != ".json") continue;
    if (auto text = read_text_file(entry.path(), std::uintmax_t{1} << 28))
      out.push_back({entry.path().filename().string(), std::move(*text)});
  }
  return out;
}

Result<std::vector<HandoverText>> report_texts(const fs::path& folder, const Dataset& dataset,
                                               const HandoverResult& handover,
                                               ReportOptions options) {
  const auto verified = verify(folder, options.stop);
  if (!verified) return pass(verified.error());
  const auto summary = load_summary(folder, *verified, dataset);
  if (!summary) return pass(summary.error());
  options.verified = &*verified;
  options.handover = &handover;
  auto report = make_report(*summary, dataset, options);
  if (!report) return pass(report.error());
  return std::vector<HandoverText>{{"report.html", std::move(report->html)},
                                   {"report.json", std::move(report->json)}};
}

}  // namespace weft::daemon
