#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <vector>

#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/campaign_report.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/part_run.hpp"
#include "daemon/apps/weft/progress.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/apps/weft/train_command.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/loop/threads.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/promise_text.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/campaign/strict_run.hpp"
#include "daemon/service/daemon/weftd.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct RunArgs {
  std::filesystem::path recipe;
  std::filesystem::path rig;
  std::filesystem::path out;
  std::optional<std::uint64_t> seed;  ///< overrides the recipe's
  ParameterArgs parameters;
  FidelityArgs fidelity;
  PluginArgs plugins;
  bool error_check = true;
  bool evaluate = true;
  bool yes = false;                                ///< operator steps count as done without asking
  bool resume = false;                             ///< resume the campaign in `out`
  std::filesystem::path level;                     ///< result of weft align --json; empty: none
  double level_max_age_h = 24;                     ///< 0: any age
  bool preview = false;                            ///< with resume: print the rest, move nothing
  std::size_t repeats = 30;                        ///< random splits of the evaluation
  std::vector<std::filesystem::path> beside = {};  ///< campaigns that differ in the repetition
  std::filesystem::path socket = {};               ///< empty: OUT/weftd.sock
  std::string part = {};                           ///< "2/3"; empty: the whole campaign
};

using Campaign = std::function<Result<CampaignSummary>(const CampaignHooks& hooks)>;

/// Removes the folders that were made only for the socket.
class FoldersForSocket {
 public:
  explicit FoldersForSocket(const std::filesystem::path& folder) {
    std::error_code error;
    for (auto missing = std::filesystem::absolute(folder);
         missing.has_relative_path() && !std::filesystem::exists(missing, error);
         missing = missing.parent_path())
      missing_.push_back(missing);
  }
  ~FoldersForSocket() {
    std::error_code error;  // a folder that is not empty stays
    for (const auto& folder : missing_) std::filesystem::remove(folder, error);
  }
  FoldersForSocket(const FoldersForSocket&) = delete;
  FoldersForSocket& operator=(const FoldersForSocket&) = delete;

 private:
  std::vector<std::filesystem::path> missing_;  // the innermost first
};

/// Calls `campaign` once, on another thread, and serves it on the socket until it has ended.
/// Requests of clients arrive as orders in `hooks`. If there is no socket, it reports that and
/// calls `campaign` on this thread. An exception of `campaign` becomes an error.
Result<CampaignSummary> run_with_daemon(const RunArgs& args, const CampaignRequest& request,
                                        const Campaign& campaign, Console& console) {
  const FoldersForSocket folders(request.out);
  const auto socket = args.socket.empty() ? request.out / "weftd.sock" : args.socket;
  std::optional<Result<CampaignSummary>> ran;
  server::EmbeddedRun embedded;
  embedded.request.recipe = request.recipe;
  embedded.request.seed = request.seed;
  embedded.request.by = "weft run";
  embedded.request.folder = std::filesystem::absolute(request.out);
  embedded.check = [&request] { return check_quickly(request); };
  embedded.perform = [&](const CampaignHooks& hooks) -> Result<CampaignSummary> {
    if (console.terminal)
      console.err << "weft: to control this run from another terminal: weft watch, pause, stop, "
                     "halt ... --socket "
                  << socket.string() << std::endl;
    ran = catch_as_error([&] { return campaign(hooks); });
    return *ran;
  };
  server::DaemonOptions options;
  options.rig = request.rig;
  options.recipes = std::filesystem::absolute(request.recipe).parent_path();
  options.data = request.out;
  options.socket = socket;
  const Status served =
      catch_as_error([&] { return server::run_daemon_for(options, embedded); }, "daemon");
  if (ran) return std::move(*ran);
  CampaignHooks alone;
  alone.rig_acquired = [&] {
    if (!served)
      console.err << "weft: no other terminal can watch or stop this run: "
                  << to_string(served.error()) << std::endl;
    return Status{};
  };
  return campaign(alone);
}

json summary_json(const CampaignSummary& s) {
  json out = run_json(s);
  out.erase("error");  // name reserved for failed commands
  out["command"] = "run";
  out["bench"] = to_string(s.bench);
  out["level"] = s.level;
  out["campaign_file"] = s.campaign_file.string();
  out["dataset_file"] = s.dataset_file.string();
  out.erase("dataset_error");  // only a sentence; all of it is below
  if (s.error) out["campaign_error"] = error_json(*s.error);
  if (s.dataset_error) out["dataset_error"] = error_json(*s.dataset_error);
  return out;
}

std::string summary_text(const CampaignSummary& s) {
  Table facts(Align::left);
  facts.row({"trials", std::to_string(s.trials_complete) + " of " +
                           std::to_string(s.trials_planned) + " complete" + format_ended_early(s)});
  if (s.attempts_rejected > 0)
    facts.row({"rejected attempts",
               std::to_string(s.attempts_rejected) + ", kept; their trials were repeated"});
  if (s.virtual_s > 0) facts.row({"bench time", duration(s.virtual_s)});
  facts.row({"wall time", duration(s.wall_s)});
  if (s.force.samples > 0)
    facts.row({"force error", fixed(s.force.rms_n(), 3) + " N RMS while regulated"});
  facts.row({"campaign", s.campaign_file.string()});
  if (!s.dataset_sha256.empty()) {
    facts.row({"data set", s.dataset_file.string()});
    facts.row({"sha256", s.dataset_sha256});
  }
  std::string out = bench_banner(s.bench) + "Campaign " + s.name +
                    (is_complete(s) ? "" : ", " + format_incomplete(s)) + "\n" + facts.text();
  if (s.error) out += "  first error: " + to_string(*s.error) + "\n";
  return out + simulation_text(s.simulation);
}

std::string report_text(const WrittenReport& written) {
  return written.report.summary + "Report: " + written.html.string() + ", " +
         written.json.string() + "\n";
}

json report_json(const CampaignSummary& summary, const WrittenReport& written) {
  const CampaignReport& report = written.report;
  json out = summary_json(summary);
  out["report_html"] = written.html.string();
  out["report_json"] = written.json.string();
  if (report.not_classified) out["not_classified"] = error_json(*report.not_classified);
  if (report.selected) out["selected"] = true;
  return out;
}

struct Ran {
  Result<CampaignSummary> summary;
  int signal;  ///< that asked the campaign to stop, or 0
};

CampaignRequest request_of(const RunArgs& args, Console& console) {
  CampaignRequest request{args.recipe,
                          args.rig,
                          args.out,
                          args.seed,
                          fidelity_request(args.fidelity),
                          args.error_check,
                          make_settings(args.plugins, console),
                          args.resume,
                          args.level,
                          std::chrono::seconds(std::llround(args.level_max_age_h * 3600))};
  request.parameters_json = parameters_json(args.parameters);
  request.fidelity.is_evaluated = args.evaluate;
  return request;
}

std::string preview_text(const ResumePreview& preview) {
  std::string text = std::to_string(preview.complete) + " of " + std::to_string(preview.planned) +
                     " trials are complete. To resume:\n";
  for (const std::string& step : preview.will) text += "  " + step + "\n";
  return text;
}

json preview_json(const ResumePreview& preview) {
  return {{"command", "run"},
          {"will", preview.will},
          {"trials_planned", preview.planned},
          {"trials_complete", preview.complete},
          {"trials_left", preview.left}};
}

/// Calls both, if there are both.
template <class Callback>
std::function<void(const Callback&)> both(std::function<void(const Callback&)> one,
                                          std::function<void(const Callback&)> other) {
  if (!other) return one;
  return [one = std::move(one), other = std::move(other)](const Callback& print_vote) {
    one(print_vote);
    other(print_vote);
  };
}

/// Runs the campaign with progress and stop signals of the terminal, beside the daemon's `hooks`.
/// `prompts`: the recipe has operator steps.
Ran run_until_stopped(const RunArgs& args, bool prompts, Console& console) {
  ProgressPrinter progress(console.err, console.terminal);
  const StopSignals signals(StopSignals::Hangup::stops, runs_in_real_time(args.rig)
                                                            ? StopSignals::Suspend::refused
                                                            : StopSignals::Suspend::allowed);
  const CampaignRequest request = request_of(args, console);
  const Campaign campaign = [&](CampaignHooks hooks) {
    RunOrders own_orders;
    std::optional<ConsolePrompt> people;
    hooks.progress = both<TrialProgress>([&](const auto& line) { progress(line); }, hooks.progress);
    hooks.device_log = [&](const DeviceLogEntry& line) {
      progress.finish();
      print_device_log(line, console);
    };
    hooks.stop = &signals.requested();
    if (hooks.orders == nullptr) hooks.orders = &own_orders;
    if (prompts) {
      people.emplace(args.yes ? -1 : console.keyboard, console.err, *hooks.orders);
      hooks.moment = both<RunStatusUpdate>(
          [&](const RunStatusUpdate& moment) {
            if (moment.requested) progress.finish();
            people->moment(moment);
          },
          hooks.moment);
    }
    auto summary = run_until_held(request, hooks);
    progress.finish();
    return summary;
  };
  Result<CampaignSummary> summary = run_with_daemon(args, request, campaign, console);
  return {std::move(summary), signals.number()};
}

/// Prints the remains of a campaign that a signal stopped. Returns 128 plus the signal, like
/// shells.
int interrupted(const CampaignSummary& s, int signal, Console& console) {
  console.err << "weft: interrupted by signal " << signal << ": " << s.trials_complete << " of "
              << s.trials_planned << " trials complete, kept in " << s.campaign_file.string()
              << (s.dataset_sha256.empty() ? "" : " and " + s.dataset_file.string()) << std::endl;
  print(console, summary_text(s), summary_json(s));
  return exit_signal + signal;
}

Status refuse_inputs_as_outputs(const RunArgs& args) {
  for (const char* name : {campaign_file_name, dataset_file_name, "report.html", "report.json"})
    for (const auto& input : {args.recipe, args.rig, args.level})
      if (auto ok = refuse_same_file(input, args.out / name); !ok) return ok;
  return {};
}

/// Prints the outcome of the bench and the place of its record, although the record could not be
/// concluded.
int unconcluded(const CampaignSummary& s, Console& console) {
  print(console, summary_text(s), summary_json(s));
  return exit_failure;
}

/// Frees the data set before anything else is read.
Result<WrittenReport> report_of(const RunArgs& args, const CampaignSummary& summary,
                                const HandoverResult* handover, Console& console) {
  const Result<Dataset> dataset = read_hdf5(summary.dataset_file);
  if (!dataset) return pass(dataset.error());
  ReportOptions options;
  options.repeats = args.repeats;
  options.handover = handover;
  if (handover != nullptr) options.handover_files = load_handover_files(args.out);
  options.beside = args.beside;
  return write_report(summary, *dataset, args.out / "report.html", options, true, console);
}

/// Exit status of a campaign that ended.
int status_of(const CampaignSummary& summary) {
  if (!is_complete(summary)) return exit_failure;
  return is_promise_missed(summary.simulation) ? exit_promise_missed : exit_ok;
}

/// Classifies and reports the complete trials. Missing trials change the exit status, not the data.
/// `began_s`: start of the run on the wall clock [s].
Result<int> conclude(const RunArgs& args, const CampaignSummary& summary, double began_s,
                     Console& console) {
  const int recorded = status_of(summary);
  if (is_promise_missed(summary.simulation))
    console.err << "weft: " << format_promise(summary.simulation) << '\n';
  if (!args.evaluate && is_complete(summary) && summary.states_handover &&
      !is_handover_done(args.out))
    console.err << "weft: no handover, because of --no-evaluate. To make it, repeat the command "
                   "with --resume instead\n";
  if (!args.evaluate || summary.trials_complete == summary.trials_ended_early) {
    print(console, summary_text(summary), summary_json(summary));
    return recorded;
  }
  const auto result = handover_of_run(summary, args.out, console);
  const Result<WrittenReport> written =
      report_of(args, summary, result && result->done ? &*result->done : nullptr, console);
  if (!written) return pass(written.error());
  const CampaignReport& report = written->report;
  if (!is_complete(summary))
    console.err << "weft: campaign incomplete (" << format_incomplete(summary)
                << "); the report covers the complete trials only\n";
  if (report.not_classified)
    console.err << "weft: campaign not classified; its data are in "
                << summary.dataset_file.string() << ": " << to_string(*report.not_classified)
                << '\n';
  if (report.selected)
    console.err
        << "weft: campaign not classified: a live vote ended some strokes early, so the whole ones "
           "are a biased selection. To classify them anyway, use weft fabric evaluate\n";
  if (result && result->failed)
    console.err << "weft: handover failed; the data are in " << summary.dataset_file.string()
                << ": " << to_string(*result->failed) << '\n';
  json out = report_json(summary, *written);
  if (result) out["handover"] = json_of(*result);
  const double wall_s = steady_wall_seconds() - began_s;
  out["whole_run_wall_s"] = wall_s;
  if (const std::string whole = format_whole_run(summary.simulation, summary.virtual_s, wall_s);
      !whole.empty())
    console.err << "weft: " << whole << '\n';
  print(console, report_text(*written) + (result ? format_text(*result) : ""), out);
  const bool lacks = result && result->failed && !result->by_default;
  return report.not_classified || lacks ? exit_failure : recorded;
}

void add_options(CLI::App& command, RunArgs& args) {
  command.add_option("RECIPE", args.recipe, "recipe file (JSON)")->required();
  command.add_option("--rig", args.rig, "use this rig file (JSON)")->required();
  command.add_option("--out", args.out, "write campaign, data set and report to this folder")
      ->required();
  command.add_option("--seed", args.seed, "override the seed of the recipe")->check(seed_problem);
  add_options(command, args.parameters);
  add_options(command, args.fidelity);
  add_strict_option(command, args.fidelity);
  add_options(command, args.plugins);
  command.add_flag("!--no-error-check", args.error_check,
                   "do not measure the error of the simulation after the run");
  command.add_flag("!--no-evaluate", args.evaluate,
                   "record only: no evaluation, report or handover");
  command.add_option("--level", args.level,
                     "hold the plate at the level in this file, the output of `weft align --json`");
  add_number(command, "--level-max-age-h", args.level_max_age_h, 0.0, 1e6,
             "refuse a level measured longer ago than this; 0 accepts any");
  command.add_flag("--yes", args.yes,
                   "confirm all operator steps automatically, for a bench without operator");
  command.add_flag("--resume", args.resume,
                   "continue the campaign in the folder with the interrupted trial");
  command.add_flag("--preview", args.preview,
                   "with --resume: list the remaining steps; nothing moves");
  command.add_option("--socket", args.socket,
                     "serve this run at this Unix socket, for weft watch, pause, stop ...");
  command.add_option("--part", args.part,
                     "run part K/N of a simulated campaign, for `weft dataset merge`");
  add_count(command, "--repeats", args.repeats, 1, 100000,
            "evaluate on this number of random splits");
  add_beside_option(command, args.beside);
}

/// Refuses options that do not apply to a part.
Status check_part_options(const RunArgs& args) {
  for (const auto& [option, is_given] :
       {std::pair("--preview", args.preview), std::pair("--socket", !args.socket.empty()),
        std::pair("--accuracy-strict", args.fidelity.strict),
        std::pair("--beside", !args.beside.empty())})
    if (is_given)
      return fail({.code = Errc::invalid_argument,
                   .where = option,
                   .what = "option not possible with --part",
                   .hint = "Leave it out"});
  return {};
}

/// Returns exit_failure if not every trial is complete; exit_promise_missed if they are, but not
/// within the requested accuracy; exit_signal + number after SIGINT or SIGTERM.
Result<int> run_run(const RunArgs& args, Console& console) {
  const IgnoreWriteSignals to_the_end;
  if (auto ok = refuse_inputs_as_outputs(args); !ok) return pass(ok.error());
  const Result<Preflight> found = preflight(request_of(args, console));
  if (!found) return pass(found.error());
  if (!found->problems.empty()) return refuse(found->problems, console);
  if (args.preview && !args.resume)
    return fail({.code = Errc::invalid_argument,
                 .where = "--preview",
                 .what = "option needs --resume",
                 .hint = "Add --resume, or check the recipe with `weft check`"});
  if (args.resume && args.fidelity.strict)
    return fail({.code = Errc::invalid_argument,
                 .where = "--accuracy-strict",
                 .what = "option not possible with --resume",
                 .hint = "Leave it out, or start a new campaign in another folder"});
  if (args.resume && args.part.empty()) {
    const auto preview = preview_resume(request_of(args, console));
    if (!preview) return pass(preview.error());
    if (args.preview) {
      print(console, preview_text(*preview), preview_json(*preview));
      return exit_ok;
    }
    console.err << preview_text(*preview);
  }
  const bool prompts = found->plan->forecast.prompts > 0;
  if (prompts && !args.yes && console.keyboard < 0)
    return fail({.code = Errc::unsupported,
                 .where = "operator_steps",
                 .what = "no terminal to confirm the operator steps",
                 .expected = "a terminal as standard input, or --yes",
                 .got = std::to_string(found->plan->forecast.prompts) + " operator steps",
                 .hint = "Run it in a terminal, or with weftd and `weft confirm`; --yes is for a "
                         "bench without operator"});
  if (!args.part.empty()) {
    const auto part = part_number_from(args.part);
    if (!part) return pass(part.error());
    if (Status ok = check_part_options(args); !ok) return pass(ok.error());
    CampaignRequest request = request_of(args, console);
    request.fidelity.is_evaluated = false;
    return run_part_here(request, *part, args.yes, console);
  }
  const double began_s = steady_wall_seconds();
  const auto [summary, signal] = run_until_stopped(args, prompts, console);
  if (!summary && signal == 0) return pass(summary.error());
  if (!summary) {
    report(console, summary.error());
    return exit_signal + signal;
  }
  if (const std::string left = format_rig(summary->cleanup, summary->rig); !left.empty())
    console.err << "weft: " << left << std::endl;
  if (summary->dataset_error)
    console.err << "weft: the record of the campaign was not finished; recorded data are in "
                << summary->campaign_file.string() << ": " << to_string(*summary->dataset_error)
                << "\nweft: to continue, use weft run --resume" << std::endl;
  if (signal != 0) return interrupted(*summary, signal, console);
  if (summary->dataset_error) return unconcluded(*summary, console);
  return conclude(args, *summary, began_s, console);
}

}  // namespace

void add_run_command(const CommandGroup& weft) {
  weft.add<RunArgs>("run", run_run);
}

}  // namespace weft::daemon::cli
