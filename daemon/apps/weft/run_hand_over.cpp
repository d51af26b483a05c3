#include "daemon/apps/weft/run_hand_over.hpp"

#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/analysis/handover/hand_over.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

std::string share_text(const HandedShare& share) {
  return percent(share.share, 1) + " % (95 %: " + percent(share.ci95_low, 1) + " to " +
         percent(share.ci95_high, 1) + ")";
}

}  // namespace

std::optional<RunHandOver> hand_over_of(const CampaignSummary& summary,
                                        const std::filesystem::path& folder, Console& console) {
  if (!is_complete(summary)) return std::nullopt;
  const auto wanted = wanted_hand_over(folder);
  if (!wanted) return RunHandOver{std::nullopt, wanted.error()};
  if (!*wanted) return std::nullopt;
  const StopSignals signals;
  HandOverHooks hooks;
  hooks.stop = [&signals] { return signals.asked().load(std::memory_order_relaxed); };
  hooks.seconds_now = steady_wall_seconds;
  hooks.progress = [&console](const EvaluationProgress& p) {
    console.err << "hand over " << p.step + 1 << "/" << p.steps << ": " << p.what << std::endl;
  };
  auto done = hand_over(folder, hooks);
  if (!done) return RunHandOver{std::nullopt, done.error()};
  return RunHandOver{std::move(*done), std::nullopt, folder / hand_over_folder_name};
}

std::string text_of(const RunHandOver& hand_over) {
  if (!hand_over.done) return {};
  std::string out;
  if (hand_over.done->models.empty() && hand_over.done->evaluations.empty())
    out += "Handed over (" + hand_over.done->bench + "): " + hand_over.folder.string() + "\n";
  for (const HandedModel& model : hand_over.done->models)
    out += "Model " + model.file + " (" + model.learner + ", " + std::to_string(model.trained) +
           " trials, " + hand_over.done->bench + "): accuracy " + percent(model.accuracy, 1) +
           " % (95 %: " + percent(model.ci95_low, 1) + " to " + percent(model.ci95_high, 1) +
           ") on " + std::to_string(model.asked) + " trials left out in turn\n";
  for (const HandedEvaluation& e : hand_over.done->evaluations)
    out += "Sound and vibration of " + e.exploration + " (" + e.learner + ", " +
           std::to_string(e.recordings) + " slides over " + std::to_string(e.materials) +
           " textures, " + hand_over.done->bench + "), repetitions left out: windows of " +
           general(e.window_s) + " s " + share_text(e.windows) + ", slides " +
           share_text(e.slides) + ", chance " + percent(1.0 / static_cast<double>(e.materials), 1) +
           " %; " + e.page + "\n";
  return out;
}

nlohmann::json json_of(const RunHandOver& hand_over) {
  if (hand_over.done) {
    nlohmann::json out = handed_over_json(*hand_over.done);
    out["state"] = "done";
    return out;
  }
  return {{"state", "failed"}, {"error", to_string(*hand_over.failed)}};
}

}  // namespace weft::daemon::cli
