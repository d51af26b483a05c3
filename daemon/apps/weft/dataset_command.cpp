#include <charconv>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recordings/import_recordings.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct ImportArgs {
  std::filesystem::path source;  ///< a manifest or a folder
  std::filesystem::path out;
  std::string format = "manifest";
  std::string filter = "*";
  std::string shape;                  ///< imprint-table: "28x50"
  std::string group;                  ///< fabricslide: empty is "repetition"
  std::string order;                  ///< icub20: empty is "time"
  std::vector<std::string> channels;  ///< vibtac12; empty: X, Y, Z
  double rate_hz = 0;                 ///< tables with times; 0: from these
  std::string bench;                  ///< empty: from the manifest, or unknown

  [[nodiscard]] std::optional<BenchKind> stated_bench() const { return bench_kind_from(bench); }
};
struct ExportArgs {
  std::filesystem::path campaign;
  std::filesystem::path out;
  bool without_log = false;
};
struct InfoArgs {
  std::string document;           ///< "recipe", "rig" or empty
  std::filesystem::path dataset;  ///< or a campaign file
};

struct Counts {
  std::map<std::string, std::size_t> label;
  std::map<std::string, std::size_t> outcome;
  std::set<std::string> groups;
  std::set<std::string> explorations;  ///< imported sets have none
  std::size_t samples = 0;
  std::size_t lost = 0;
};

Counts count(const Dataset& dataset) {
  Counts out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    ++out.label[dataset.trials[i].label];
    ++out.outcome[std::string(to_string(dataset.records[i].outcome))];
    out.groups.insert(dataset.trials[i].group);
    if (const std::string& name = dataset.records[i].spec.exploration; !name.empty())
      out.explorations.insert(name);
    out.samples += dataset.trials[i].samples();
    out.lost += dataset.records[i].lost_samples;
  }
  return out;
}

json info_json(const char* command, const std::filesystem::path& file, const Dataset& dataset,
               const std::string& sha256) {
  const Counts counts = count(dataset);
  const DatasetInfo& info = dataset.info;
  return {{"command", command},
          {"file", file.string()},
          {"name", info.name},
          {"source", info.source},
          {"bench", to_string(info.kind)},
          {"dataset_sha256", sha256},
          {"recipe_sha256", info.recipe_sha256},
          {"rig_sha256", info.rig_sha256},
          {"software_version", info.software_version},
          {"seed", info.seed},
          {"trials", dataset.trials.size()},
          {"samples", counts.samples},
          {"lost_samples", counts.lost},
          {"taxels", dataset.trials.empty() ? 0 : dataset.trials.front().taxels},
          {"taxel_rate_hz", info.taxel_rate_hz},
          {"labels", counts.label},
          {"groups", counts.groups},
          {"group_columns", count_values(list_group_columns(dataset))},
          {"explorations", counts.explorations},
          {"outcomes", counts.outcome},
          {"copies", copies_in(dataset)},
          {"warnings", warnings_of(dataset)},
          {"ended_early", json(ended_early_json(info))}};
}

void add_columns_row(const std::vector<GroupColumn>& columns, Table& facts) {
  if (!columns.empty()) facts.row({"grouped by", format_columns(columns)});
}

std::string info_text(const std::filesystem::path& file, const Dataset& dataset,
                      const std::string& sha256) {
  const Counts counts = count(dataset);
  Table facts(Align::left);
  facts.row({"file", file.string()});
  facts.row({"source", dataset.info.source + " \"" + dataset.info.name + "\""});
  facts.row({"bench", std::string(to_string(dataset.info.kind))});
  facts.row({"trials", thousands(dataset.trials.size()) + " of " +
                           std::to_string(counts.label.size()) + " labels, " +
                           thousands(counts.samples) + " samples"});
  if (const auto imprints = extract_imprints(dataset); imprints && !imprints->empty())
    facts.row({"imprints", std::to_string(imprints->front().image.rows()) + " x " +
                               std::to_string(imprints->front().image.cols()) + " taxels"});
  else if (!dataset.trials.empty())
    facts.row({"taxels",
               std::to_string(dataset.trials.front().taxels) + " at " +
                   (dataset.info.taxel_rate_hz > 0 ? fixed(dataset.info.taxel_rate_hz, 2) + " Hz"
                                                   : "an unknown rate")});
  facts.row({"groups", joined(counts.groups)});
  add_columns_row(list_group_columns(dataset), facts);
  facts.row({"sha256", sha256});
  Table labels;
  for (const auto& [label, trials] : counts.label) labels.row({label, std::to_string(trials)});
  return bench_banner(dataset.info) + facts.text() + "Trials per label:\n" + labels.text() +
         copies_text(copies_in(dataset)) + warnings_text(warnings_of(dataset));
}

std::string left_out_text(const CampaignContents& campaign) {
  std::vector<std::string> parts;
  for (const auto& [outcome, trials] : campaign.left_out)
    parts.push_back(std::to_string(trials) + " " + outcome);
  if (campaign.never_begun > 0) parts.push_back(thousands(campaign.never_begun) + " never started");
  return thousands(campaign.dataset.trials.size()) + " of " + thousands(campaign.progress.planned) +
         " planned trials are complete" + (parts.empty() ? "" : "; left out: " + joined(parts)) +
         (campaign.progress.finished ? "" : "; the run did not finish") +
         (campaign.progress.discarded ? "; the campaign was discarded" : "") + ".\n";
}

void print_campaign(const char* command, const std::filesystem::path& file,
                    const CampaignContents& campaign, const std::string& sha256, Console& console) {
  json object = info_json(command, file, campaign.dataset, sha256);
  object["trials_planned"] = campaign.progress.planned;
  object["finished"] = campaign.progress.finished;
  object["left_out"] = json(campaign.left_out);
  object["never_begun"] = campaign.never_begun;
  print(console, info_text(file, campaign.dataset, sha256) + left_out_text(campaign), object);
}

// The files of a manifest are beside it; those of other formats are in the named folder.
Status refuse_same_files(const ImportArgs& args, const Dataset& dataset) {
  if (auto ok = refuse_same_file(args.source, args.out); !ok) return ok;
  const bool manifest = args.format != "fabricslide";
  const std::filesystem::path folder = manifest ? args.source.parent_path() : args.source;
  for (const classifier::Trial& trial : dataset.trials)
    if (auto ok = refuse_same_file(folder / trial.file, args.out); !ok) return ok;
  return {};
}

/// "28x50": rows and columns.
Result<std::pair<std::size_t, std::size_t>> shape_from(const std::string& text) {
  std::size_t rows = 0, cols = 0;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, rows);
  const bool cross = first.ec == std::errc() && first.ptr != end && *first.ptr == 'x';
  const auto second =
      cross ? std::from_chars(first.ptr + 1, end, cols) : std::from_chars_result{end, std::errc()};
  if (!cross || second.ec != std::errc() || second.ptr != end || rows == 0 || cols == 0)
    return fail({.code = Errc::invalid_argument,
                 .what = "shape of the imprints missing or not valid",
                 .expected = "rows x columns, such as 28x50",
                 .got = text});
  return std::pair{rows, cols};
}

FabricslideGroup group_of(const std::string& word) {
  if (word == "pressure") return FabricslideGroup::pressure;
  return word == "speed" ? FabricslideGroup::speed : FabricslideGroup::repetition;
}

Result<Dataset> import(const ImportArgs& args) {
  if (args.format == "fabricslide")
    return import_fabricslide(args.source, args.filter, group_of(args.group), args.rate_hz);
  if (args.format == "icub20")
    return import_icub20(args.source,
                         args.order == "filed" ? Icub20Order::filed : Icub20Order::time);
  if (args.format == "imprints") return import_imprints(args.source, args.stated_bench());
  if (args.format == "imprint-table") {
    const auto shape = shape_from(args.shape);
    if (!shape) return pass(shape.error(), "--shape");
    return import_imprint_table(args.source, shape->first, shape->second,
                                args.stated_bench().value_or(BenchKind::unknown));
  }
  return import_manifest(args.source, args.rate_hz, args.stated_bench());
}

json recordings_json(const char* command, const std::filesystem::path& file,
                     const RecordingSet& set, const std::string& sha256) {
  std::map<std::string, std::size_t> labels;
  std::set<std::string> groups;
  for (const auto& r : set.recordings) {
    ++labels[r.label];
    groups.insert(r.group);
  }
  json channels = json::array();
  for (const auto& c : set.recordings.front().channels)
    channels.push_back({{"name", c.name}, {"rate_hz", c.rate_hz}, {"unit", c.unit}});
  return {{"command", command},       {"file", file.string()},
          {"kind", "recordings"},     {"name", set.name},
          {"source", set.source},     {"bench", to_string(set.kind)},
          {"dataset_sha256", sha256}, {"recordings", set.recordings.size()},
          {"channels", channels},     {"labels", labels},
          {"groups", groups},         {"group_columns", count_values(list_group_columns(set))},
          {"copies", copies_in(set)}, {"warnings", find_data_warnings(set)}};
}

std::string recordings_text(const std::filesystem::path& file, const RecordingSet& set,
                            const std::string& sha256) {
  Table facts(Align::left);
  facts.row({"file", file.string()});
  facts.row({"source", set.source + " \"" + set.name + "\""});
  facts.row({"bench", std::string(to_string(set.kind))});
  double seconds = 0.0;
  std::set<std::string> labels, groups;
  for (const auto& r : set.recordings) {
    seconds += r.duration_s();
    labels.insert(r.label);
    groups.insert(r.group);
  }
  facts.row({"recordings", thousands(set.recordings.size()) + " of " +
                               std::to_string(labels.size()) + " labels, " + fixed(seconds, 1) +
                               " s"});
  for (const auto& c : set.recordings.front().channels)
    facts.row({"channel", c.name + " at " + fixed(c.rate_hz, 2) + " Hz [" + c.unit + "]"});
  facts.row({"groups", joined(groups)});
  add_columns_row(list_group_columns(set), facts);
  facts.row({"sha256", sha256});
  return bench_banner(set.kind) + facts.text() + copies_text(copies_in(set)) +
         warnings_text(find_data_warnings(set));
}

bool makes_recordings(const std::string& format) {
  return format == "recordings" || format == "vibtac12" || format == "lmt_sound" ||
         format == "hapmat";
}

Result<RecordingSet> import_set(const ImportArgs& args) {
  if (args.format == "vibtac12")
    return import_vibtac12(args.source, args.channels.empty()
                                            ? std::vector<std::string>{"X", "Y", "Z"}
                                            : args.channels);
  if (args.format == "lmt_sound") return import_lmt_sound(args.source);
  if (args.format == "hapmat") return import_hapmat(args.source, args.rate_hz);
  return import_recordings(args.source, args.rate_hz, args.stated_bench());
}

Result<int> run_import_recordings(const ImportArgs& args, Console& console) {
  const auto set = import_set(args);
  if (!set) return pass(set.error());
  if (auto ok = refuse_same_file(args.source, args.out); !ok) return pass(ok.error());
  for (const auto& r : set->recordings)
    if (auto ok = refuse_same_file(args.source.parent_path() / r.file, args.out); !ok)
      return pass(ok.error());
  const auto sha256 = write_recordings(*set, args.out);
  if (!sha256) return pass(sha256.error());
  json object = recordings_json("dataset import", args.out, *set, *sha256);
  for (const Warning& one : set->warnings) object["warnings"].push_back(one);
  print(console, recordings_text(args.out, *set, *sha256) + warnings_text(set->warnings), object);
  return exit_ok;
}

void add_options(CLI::App& command, ImportArgs& args) {
  command
      .add_option("SOURCE", args.source,
                  "manifest.csv with columns file,label,group; or a table or folder (see --format)")
      ->required();
  command.add_option("-o,--output", args.out, "write the data set to this file (HDF5)")->required();
  add_keyword(command, "--format", args.format,
              {"manifest", "fabricslide", "icub20", "imprints", "imprint-table", "recordings",
               "vibtac12", "lmt_sound", "hapmat"},
              "read SOURCE in this format");
  add_list(command, "--channels", args.channels,
           "read these channels of vibtac12 (comma-separated: X, Y, Z, S)");
  command.add_option("--filter", args.filter,
                     "read only files with matching names (* and ?) of fabricslide");
  command.add_option("--shape", args.shape,
                     "set rows x columns of an imprint-table, such as 28x50");
  command.add_option("--group", args.group, "group the trials of fabricslide by this property")
      ->check(CLI::IsMember({"repetition", "pressure", "speed"}));
  command
      .add_option("--order", args.order,
                  "order the frames of icub20 by time, or keep the order of the table (filed)")
      ->check(CLI::IsMember({"time", "filed"}));
  command
      .add_option("--rate-hz", args.rate_hz,
                  "set the rate of the sensor, if the time stamps are not evenly spaced")
      ->check(CLI::Range(1e-3, 1e6));
  command
      .add_option("--bench", args.bench,
                  "state the bench that recorded the data; every result names it")
      ->check(CLI::IsMember({"real", "simulated", "unknown"}));
}

/// Refuses options without effect on the requested format.
Status check_format_options(const ImportArgs& args) {
  const auto is = [&](std::initializer_list<std::string_view> formats) {
    return std::ranges::find(formats, args.format) != formats.end();
  };
  const auto refused = [](const char* option, std::string what, Error more = {}) {
    more.where = option;
    more.what = std::move(what);
    return fail(std::move(more));
  };
  if (!is({"fabricslide"}) && args.filter != "*")
    return refused("--filter", args.format + " does not filter by file name",
                   {.hint = "Remove lines from the manifest instead"});
  if (!is({"imprint-table"}) && !args.shape.empty())
    return refused("--shape", "option needs --format imprint-table", {.got = args.shape});
  if (!is({"fabricslide"}) && !args.group.empty())
    return refused("--group", "option needs --format fabricslide");
  if (!is({"vibtac12"}) && !args.channels.empty())
    return refused("--channels", "option does not apply to this format",
                   {.expected = "--format vibtac12", .got = "--format " + args.format});
  if (!is({"icub20"}) && !args.order.empty())
    return refused("--order", "option needs --format icub20", {.got = args.order});
  if (!is({"manifest", "fabricslide", "recordings", "hapmat"}) && args.rate_hz != 0)
    return refused("--rate-hz", args.format + " has no time stamps");
  if (!is({"manifest", "imprints", "imprint-table", "recordings"}) && !args.bench.empty())
    return refused("--bench", "bench of this published data set is known", {.expected = "real"});
  return {};
}

Result<int> run_import(const ImportArgs& args, Console& console) {
  if (auto ok = check_format_options(args); !ok) return pass(ok.error());
  if (auto ok = check_output(args.out); !ok) return pass(ok.error());
  if (makes_recordings(args.format)) return run_import_recordings(args, console);
  Result<Dataset> dataset = import(args);
  if (!dataset) return pass(dataset.error());
  if (auto ok = refuse_same_files(args, *dataset); !ok) return pass(ok.error());
  const Result<std::string> sha256 = write_hdf5(*dataset, args.out);
  if (!sha256) return pass(sha256.error());
  json object = info_json("dataset import", args.out, *dataset, *sha256);
  for (const Warning& one : dataset->warnings) object["warnings"].push_back(one);
  print(console, info_text(args.out, *dataset, *sha256) + warnings_text(dataset->warnings), object);
  return exit_ok;
}

void add_options(CLI::App& command, ExportArgs& args) {
  command
      .add_option("CAMPAIGN", args.campaign,
                  "campaign file (campaign.sqlite), complete or interrupted")
      ->required();
  command.add_option("-o,--output", args.out, "write the data set to this file (HDF5)")->required();
  command.add_flag("--without-log", args.without_log,
                   "export only the trials before a damaged or missing log");
}

/// Exports the complete trials of a campaign file, and reports how many were left out.
Result<int> run_export(const ExportArgs& args, Console& console) {
  if (auto ok = check_output(args.campaign, args.out); !ok) return pass(ok.error());
  const Result<CampaignContents> campaign = open_campaign(
      args.campaign, args.without_log ? CampaignLog::as_far_as_it_goes : CampaignLog::whole);
  if (!campaign) return pass(campaign.error());
  if (campaign->progress.discarded)
    return fail({.code = Errc::wrong_state,
                 .where = args.campaign.string(),
                 .what = "campaign was discarded, so it cannot be exported"});
  if (campaign->dataset.trials.empty())
    return fail({.code = Errc::not_found,
                 .where = args.campaign.string(),
                 .what = "no complete trial in the campaign"});
  const Result<std::string> sha256 = write_hdf5(campaign->dataset, args.out);
  if (!sha256) return pass(sha256.error());
  print_campaign("dataset export", args.out, *campaign, *sha256, console);
  return exit_ok;
}

void add_options(CLI::App& command, InfoArgs& args) {
  command.add_option("DATASET", args.dataset, "data set (HDF5) or campaign file (SQLite)")
      ->required();
  command.add_option("--document", args.document, "print only the recorded recipe or rig file")
      ->check(CLI::IsMember({"recipe", "rig"}));
}

/// Prints the recorded recipe or rig file, byte for byte.
Result<int> print_document(const InfoArgs& args, const DatasetInfo& info, Console& console) {
  const std::string& text = args.document == "rig" ? info.rig_json : info.recipe_json;
  if (text.empty())
    return fail({.code = Errc::not_found,
                 .where = args.dataset.string(),
                 .what = "no recorded " + args.document,
                 .hint = "Use the data set of a campaign; imported recordings have no such file"});
  console.out << text;
  return exit_ok;
}

Result<int> run_info(const InfoArgs& args, Console& console) {
  if (is_recordings_file(args.dataset)) {
    const auto set = read_recordings(args.dataset);
    if (!set) return pass(set.error());
    const std::string sha256 = recordings_sha256(*set);
    print(console, recordings_text(args.dataset, *set, sha256),
          recordings_json("dataset info", args.dataset, *set, sha256));
    return exit_ok;
  }
  if (is_campaign_file(args.dataset)) {
    const Result<CampaignContents> campaign = open_campaign(args.dataset);
    if (!campaign) return pass(campaign.error());
    if (!args.document.empty()) return print_document(args, campaign->dataset.info, console);
    print_campaign("dataset info", args.dataset, *campaign, dataset_sha256(campaign->dataset),
                   console);
    return exit_ok;
  }
  const Result<Dataset> dataset = read_hdf5(args.dataset);
  if (!dataset) return pass(dataset.error());
  if (!args.document.empty()) return print_document(args, dataset->info, console);
  const std::string sha256 = dataset_sha256(*dataset);
  print(console, info_text(args.dataset, *dataset, sha256),
        info_json("dataset info", args.dataset, *dataset, sha256));
  return exit_ok;
}

}  // namespace

void add_dataset_commands(const CommandGroup& weft) {
  const CommandGroup dataset = weft.group("dataset");
  dataset.add<ImportArgs>("import", run_import);
  dataset.add<ExportArgs>("export", run_export);
  add_merge_command(dataset);
  dataset.add<InfoArgs>("info", run_info);
}

}  // namespace weft::daemon::cli
