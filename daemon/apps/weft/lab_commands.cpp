// `weft lab`: the laboratory's shared store.

#include <charconv>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/daemon_call.hpp"
#include "daemon/apps/weft/lab_text.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/base/file/installed_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/service/lab/lab_store.hpp"
#include "recipes/engine/recipe_reader.hpp"
#include "recipes/schema/parameters.hpp"

namespace weft::daemon::cli {
namespace {

namespace fs = std::filesystem;
using lab::LabStore;
using nlohmann::json;

struct LabArgs {
  std::string uri;
};
/// Conditions on runs.
struct LabRunsArgs : LabArgs {
  std::string rig, recipe, state, bench, since, until;
  std::size_t limit = 50;
  std::optional<std::int64_t> after;
};
struct LabSearchArgs : LabRunsArgs {
  std::string text, fabric, digest;
};
struct LabSubmitArgs : LabArgs {
  fs::path recipe, rig;
  std::vector<std::string> rigs;
  std::optional<std::uint64_t> seed;
  ParameterArgs parameters;
};
struct LabCampaignArgs : LabArgs {
  std::string campaign;
};

void add_options(CLI::App& command, LabArgs& args) {
  command.add_option("--lab", args.uri,
                     "connect to this store: postgresql://USER@HOST/DATABASE (or WEFT_LAB)");
}

void add_time(CLI::App& command, const std::string& name, std::string& text,
              const std::string& help);

void add_conditions(CLI::App& command, LabRunsArgs& args) {
  command.add_option("--rig", args.rig, "list only runs of this rig");
  command.add_option("--recipe", args.recipe, "list only runs of the recipe with this name");
  command.add_option("--state", args.state, "list only runs in this state or with this outcome");
  add_keyword(command, "--bench", args.bench, {"simulated", "real"},
              "list only runs of this kind of bench");
  add_time(command, "--since", args.since, "list only runs that started at this time or later");
  add_time(command, "--until", args.until, "list only runs that started before this time");
  command.add_option("--limit", args.limit, "list at most this number of runs")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
}

void add_options(CLI::App& command, LabRunsArgs& args) {
  add_options(command, static_cast<LabArgs&>(args));
  add_conditions(command, args);
  command.add_option("--after", args.after, "continue after the run with this key")
      ->check(CLI::PositiveNumber);
}

void add_options(CLI::App& command, LabSearchArgs& args) {
  add_options(command, static_cast<LabArgs&>(args));
  command.add_option("TEXT", args.text, "words in rig, run, recipe, fabrics or folder");
  add_conditions(command, args);
  command.add_option("--fabric", args.fabric, "list only runs with this fabric");
  command.add_option("--digest", args.digest,
                     "list only runs with a digest that begins with these digits");
}

void add_options(CLI::App& command, LabSubmitArgs& args) {
  add_options(command, static_cast<LabArgs&>(args));
  command
      .add_option("RECIPE", args.recipe, "recipe file (JSON), or name of a recipe of the library")
      ->required();
  add_name_list(command, "--rigs", args.rigs, "rigs that may take a part, separated by commas")
      ->required();
  command.add_option("--seed", args.seed, "override the seed of the recipe")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{recipes::largest_seed}));
  command.add_option("--rig", args.rig, "check the recipe against this rig file (JSON) too");
  add_options(command, args.parameters);
}

void add_options(CLI::App& command, LabCampaignArgs& args) {
  add_options(command, static_cast<LabArgs&>(args));
  command.add_option("ID", args.campaign, "campaign, such as C-000012")->required();
}

/// UTC [us] of "2026-11-29" or "2026-11-29T06:30".
std::optional<std::int64_t> read_time(const std::string& text) {
  constexpr std::size_t date_length = 10, minute_length = 16;
  const auto number = [&](std::size_t from, std::size_t count) {
    int value = -1;
    const char* const end = text.data() + from + count;
    const auto [stop, error] = std::from_chars(text.data() + from, end, value);
    return error == std::errc() && stop == end ? value : -1;
  };
  const bool has_time = text.size() == minute_length && (text[10] == 'T' || text[10] == ' ');
  if ((text.size() != date_length && !has_time) || text[4] != '-' || text[7] != '-' ||
      (has_time && text[13] != ':'))
    return std::nullopt;
  const int year = number(0, 4), month = number(5, 2), day = number(8, 2);
  const int hour = has_time ? number(11, 2) : 0, minute = has_time ? number(14, 2) : 0;
  if (year < 0 || month < 0 || day < 0 || hour < 0 || hour > 23 || minute < 0 || minute > 59)
    return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) return std::nullopt;
  const std::chrono::microseconds time = std::chrono::sys_days(date).time_since_epoch() +
                                         std::chrono::hours(hour) + std::chrono::minutes(minute);
  return time.count();
}

void add_time(CLI::App& command, const std::string& name, std::string& text,
              const std::string& help) {
  command.add_option(name, text, help + " (UTC)")->check([](const std::string& typed) {
    return read_time(typed) ? ""
                            : "no time: " + typed + " (expected 2026-11-29 or 2026-11-29T06:30)";
  });
}

/// --lab, else WEFT_LAB.
Result<lab::LabAddress> address_of(const LabArgs& args) {
  const std::string uri = args.uri.empty() ? from_environment("WEFT_LAB") : args.uri;
  if (uri.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "--lab",
                 .what = "laboratory's store not named",
                 .expected = "postgresql://USER@HOST/DATABASE",
                 .hint = "Give --lab or set WEFT_LAB"});
  return lab::LabAddress::parse(uri);
}

/// Adds a command on the store.
template <class Args>
void add_store_command(const CommandGroup& group, const char* name,
                       Result<int> (*execute)(LabStore&, const Args&, Console&)) {
  group.add<Args>(name,
                  [execute, program = "lab " + std::string(name)](const Args& args,
                                                                  Console& console) -> Result<int> {
                    auto address = address_of(args);
                    if (!address) return pass(address.error());
                    auto store = LabStore::open(std::move(*address), program);
                    if (!store) return pass(store.error());
                    return execute(*store, args, console);
                  });
}

Result<int> run_install(const LabArgs& args, Console& console) {
  const auto address = address_of(args);
  if (!address) return pass(address.error());
  // A later version may build indexes of large tables; another installation may be running.
  const auto applied = LabStore::install(
      *address, {.statement = std::chrono::minutes(10), .lock = std::chrono::minutes(1)});
  if (!applied) return pass(applied.error());
  std::string text = applied->empty() ? "the store is up to date\n" : "the store is installed\n";
  text +=
      "Grant each login its role: GRANT weft_reader, weft_submitter or weft_rig TO login. Each rig "
      "needs a login of its own.\n";
  print(console, text, {{"store", address->text()}, {"applied", *applied}});
  return exit_ok;
}

Result<int> run_rigs(LabStore& store, const LabArgs&, Console& console) {
  const auto rigs = store.rigs();
  if (!rigs) return pass(rigs.error());
  json list = json::array();
  for (const lab::RigEntry& rig : *rigs) list.push_back(to_json(rig));
  print(console, format_rigs(*rigs), {{"rigs", std::move(list)}});
  return exit_ok;
}

void fill(lab::RunsFilter& filter, const LabRunsArgs& args) {
  filter.rig = args.rig;
  filter.recipe = args.recipe;
  filter.state = args.state;
  filter.bench = bench_kind_from(args.bench).value_or(BenchKind::unknown);
  if (!args.since.empty()) filter.since_us = read_time(args.since);
  if (!args.until.empty()) filter.until_us = read_time(args.until);
}

json runs_json(const std::vector<lab::RunEntry>& runs) {
  json list = json::array();
  for (const lab::RunEntry& run : runs) list.push_back(to_json(run));
  return list;
}

Result<int> run_runs(LabStore& store, const LabRunsArgs& args, Console& console) {
  lab::RunsFilter filter;
  fill(filter, args);
  const auto page = store.runs(filter, args.after, args.limit);
  if (!page) return pass(page.error());
  std::string text = format_runs(page->runs);
  if (page->next) text += "more runs: --after " + std::to_string(*page->next) + "\n";
  print(console, text,
        {{"runs", runs_json(page->runs)}, {"next", page->next ? json(*page->next) : json()}});
  return exit_ok;
}

Result<int> run_search(LabStore& store, const LabSearchArgs& args, Console& console) {
  lab::LabSearch search;
  fill(search, args);
  search.text = args.text;
  search.fabric = args.fabric;
  search.digest = args.digest;
  const auto runs = store.search(search, args.limit);
  if (!runs) return pass(runs.error());
  print(console, format_runs(*runs), {{"runs", runs_json(*runs)}});
  return exit_ok;
}

/// The typed file, or that of the library with this name.
fs::path find_recipe(const fs::path& typed) {
  std::error_code none;
  if (fs::exists(typed, none) || typed.has_parent_path()) return typed;
  for (const char* const folder : {"recipes/library", "recipes"}) {
    fs::path found = find_installed(fs::path(folder) / (typed.string() + ".json"));
    if (fs::exists(found, none)) return found;
  }
  return typed;
}

/// Reads name and fabrics; parameters are bound, but the submitted text stays as it is. Problems go
/// into `problems`.
Result<lab::CampaignRequestEntry> read_request(const fs::path& file, const LabSubmitArgs& args,
                                               std::vector<FileProblem>& problems) {
  auto text = read_text_file(file, recipes::max_recipe_bytes);
  if (!text) return pass(text.error());
  lab::CampaignRequestEntry request;
  request.seed = args.seed;
  request.rigs = args.rigs;
  const std::string parameters = parameters_json(args.parameters);
  if (!parameters.empty()) request.parameters_json = parameters;
  json document;
  recipes::Problems found;
  if (recipes::parse_json(*text, {}, document, found)) {
    recipes::bind_parameters(document, parameters, found);
    recipes::ObjectReader recipe(document, "", found);
    request.name = recipe.name("name").value_or("");
    if (const json* const fabrics = recipe.array("fabrics"))
      for (const json& fabric : *fabrics)
        if (fabric.is_string()) request.fabrics.push_back(fabric.get<std::string>());
    if (found.empty() && request.fabrics.empty())
      found.add({"/fabrics", "list of fabrics empty", "one fabric or more", "", ""});
  }
  for (recipes::Diagnostic& one : found.take()) problems.push_back({file, std::move(one)});
  request.recipe_sha256 = sha256_hex(*text);
  request.recipe_text = std::move(*text);
  return request;
}

/// With --rig, the check of `weft check`.
Status check_on_rig(const fs::path& recipe, const LabSubmitArgs& args, const Console& console,
                    std::vector<FileProblem>& problems) {
  if (args.rig.empty()) return {};
  CampaignRequest request{recipe, args.rig, {}, args.seed, {}};
  request.plugins = make_settings({}, console);
  request.parameters_json = parameters_json(args.parameters);
  auto found = preflight(request);
  if (!found) return pass(found.error());
  problems = std::move(found->problems);
  return {};
}

Result<int> print_campaign(LabStore& store, std::int64_t id, Console& console) {
  const auto campaign = store.campaign(id);
  if (!campaign) return pass(campaign.error());
  const auto rigs = store.rigs();
  if (!rigs) return pass(rigs.error());
  std::map<std::string, BenchKind> benches;
  for (const lab::RigEntry& rig : *rigs) benches[rig.name] = rig.bench;
  print(console, format_campaign(*campaign, benches), to_json(*campaign, benches));
  return exit_ok;
}

Result<int> run_submit(const LabSubmitArgs& args, Console& console) {
  auto address = address_of(args);
  if (!address) return pass(address.error());
  const fs::path file = find_recipe(args.recipe);
  std::vector<FileProblem> problems;
  const auto request = read_request(file, args, problems);
  if (!request) return pass(request.error());
  if (problems.empty())
    if (const Status checked = check_on_rig(file, args, console, problems); !checked)
      return pass(checked.error());
  if (!problems.empty()) return refuse(problems, console);
  auto store = LabStore::open(std::move(*address), "lab submit");
  if (!store) return pass(store.error());
  const auto id = store->submit(*request);
  if (!id) return pass(id.error());
  return print_campaign(*store, *id, console);
}

Result<std::int64_t> read_campaign(const std::string& typed) {
  if (const auto id = lab::campaign_number(typed)) return *id;
  return fail({.code = Errc::invalid_argument,
               .where = "ID",
               .what = "no campaign of the store",
               .expected = "C-000012",
               .got = shortened(typed)});
}

Result<int> run_campaign(LabStore& store, const LabCampaignArgs& args, Console& console) {
  const auto id = read_campaign(args.campaign);
  if (!id) return pass(id.error());
  return print_campaign(store, *id, console);
}

Result<int> run_cancel(LabStore& store, const LabCampaignArgs& args, Console& console) {
  const auto id = read_campaign(args.campaign);
  if (!id) return pass(id.error());
  if (const Status done = store.cancel(*id); !done) return pass(done.error());
  return print_campaign(store, *id, console);
}

}  // namespace

void add_lab_commands(const CommandGroup& weft) {
  const CommandGroup group = weft.group("lab");
  group.add<LabArgs>("install", run_install);
  add_store_command(group, "rigs", run_rigs);
  add_store_command(group, "runs", run_runs);
  add_store_command(group, "search", run_search);
  group.add<LabSubmitArgs>("submit", run_submit);
  add_store_command(group, "campaign", run_campaign);
  add_store_command(group, "cancel", run_cancel);
  add_lab_rig_commands(group);
}

}  // namespace weft::daemon::cli
