#include "daemon/apps/weft/data_commands.hpp"

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>

#include "classifier/features/layout.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/import.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct Unit {
  std::string feature, unit;
};

// Of the columns that FeatureLayout knows, which are not those of imprints.
std::vector<Unit> units_of(const ChosenTrials& chosen) {
  std::map<std::string, std::string_view, std::less<>> known;
  const classifier::FeatureLayout layout(chosen.setup.taxels, chosen.setup.phases);
  for (const classifier::FeatureInfo& column : layout.columns()) known[column.name] = column.unit;
  std::vector<Unit> out;
  for (const std::string& name : chosen.features.names) {
    const auto at = known.find(name.substr(name.find(':') + 1));  // of "M1:range.M.4"
    if (at != known.end()) out.push_back({name, std::string(at->second)});
  }
  return out;
}

// "  count: mean.P, max.M.1 ...; count^2: var.M.1 ...", every feature by its name.
std::string units_text(const std::vector<Unit>& units) {
  std::map<std::string, std::vector<std::string>> by_unit;
  for (const Unit& one : units) by_unit[one.unit].push_back(one.feature);
  std::string out;
  for (const auto& [unit, features] : by_unit) out += "  [" + unit + "] " + joined(features) + "\n";
  return out;
}

json units_json(const std::vector<Unit>& units) {
  json out = json::object();
  for (const Unit& one : units) out[one.feature] = one.unit;
  return out;
}

}  // namespace

void add_options(CLI::App& command, FeaturesArgs& args) {
  command.add_option("DATASET", args.dataset, "data set (HDF5)")->required();
  command.add_option("-o,--output", args.out, "table to write (CSV)")->required();
  add_trial_options(command, args.trials);
  add_level_option(command, args.trials);
  record_given(command, args.trials.given);
}

Result<int> run_features(const FeaturesArgs& args, Console& console) {
  if (auto ok = check_output(args.dataset, args.out); !ok) return pass(ok.error());
  const Result<ChosenTrials> chosen = load_trials(args.dataset, args.trials, false, true);
  if (!chosen) return pass(chosen.error());
  if (auto ok = export_features_csv(args.out, chosen->features,
                                    factor_columns(chosen->dataset, chosen->features));
      !ok)
    return pass(ok.error());
  const std::vector<Unit> units = units_of(*chosen);
  const BenchKind kind = chosen->dataset.info.kind;
  const std::size_t rows = chosen->features.size();
  const std::size_t columns = chosen->features.names.size();
  print(console,
        bench_banner(chosen->dataset.info) + args.out.string() + ": " + std::to_string(rows) +
            " rows of " + std::to_string(columns) + " features\n" + units_text(units),
        {{"command", "features"},
         {"file", args.out.string()},
         {"bench", to_string(kind)},
         {"dataset_sha256", chosen->sha256},
         {"rows", rows},
         {"strokes", chosen->strokes},
         {"features", columns},
         {"units", units_json(units)}});
  return exit_ok;
}

}  // namespace weft::daemon::cli
