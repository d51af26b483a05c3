#include "daemon/cli/features_command.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/cli/dataset_file.hpp"
#include "daemon/dataset/import.hpp"

namespace weft::daemon::cli {

void add_options(CLI::App& command, FeaturesArgs& args) {
  command.add_option("DATASET", args.dataset, "data set (HDF5)")->required();
  command.add_option("-o,--output", args.out, "table to write (CSV)")->required();
  add_trial_options(command, args.trials);
  add_level_option(command, args.trials);
}

Result<int> run_features(const FeaturesArgs& args, Console& console) {
  if (auto ok = refuse_same_file(args.dataset, args.out); !ok) return pass(ok.error());
  const Result<ChosenTrials> chosen = load_trials(args.dataset, args.trials, false, true);
  if (!chosen) return pass(chosen.error());
  if (auto ok = export_features_csv(args.out, chosen->features,
                                    factor_columns(chosen->dataset, chosen->features));
      !ok)
    return pass(ok.error());
  const BenchKind kind = chosen->dataset.info.kind;
  const std::size_t rows = chosen->features.size();
  const std::size_t columns = chosen->features.names.size();
  print(console,
        bench_banner(chosen->dataset.info) + args.out.string() + ": " + std::to_string(rows) +
            " rows of " + std::to_string(columns) + " features\n",
        {{"command", "features"},
         {"file", args.out.string()},
         {"bench", to_string(kind)},
         {"dataset_sha256", chosen->sha256},
         {"rows", rows},
         {"strokes", chosen->strokes},
         {"features", columns}});
  return exit_ok;
}

}  // namespace weft::daemon::cli
