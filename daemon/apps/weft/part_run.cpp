#include "daemon/apps/weft/part_run.hpp"

#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>

#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/progress.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

json part_json(const PartSummary& s, const std::filesystem::path& out) {
  json campaigns = json::array();
  for (const PartCampaign& one : s.campaigns)
    campaigns.push_back({{"fabric", one.fabric},
                         {"folder", (out / one.folder).string()},
                         {"dataset_sha256", one.dataset_sha256},
                         {"trials", one.trials}});
  json object{{"command", "run"},
              {"bench", to_string(s.bench)},
              {"campaign", s.name},
              {"part", to_string(s.part)},
              {"out", out.string()},
              {"is_complete", !s.incomplete},
              {"is_promise_missed", s.is_promise_missed},
              {"virtual_s", s.virtual_s},
              {"wall_s", s.wall_s},
              {"campaigns", std::move(campaigns)}};
  if (s.incomplete) object["incomplete"] = run_json(*s.incomplete);
  return object;
}

std::string part_text(const PartSummary& s, const std::filesystem::path& out) {
  std::size_t trials = 0;
  for (const PartCampaign& one : s.campaigns) trials += one.trials;
  Table facts(Align::left);
  facts.row({"fabrics", std::to_string(s.campaigns.size())});
  facts.row({"trials", std::to_string(trials)});
  if (s.virtual_s > 0) facts.row({"bench time", duration(s.virtual_s)});
  facts.row({"wall time", duration(s.wall_s)});
  facts.row({"folder", out.string()});
  return bench_banner(s.bench) + "Part " + to_string(s.part) + " of campaign " + s.name +
         (s.incomplete ? ", incomplete" : "") + "\n" + facts.text();
}

struct MergeArgs {
  std::vector<std::filesystem::path> parts;
  std::filesystem::path out;
  bool by_rig = false;
};

void add_options(CLI::App& command, MergeArgs& args) {
  command
      .add_option("PART", args.parts, "folders of `weft run --part`, or data sets of one fabric")
      ->required();
  command.add_option("-o,--output", args.out, "write the data set to this file (HDF5)")->required();
  command.add_flag("--by-rig", args.by_rig,
                   "accept parts of several rigs; group the trials by rig as well");
}

Result<int> run_merge(const MergeArgs& args, Console& console) {
  if (auto ok = check_output(args.out); !ok) return pass(ok.error());
  for (const auto& part : args.parts)
    if (auto ok = refuse_same_file(part, args.out); !ok) return pass(ok.error());
  const auto merged =
      merge_parts(args.parts, args.out, args.by_rig ? MergeRigs::several : MergeRigs::one);
  if (!merged) return pass(merged.error());
  Table facts(Align::left);
  facts.row({"file", args.out.string()});
  facts.row({"campaign", merged->info.name});
  facts.row({"trials",
             thousands(merged->trials) + " of " + std::to_string(merged->datasets) + " data sets"});
  facts.row({"sha256", merged->sha256});
  print(console, bench_banner(merged->info.kind) + facts.text(),
        {{"command", "dataset merge"},
         {"file", args.out.string()},
         {"bench", to_string(merged->info.kind)},
         {"name", merged->info.name},
         {"trials", merged->trials},
         {"datasets", merged->datasets},
         {"dataset_sha256", merged->sha256}});
  return exit_ok;
}

}  // namespace

Result<int> run_part_here(const CampaignRequest& request, const PartNumber& part, bool yes,
                          Console& console) {
  ProgressPrinter progress(console.err, console.terminal);
  const StopSignals signals(StopSignals::Hangup::stops, StopSignals::Suspend::allowed);
  RunOrders orders;
  std::optional<ConsolePrompt> people;
  PartHooks hooks;
  hooks.campaign.stop = &signals.requested();
  hooks.campaign.orders = &orders;
  hooks.campaign.progress = [&](const TrialProgress& line) { progress(line); };
  hooks.campaign.device_log = [&](const DeviceLogEntry& line) {
    progress.finish();
    print_device_log(line, console);
  };
  hooks.campaign.moment = [&](const RunStatusUpdate& moment) {
    if (people) people->moment(moment);
  };
  hooks.begins = [&](const std::string& fabric, std::size_t prompts) {
    progress.finish();
    console.err << "weft: " << fabric << '\n';
    people.reset();
    if (prompts > 0) people.emplace(yes ? -1 : console.keyboard, console.err, orders);
  };
  const auto summary = run_part(request, part, hooks);
  progress.finish();
  if (!summary) return pass(summary.error());
  print(console, part_text(*summary, request.out), part_json(*summary, request.out));
  if (!summary->incomplete) return summary->is_promise_missed ? exit_promise_missed : exit_ok;
  console.err << "weft: part " << to_string(part) << " is incomplete ("
              << format_incomplete(*summary->incomplete)
              << "); continue it with the same command and --resume" << std::endl;
  return signals.number() != 0 ? exit_signal + signals.number() : exit_failure;
}

void add_merge_command(const CommandGroup& dataset) {
  dataset.add<MergeArgs>("merge", run_merge);
}

}  // namespace weft::daemon::cli
