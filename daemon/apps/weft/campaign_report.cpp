#include "daemon/apps/weft/campaign_report.hpp"

#include <sys/utsname.h>

#include <nlohmann/json.hpp>
#include <ostream>
#include <thread>

#include "daemon/analysis/design/design_page.hpp"
#include "daemon/analysis/handover/handover.hpp"
#include "daemon/analysis/report/evaluate_campaign.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/quick_audit.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {
namespace {

EvaluationSink progress_to(Console& console) {
  return [&console](const EvaluationProgress& p) {
    console.err << "classify " << p.step + 1 << "/" << p.steps << ": " << p.what << std::endl;
  };
}

Result<std::vector<CampaignBeside>> evaluated_beside(
    const std::vector<std::filesystem::path>& folders, const EvaluateOptions& options,
    Console& console) {
  std::vector<CampaignBeside> out;
  for (const std::filesystem::path& folder : folders) {
    auto dataset = read_hdf5(folder / dataset_file_name);
    if (!dataset) return pass(dataset.error(), "--beside");
    auto one = evaluate_beside(std::move(*dataset), options, progress_to(console));
    if (!one) return pass(one.error(), "--beside " + folder.string());
    out.push_back(std::move(*one));
  }
  return out;
}

/// `can_measure`: there are slides to be told apart. None, and why, where the classifier refuses.
std::vector<Headline> headlines_of(const Dataset& dataset, const HandoverResult* handover,
                                   bool can_measure, Console& console) {
  if (handover != nullptr) return handover_headlines(*handover, dataset);
  if (!can_measure) return {};
  console.err << "classify: the headline, each group of repetitions left out in turn" << std::endl;
  auto measured = measure_headlines(dataset);
  if (measured) return std::move(*measured);
  console.err << "weft: no headline: " << to_string(measured.error()) << std::endl;
  return {};
}

std::string share_text(const HandoverShare& share) {
  return percent(share.share, 1) + " % (95 %: " + percent(share.ci95_low, 1) + " to " +
         percent(share.ci95_high, 1) + ")";
}

}  // namespace

void add_beside_option(CLI::App& command, std::vector<std::filesystem::path>& beside) {
  command
      .add_option(
          "--beside", beside,
          "folders of campaigns with another \"repetition\", with commas between: show their "
          "accuracies beside this one's")
      ->delimiter(',')
      ->check(CLI::ExistingDirectory);
}

std::string machine_text() {
  utsname system{};
  std::string text = std::to_string(std::thread::hardware_concurrency()) + " threads";
  if (uname(&system) == 0)
    text += std::string(", ") + system.sysname + " " + system.release + " " + system.machine;
  return text + ", compiler " + __VERSION__;
}

Result<CampaignReport> write_report(const CampaignSummary& summary, const Dataset& dataset,
                                    const std::filesystem::path& html, std::size_t repeats,
                                    const ReportExtras& extras, Console& console) {
  EvaluateOptions options;
  options.repeats = repeats;
  if (!extras.beside.empty()) options.best_splits = 3;  // about 3 s a row of the demo on two cores
  // What a live vote has left says nothing of all slides.
  const bool selected = !dataset.info.ended_early.empty();
  // Imprints have rules of their own: the hand-over's.
  // So has a sweep: its cells are weighed against each other, see weft design analyse.
  auto results =
      selected || holds_imprints(dataset) || !dataset.info.factors.empty()
          ? Result<std::vector<ExplorationResult>>()
          : evaluate_campaign(dataset, options, steady_wall_seconds, progress_to(console));
  CampaignReport report;
  report.selected = selected;
  report.html = html;
  report.json = std::filesystem::path(html).replace_extension(".json");
  if (!results) report.not_classified = results.error();
  const std::vector<ExplorationResult> none;
  const DesignParts design = selected || holds_imprints(dataset) || !results
                                 ? DesignParts{}
                                 : analyse_design(dataset, [&console](const std::string& what) {
                                     console.err << "design: " << what << std::endl;
                                   });
  ReportInput input{summary,        dataset,           results ? *results : none,
                    machine_text(), software_commit(), design};
  const auto beside = evaluated_beside(extras.beside, options, console);
  if (!beside) return pass(beside.error());
  if (!beside->empty()) input.beside = &*beside;
  input.headlines = headlines_of(dataset, extras.handover, results && !results->empty(), console);
  input.verified = extras.verified;
  input.tradeoff_html = extras.tradeoff_html;
  if (extras.audit) {
    console.err << "audit, in its quick form" << std::endl;
    input.audit = audit_quickly(summary.dataset_file, dataset);
  }
  if (auto ok = write_report_html(input, report.html); !ok) return pass(ok.error());
  if (auto ok = write_report_json(input, report.json); !ok) return pass(ok.error());
  report.summary = summary_text(input);
  return report;
}

std::optional<RunHandover> handover_of_run(const CampaignSummary& summary,
                                           const std::filesystem::path& folder, Console& console) {
  if (!is_complete(summary)) return std::nullopt;
  const auto wanted = load_handover_spec(folder);
  if (!wanted) return RunHandover{std::nullopt, wanted.error()};
  if (!*wanted) return std::nullopt;
  const StopSignals signals(StopSignals::Hangup::stops, StopSignals::Suspend::allowed);
  HandoverHooks hooks;
  hooks.stop = [&signals] { return signals.requested().load(std::memory_order_relaxed); };
  hooks.seconds_now = steady_wall_seconds;
  hooks.progress = [&console](const EvaluationProgress& p) {
    console.err << "hand over " << p.step + 1 << "/" << p.steps << ": " << p.what << std::endl;
  };
  auto done = run_handover(folder, hooks);
  const bool by_default = (*wanted)->by_default;
  if (!done) return RunHandover{std::nullopt, done.error(), {}, by_default};
  return RunHandover{std::move(*done), std::nullopt, folder / handover_folder_name, by_default};
}

std::string format_text(const RunHandover& handover) {
  if (!handover.done) return {};
  std::string out;
  if (handover.done->models.empty() && handover.done->evaluations.empty())
    out += "Handed over (" + handover.done->bench + "): " + handover.folder.string() + "\n";
  for (const HandoverModel& model : handover.done->models)
    out += "Model " + model.file + " (" + model.learner + ", " + std::to_string(model.trained) +
           " trials, " + handover.done->bench + "): accuracy " + percent(model.accuracy, 1) +
           " % (95 %: " + percent(model.ci95_low, 1) + " to " + percent(model.ci95_high, 1) +
           ") on " + std::to_string(model.requested) + " trials left out in turn\n";
  for (const HandoverEvaluation& e : handover.done->evaluations)
    out += "Sound and vibration of " + e.exploration + " (" + e.learner + ", " +
           std::to_string(e.recordings) + " slides over " + std::to_string(e.materials) +
           " textures, " + handover.done->bench + "), repetitions left out: windows of " +
           general(e.window_s) + " s " + share_text(e.windows) + ", slides " +
           share_text(e.slides) + ", chance " + percent(1.0 / static_cast<double>(e.materials), 1) +
           " %; " + e.page + "\n";
  return out;
}

nlohmann::json json_of(const RunHandover& handover) {
  if (handover.done) {
    nlohmann::json out = handover_result_json(*handover.done);
    out["state"] = "done";
    return out;
  }
  return {{"state", "failed"}, {"error", to_string(*handover.failed)}};
}

}  // namespace weft::daemon::cli
