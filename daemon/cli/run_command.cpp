#include "daemon/cli/run_command.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/cli/campaign_report.hpp"
#include "daemon/cli/progress.hpp"
#include "daemon/cli/stop_signals.hpp"
#include "daemon/cli/table.hpp"
#include "daemon/cli/train_options.hpp"
#include "daemon/cli/trial_choice.hpp"
#include "daemon/report/format.hpp"
#include "daemon/run/campaign.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

json time_json(const TimeShare& time) {
  return {{"plant_and_emulators_s", time.plant_and_emulators_s},
          {"drivers_and_control_s", time.drivers_and_control_s},
          {"recorder_s", time.recorder_s},
          {"export_s", time.export_s}};
}

json summary_json(const CampaignSummary& s) {
  json out{{"command", "run"},
           {"name", s.name},
           {"bench", to_string(s.bench)},
           {"level", s.level},
           {"outcome", recipes::to_string(s.outcome)},
           {"trials_planned", s.trials_planned},
           {"trials_complete", s.trials_complete},
           {"forecast_s", s.forecast_s},
           {"virtual_s", s.virtual_s},
           {"wall_s", s.wall_s},
           {"realtime_factor", s.wall_s > 0 ? s.virtual_s / s.wall_s : 0.0},
           {"force_rms_error_n", s.force.rms_n()},
           {"dataset_sha256", s.dataset_sha256},
           {"campaign_file", s.campaign_file.string()},
           {"dataset_file", s.dataset_file.string()},
           {"time", time_json(s.time)}};
  if (s.error) out["campaign_error"] = error_json(*s.error);
  return out;
}

std::string summary_text(const CampaignSummary& s) {
  Table facts(Align::left);
  facts.row({"trials", std::to_string(s.trials_complete) + " of " +
                           std::to_string(s.trials_planned) + " complete"});
  facts.row({"bench time", duration(s.virtual_s)});
  facts.row({"wall time", duration(s.wall_s)});
  facts.row({"force error", fixed(s.force.rms_n(), 3) + " N RMS in phase M"});
  facts.row({"campaign", s.campaign_file.string()});
  if (!s.dataset_sha256.empty()) {
    facts.row({"data set", s.dataset_file.string()});
    facts.row({"sha256", s.dataset_sha256});
  }
  std::string out = bench_banner(s.bench) + "Campaign " + s.name + "\n" + facts.text();
  if (s.error) out += "  first problem: " + to_string(*s.error) + "\n";
  return out;
}

std::string report_text(const CampaignReport& report) {
  std::string out = report.summary;
  if (report.not_classified) out += "Not classified: " + to_string(*report.not_classified) + "\n";
  return out + "Report: " + report.html.string() + ", " + report.json.string() + "\n";
}

json report_json(const CampaignSummary& summary, const CampaignReport& report) {
  json out = summary_json(summary);
  out["report_html"] = report.html.string();
  out["report_json"] = report.json.string();
  if (report.not_classified) out["not_classified"] = error_json(*report.not_classified);
  return out;
}

struct Ran {
  Result<CampaignSummary> summary;
  int signal;  ///< that asked the campaign to stop, or 0
};

Ran run_until_stopped(const RunArgs& args, Console& console) {
  ProgressPrinter progress(console.err, console.terminal);
  const StopSignals signals;
  CampaignHooks hooks;
  hooks.progress = [&progress](const TrialProgress& line) { progress(line); };
  hooks.device_log = [&](const DeviceLogLine& line) {
    progress.finish();
    console.err << "weft: " << line.device << ": "
                << (line.level == LogLevel::error ? "error: " : "warning: ") << line.text
                << std::endl;
  };
  hooks.stop = &signals.asked();
  Result<CampaignSummary> summary =
      run_campaign({args.recipe, args.rig, args.out, args.seed}, hooks);
  progress.finish();
  return {std::move(summary), signals.number()};
}

/// What a campaign that was asked to stop leaves behind. Returns the status of a process that the
/// signal ended, as shells count.
int interrupted(const CampaignSummary& s, int signal, Console& console) {
  console.err << "weft: interrupted by signal " << signal << ": kept " << s.trials_complete
              << " of " << s.trials_planned << " trials complete in " << s.campaign_file.string()
              << (s.dataset_sha256.empty() ? "" : " and " + s.dataset_file.string()) << std::endl;
  print(console, summary_text(s), summary_json(s));
  return exit_signal + signal;
}

}  // namespace

void add_options(CLI::App& command, RunArgs& args) {
  command.add_option("RECIPE", args.recipe, "recipe file (JSON)")->required();
  command.add_option("--rig", args.rig, "rig file (JSON)")->required();
  command.add_option("--out", args.out, "folder for the campaign, its data set and report")
      ->required();
  command.add_option("--seed", args.seed, "in place of the recipe's")->check(seed_problem);
  command.add_flag("!--no-evaluate", args.evaluate, "record only: no classification, no report");
  command.add_option("--repeats", args.repeats, "random splits of the classification")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
}

Result<int> run_run(const RunArgs& args, Console& console) {
  const auto [summary, signal] = run_until_stopped(args, console);
  if (!summary && signal == 0) return pass(summary.error());
  if (!summary) {
    report(console, summary.error());
    return exit_signal + signal;
  }
  if (signal != 0) return interrupted(*summary, signal, console);
  const bool complete = summary->trials_complete == summary->trials_planned;
  if (!complete || !args.evaluate) {
    print(console, summary_text(*summary), summary_json(*summary));
    return complete ? exit_ok : exit_failure;
  }
  const Result<CampaignReport> report = write_report(*summary, args.out, args.repeats, console);
  if (!report) return pass(report.error());
  print(console, report_text(*report), report_json(*summary, *report));
  return exit_ok;
}

}  // namespace weft::daemon::cli
