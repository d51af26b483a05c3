#include "daemon/cli/dataset_command.hpp"

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/cli/table.hpp"
#include "daemon/cli/trial_choice.hpp"
#include "daemon/dataset/hdf5_file.hpp"
#include "daemon/dataset/import.hpp"
#include "daemon/report/format.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct Counts {
  std::map<std::string, std::size_t> label;
  std::map<std::string, std::size_t> outcome;
  std::set<std::string> groups;
  std::size_t samples = 0;
  std::size_t lost = 0;
};

Counts count(const Dataset& dataset) {
  Counts out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    ++out.label[dataset.trials[i].label];
    ++out.outcome[std::string(to_string(dataset.records[i].outcome))];
    out.groups.insert(dataset.trials[i].group);
    out.samples += dataset.trials[i].samples();
    out.lost += dataset.records[i].lost_samples;
  }
  return out;
}

// Imported sets have none.
std::vector<std::string> named_explorations(const Dataset& dataset) {
  std::vector<std::string> out = explorations_of(dataset);
  std::erase(out, "");
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
          {"explorations", named_explorations(dataset)},
          {"outcomes", counts.outcome}};
}

std::string joined(const std::set<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
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
  if (!dataset.trials.empty())
    facts.row({"taxels", std::to_string(dataset.trials.front().taxels) + " at " +
                             fixed(dataset.info.taxel_rate_hz, 2) + " Hz"});
  facts.row({"groups", joined(counts.groups)});
  facts.row({"sha256", sha256});
  Table labels;
  for (const auto& [label, trials] : counts.label) labels.row({label, std::to_string(trials)});
  return bench_banner(dataset.info.kind) + facts.text() + "Trials per label:\n" + labels.text();
}

Result<Dataset> import(const ImportArgs& args) {
  if (args.format == "fabricslide") return import_fabricslide(args.source, args.filter);
  return import_manifest(args.source);
}

}  // namespace

void add_options(CLI::App& command, ImportArgs& args) {
  command
      .add_option("SOURCE", args.source,
                  "manifest.csv with columns file,label,group; or a folder for other formats")
      ->required();
  command.add_option("-o,--output", args.out, "data set to write (HDF5)")->required();
  command.add_option("--format", args.format, "layout of SOURCE")
      ->check(CLI::IsMember({"manifest", "fabricslide"}))
      ->capture_default_str();
  command.add_option("--filter", args.filter,
                     "fabricslide: only files whose name matches, with * and ?");
}

Result<int> run_import(const ImportArgs& args, Console& console) {
  if (args.format == "manifest" && args.filter != "*")
    return fail(Errc::invalid_argument, "a manifest has no file names to filter", "--filter", {},
                {}, "Leave lines out of the manifest instead");
  Result<Dataset> dataset = import(args);
  if (!dataset) return pass(dataset.error());
  dataset->info.software_version = WEFT_VERSION;
  const Result<std::string> sha256 = write_hdf5(*dataset, args.out);
  if (!sha256) return pass(sha256.error());
  print(console, info_text(args.out, *dataset, *sha256),
        info_json("dataset import", args.out, *dataset, *sha256));
  return exit_ok;
}

void add_options(CLI::App& command, InfoArgs& args) {
  command.add_option("DATASET", args.dataset, "data set (HDF5)")->required();
}

Result<int> run_info(const InfoArgs& args, Console& console) {
  const Result<Dataset> dataset = read_hdf5(args.dataset);
  if (!dataset) return pass(dataset.error());
  const std::string sha256 = dataset_sha256(*dataset);
  print(console, info_text(args.dataset, *dataset, sha256),
        info_json("dataset info", args.dataset, *dataset, sha256));
  return exit_ok;
}

}  // namespace weft::daemon::cli
