#include "daemon/apps/weft/campaign_report.hpp"

#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/analysis/handover/handover.hpp"
#include "daemon/apps/weft/quick_audit.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

EvaluationSink progress_to(Console& console) {
  return [&console](const EvaluationProgress& p) {
    console.err << "classify " << p.step + 1 << "/" << p.steps << ": " << p.what << std::endl;
  };
}

std::string share_text(const HandoverShare& share) {
  return percent(share.share, 1) + " % (95 %: " + percent(share.ci95_low, 1) + " to " +
         percent(share.ci95_high, 1) + ")";
}

}  // namespace

void add_beside_option(CLI::App& command, std::vector<std::filesystem::path>& beside) {
  command
      .add_option("--beside", beside,
                  "compare with the accuracy of these campaigns (comma-separated folders)")
      ->delimiter(',')
      ->check(CLI::ExistingDirectory);
}

Result<WrittenReport> write_report(const CampaignSummary& summary, const Dataset& dataset,
                                   const std::filesystem::path& html, ReportOptions options,
                                   bool audit, Console& console) {
  options.progress = progress_to(console);
  options.note = [&console](const std::string& text) { console.err << text << std::endl; };
  if (audit)
    options.audit = [&] {
      console.err << "running the quick audit" << std::endl;
      return audit_quickly(summary.dataset_file, dataset);
    };
  auto report = make_report(summary, dataset, options);
  if (!report) return pass(report.error());
  WrittenReport out{std::move(*report), html,
                    std::filesystem::path(html).replace_extension(".json")};
  if (Status ok = write_text_file(out.html, out.report.html); !ok) return pass(ok.error());
  if (Status ok = write_text_file(out.json, out.report.json); !ok) return pass(ok.error());
  return out;
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
    console.err << "handover " << p.step + 1 << "/" << p.steps << ": " << p.what << std::endl;
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
    out += "Handover (" + handover.done->bench + "): " + handover.folder.string() + "\n";
  for (const HandoverModel& model : handover.done->models)
    out += "Model " + model.file + " (" + model.learner + ", " + std::to_string(model.trained) +
           " trials, " + handover.done->bench + "): accuracy " + percent(model.accuracy, 1) +
           " % (95 %: " + percent(model.ci95_low, 1) + " to " + percent(model.ci95_high, 1) +
           ") on " + std::to_string(model.requested) + " trials, by cross-validation\n";
  for (const HandoverEvaluation& e : handover.done->evaluations)
    out += "Vibration of " + e.exploration + " (" + e.learner + ", " +
           std::to_string(e.recordings) + " strokes on " + std::to_string(e.materials) +
           " textures, " + handover.done->bench + "), cross-validated by repetition: windows of " +
           general(e.window_s) + " s " + share_text(e.windows) + ", strokes " +
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
