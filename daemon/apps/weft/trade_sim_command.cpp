#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>

#include "daemon/analysis/tradeoff/sim/measure_sim.hpp"
#include "daemon/analysis/tradeoff/sim/promise_table.hpp"
#include "daemon/analysis/tradeoff/sim/sim_page.hpp"
#include "daemon/apps/weft/campaign_report.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
#include "daemon/apps/weft/trade_command.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/installed_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"

namespace weft::daemon::cli {
namespace {

using Progress = std::function<void(const std::string&)>;

struct TradeSimArgs {
  TradeoffFiles files;
  std::filesystem::path table;      ///< sim/fidelity.json; empty: not written
  std::filesystem::path reference;  ///< trajectories of another solver; empty: the finest run
  std::filesystem::path fabrics = "sim/fabrics.json";
  std::filesystem::path rig = "sim/rigs/bench17.json";  ///< for the table
  std::size_t table_recipes = 800, table_seeds = 1;
  std::vector<std::string> scenes;  ///< empty: all; "none"
  bool quick = false;
  std::size_t timings = 7;
  bool downstream = false;
  std::size_t seeds = 5;   ///< for downstream
  std::size_t trials = 8;  ///< for downstream: on each swatch
};

constexpr const char* no_scene = "none";
constexpr double quick_slide_s = 2;

Result<std::string> read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  if (!(text << file.rdbuf()))
    return fail({.code = Errc::not_found,
                 .where = path.string(),
                 .what = "file not readable",
                 .expected = "a file",
                 .hint = "Run it in the root of the repository, or name the file"});
  return text.str();
}

Result<sim::FabricLibrary> load_library(const TradeSimArgs& args) {
  const auto text = read_text(find_installed(args.fabrics));
  if (!text) return pass(text.error(), "--fabrics");
  auto library = sim::parse_fabrics(*text);
  if (!library) return pass(library.error(), args.fabrics.string());
  return library;
}

std::vector<std::string> scenes_of(const TradeSimArgs& args) {
  if (args.files.page.empty() || args.scenes == std::vector<std::string>{no_scene}) return {};
  return args.scenes.empty() ? sim_scene_names() : args.scenes;
}

/// Only the table was requested.
bool makes_table_alone(const TradeSimArgs& args) {
  return args.files.page.empty();
}

Status check_files(const TradeSimArgs& args) {
  if (makes_table_alone(args) && (args.table.empty() || args.downstream))
    return fail({.code = Errc::invalid_argument,
                 .where = "--output",
                 .what = "no output file",
                 .expected = "-o PAGE.html, or --table FILE without --downstream"});
  std::vector<std::filesystem::path> inputs{find_installed(args.fabrics)};
  if (!args.reference.empty()) inputs.push_back(args.reference);
  const Output outputs[] = {
      {"page", args.files.page}, {"data", args.files.data}, {"table", args.table}};
  if (!args.table.empty()) inputs.push_back(find_installed(args.rig));
  if (Status ok = check_outputs(inputs, outputs); !ok) return ok;
  return check_page(inputs, args.files);
}

Result<SimTradeoffOptions> make_options(const TradeSimArgs& args,
                                        const sim::FabricLibrary& library) {
  SimTradeoffOptions out;
  out.scenes = scenes_of(args);
  out.timings = args.timings;
  out.quick = args.quick;
  if (args.reference.empty()) return out;
  std::vector<SimScene> scenes;
  for (const std::string& name : out.scenes) {
    auto scene = make_sim_scene(name, library, args.quick);
    if (!scene) return pass(scene.error());
    scenes.push_back(std::move(*scene));
  }
  const auto text = read_text(args.reference);
  if (!text) return pass(text.error(), "--reference");
  auto references = read_references(*text, scenes);
  if (!references) return pass(references.error(), args.reference.string());
  out.references = std::move(*references);
  return out;
}

std::string load_text() {
  double load[3] = {};
  return getloadavg(load, 3) > 0 ? fixed(load[0], 1) : std::string("unknown");
}

std::string command_text(const TradeSimArgs& args) {
  std::string out = "weft trade sim";
  if (!args.scenes.empty()) out += " --scenes " + joined(args.scenes, ",");
  if (args.quick) out += " --quick";
  if (args.downstream)
    out += " --downstream --seeds " + std::to_string(args.seeds) + " --trials " +
           std::to_string(args.trials);
  if (!args.reference.empty()) out += " --reference " + args.reference.filename().string();
  return out;
}

std::string read_text(const SimSceneResult& scene) {
  Table table;
  table.row({"setting", "force error", "rms", "step error", "taxels LSB rms", "x real time",
             "median", "front"});
  const auto newtons = [](double n) { return general(n) + " N"; };
  for (const SimPoint& p : scene.points)
    table.row({p.setting.name(), newtons(p.total.worst_n.max), newtons(p.total.worst_n.rms),
               p.discretisation ? newtons(p.discretisation->worst_n.max) : "",
               p.total.pads_lsb ? fixed(p.total.pads_lsb->rms, 3) : "", fixed(1 / p.best_s, 0),
               fixed(1 / p.median_s, 0), p.front ? "*" : p.failure});
  std::string out =
      "SIMULATED  " + scene.scene + ": " + scene.words + "\nreference: " + scene.reference + "\n";
  if (scene.agreement_n)
    out += "finest L2 differs from the reference by " + newtons(scene.agreement_n->max) + "\n";
  out += table.text();
  for (const SimRefusal& r : scene.refusals)
    out += "  refused: " + r.setting.name() + ", " + r.why + "\n";
  return out + "\n";
}

std::string read_text(const DownstreamResult& result) {
  Table table;
  std::vector<std::string> head{"channels", "learner", "pieces"};
  for (const std::string& level : result.levels) head.push_back("trained " + level);
  table.row(head);
  std::vector<std::string> row;
  for (const Transfer& t : result.transfers) {
    if (t.tested != result.levels.back()) continue;
    if (row.empty()) row = {t.channels, t.learner, t.across_swatches ? "others" : "same"};
    row.push_back(percent(t.accuracy.mean) + " (" + percent(t.accuracy.ci95.low) + " to " +
                  percent(t.accuracy.ci95.high) + ")");
    if (row.size() < head.size()) continue;
    table.row(row);
    row.clear();
  }
  std::string out = "SIMULATED  accuracy % when tested at " + result.levels.back() +
                    ", 95 % intervals over " + std::to_string(result.seeds) + " seeds\n" +
                    table.text();
  for (const FeatureShift& s : result.shifts)
    out += "  " + s.channels + " at " + s.level + ": Spearman " + fixed(s.spearman.mean, 3) +
           ", largest shift " + general(s.max_shift.mean) + " deviations (" + s.shifted + ")\n";
  return out + "\n";
}

Result<DownstreamResult> downstream(const TradeSimArgs& args, const sim::FabricLibrary& library,
                                    const Progress& progress) {
  DownstreamOptions options;
  options.seeds = args.seeds;
  options.campaign.trials = args.trials;
  if (args.quick) {
    options.campaign.fabrics = quick_fabrics;
    options.campaign.slide_s = quick_slide_s;
  }
  return measure_downstream(library, options, progress);
}

Status write(const TradeSimArgs& args, const SimTradeoffReport& report) {
  if (!makes_table_alone(args))
    if (Status ok =
            write_page_files(args.files.page, sim_tradeoff_json(report), sim_document(report));
        !ok)
      return ok;
  if (!args.files.data.empty() && args.files.data != record_beside(args.files.page))
    if (Status ok = write_json(args.files.data, sim_tradeoff_json(report), 2); !ok) return ok;
  return {};
}

std::string table_command_text(const TradeSimArgs& args) {
  const TradeSimArgs defaults;
  std::string out = "weft trade sim --table " + args.table.filename().string();
  if (args.table_recipes != defaults.table_recipes)
    out += " --table-recipes " + std::to_string(args.table_recipes);
  if (args.table_seeds != defaults.table_seeds)
    out += " --table-seeds " + std::to_string(args.table_seeds);
  if (args.rig != defaults.rig) out += " --rig " + args.rig.filename().string();
  if (args.fabrics != defaults.fabrics) out += " --fabrics " + args.fabrics.filename().string();
  return out;
}

Status write_table(const TradeSimArgs& args, const Progress& progress) {
  if (args.table.empty()) return {};
  const auto rig = read_text(find_installed(args.rig));
  if (!rig) return pass(rig.error(), "--rig");
  const auto fabrics = read_text(find_installed(args.fabrics));
  if (!fabrics) return pass(fabrics.error(), "--fabrics");
  PromiseTableOptions options;
  options.scenes = args.table_recipes;
  options.seeds = args.table_seeds;
  options.rig_json = *rig;
  options.fabrics_json = *fabrics;
  auto table = measure_promise_table(options, process_cpu_seconds, progress);
  if (!table) return pass(table.error(), "--table");
  if (Status holds = check_margins(*table); !holds) return pass(holds.error(), "--table");
  table->made_by = table_command_text(args);
  table->commit = software_commit();
  table->machine = machine_text();
  table->compiler = __VERSION__;
  return write_text_file(args.table, sim::to_json(*table));
}

SimTradeoffReport empty_report(const TradeSimArgs& args) {
  SimTradeoffReport out;
  out.command = command_text(args);
  out.timing =
      "processor time of this process, best and median of " + std::to_string(args.timings) +
      " repetitions of the whole scene, one thread; without the construction of the models";
  out.machine = machine_text();
  out.software = software_version();
  out.commit = software_commit();
  return out;
}

void add_options(CLI::App& command, TradeSimArgs& args) {
  command.add_option("-o,--output", args.files.page, "write the page to this file (HTML)");
  command.add_option("--data", args.files.data,
                     "write the numbers of the page to this file (JSON)");
  command.add_option("--table", args.table,
                     "also measure random recipes and write a table of settings to this file");
  command.add_option("--rig", args.rig, "measure the table on this simulated rig (JSON)")
      ->capture_default_str();
  add_count(command, "--table-recipes", args.table_recipes, 1, 100000,
            "measure the table on this number of random recipes");
  add_count(command, "--table-seeds", args.table_seeds, 1, 1000,
            "simulate this number of benches for each recipe of the table");
  command.add_option("--reference", args.reference,
                     "compare with trajectories of another solver (bench_sim_reference)");
  command.add_option("--fabrics", args.fabrics, "use this fabric table")->capture_default_str();
  add_list(command, "--scenes", args.scenes,
           "run these scenes (comma-separated: press, slide, stick_slip, ..., none)")
      ->check(CLI::IsMember([] {
        std::vector<std::string> names = sim_scene_names();
        names.emplace_back(no_scene);
        return names;
      }()));
  command.add_flag("--quick", args.quick, "run few steps and three fabrics, as a functional test");
  command.add_flag("--downstream", args.downstream,
                   "also train classifiers at one level and test them at another");
  add_count(command, "--seeds", args.seeds, 2, 1000,
            "repeat --downstream with N seeds: new rigs, pieces and trials");
  add_count(command, "--trials", args.trials, 4, 1000,
            "simulate N trials on each piece of a fabric for --downstream");
  add_count(command, "--timings", args.timings, 1, 10000,
            "repeat each timing N times and show best and median");
}

Result<int> run_trade_sim(const TradeSimArgs& args, Console& console) {
  if (Status ok = check_files(args); !ok) return pass(ok.error());
  const auto library = load_library(args);
  if (!library) return pass(library.error());
  const auto options = make_options(args, *library);
  if (!options) return pass(options.error());
  SimTradeoffReport report = empty_report(args);
  report.load = load_text();
  const Progress progress = [&](const std::string& what) {
    console.err << "trade: " << what << std::endl;
  };
  if (!options->scenes.empty()) {
    auto scenes = measure_sim_tradeoff(*library, *options, process_cpu_seconds, progress);
    if (!scenes) return pass(scenes.error());
    report.scenes = std::move(*scenes);
  }
  if (args.downstream) {
    auto result = downstream(args, *library, progress);
    if (!result) return pass(result.error());
    report.downstream = std::move(*result);
  }
  report.load += " at the beginning, " + load_text() + " at the end (one-minute average)";
  if (Status ok = write_table(args, progress); !ok) return pass(ok.error());
  if (Status ok = write(args, report); !ok) return pass(ok.error());
  std::string text;
  for (const SimSceneResult& scene : report.scenes) text += read_text(scene);
  if (report.downstream) text += read_text(*report.downstream);
  if (!makes_table_alone(args)) text += "page: " + args.files.page.string() + "\n";
  if (!args.table.empty()) text += "table: " + args.table.string() + "\n";
  print(console, text, nlohmann::json(sim_tradeoff_json(report)));
  return exit_ok;
}

}  // namespace

void add_trade_sim_command(const CommandGroup& trade) {
  trade.add<TradeSimArgs>("sim", run_trade_sim);
}

}  // namespace weft::daemon::cli
