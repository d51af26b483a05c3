#include "daemon/apps/weft/data_commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/imprint/imprint_scene.hpp"
#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/number_range.hpp"
#include "daemon/apps/weft/table.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"

namespace weft::daemon::cli {
namespace {

namespace ci = classifier::imprint;

template <class Kind, std::size_t count>
std::vector<std::string> all_names(const std::array<Kind, count>& all) {
  std::vector<std::string> out;
  for (const Kind one : all) out.emplace_back(to_string(one));
  return out;
}

/// The named ones of `all`, in the order given.
template <class Kind, std::size_t count>
std::vector<Kind> named_ones(const std::vector<std::string>& names,
                             const std::array<Kind, count>& all) {
  std::vector<Kind> out;
  for (const std::string& name : names)
    out.push_back(*std::ranges::find_if(all, [&](Kind one) { return to_string(one) == name; }));
  return out;
}

Result<TableOptions> table_options(const ImprintTablesArgs& args) {
  TableOptions out;
  if (!args.experiments.empty())
    out.experiments = named_ones(args.experiments, ci::all_experiments);
  if (!args.rules.empty()) out.rules = named_ones(args.rules, ci::all_rules);
  out.laws = !args.no_laws;
  if (!args.scales.empty()) out.scales.clear();
  for (const std::string& text : args.scales) {
    auto sigmas = scales_from(text);
    if (!sigmas) return pass(sigmas.error(), "--scales");
    out.scales.push_back(std::move(*sigmas));
  }
  return out;
}

std::string experiment_text(const ImprintTables& tables, std::size_t experiment, ci::Form form) {
  Table table;
  std::vector<std::string> head{"scales", "paper"};
  for (const ci::Rule rule : tables.options.rules) head.emplace_back(to_string(rule));
  table.row(head);
  const ci::Experiment name = tables.options.experiments[experiment];
  for (const FeatureSet& set : tables.sets) {
    if (set.sigmas.empty() ? form != ci::Form::full : set.form != form) continue;
    std::vector<std::string> cells{set.name(), paper_text(name, set)};
    for (std::size_t r = 0; r < tables.options.rules.size(); ++r)
      cells.push_back(cell_text(tables.outcome(set, experiment, r)));
    table.row(cells);
  }
  return "Experiment " + std::string(to_string(name)) + ", " + std::string(to_string(form)) +
         " features a scale\n" + table.text() + "\n";
}

std::string tables_text(const ImprintTables& tables) {
  std::string out = bench_banner(tables.bench) + wrapped(tables_note(tables), "") + "\n";
  for (std::size_t e = 0; e < tables.options.experiments.size(); ++e)
    for (const ci::Form form : {ci::Form::full, ci::Form::brief})
      out += experiment_text(tables, e, form);
  Table table(Align::left);
  table.row({"features", "scales", "all imprints linearly separable"});
  for (const FeatureSet& set : tables.sets)
    table.row({std::string(set.sigmas.empty() ? "Laws" : to_string(set.form)), set.name(),
               std::string(to_string(set.separability.verdict))});
  return out + "Whether any weights at all would tell the classes apart\n" + table.text();
}

}  // namespace

void add_options(CLI::App& command, ImprintSceneArgs& args) {
  command.add_option("-o,--output", args.out, "data set to write (HDF5)")->required();
  command.add_option("--level", args.level, "Z: springs side by side; Z+: elastic half-space")
      ->check(CLI::IsMember({"Z", "Z+"}))
      ->capture_default_str();
  command
      .add_option("--side", args.side,
                  "taxels of the part of the 128 x 128 array that is read, as many rows as columns")
      ->check(CLI::Range(1, 128))
      ->capture_default_str();
  command.add_option("--presses", args.presses, "of each object with each force")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_option("--seed", args.seed, "of placements, hand and noise")->capture_default_str();
}

Result<int> run_imprint_scene(const ImprintSceneArgs& args, Console& console) {
  if (auto ok = check_output(args.out); !ok) return pass(ok.error());
  const auto level = sim::level_from(args.level);
  if (!level) return pass(level.error(), "--level");
  ImprintSceneOptions options;
  options.level = *level;
  options.side = args.side;
  options.presses = args.presses;
  options.seed = args.seed;
  const auto dataset = simulate_imprints(options);
  if (!dataset) return pass(dataset.error());
  const auto sha256 = write_hdf5(*dataset, args.out);
  if (!sha256) return pass(sha256.error());
  print(console,
        bench_banner(BenchKind::simulated) + args.out.string() + ": " +
            std::to_string(dataset->trials.size()) + " imprints of " + std::to_string(args.side) +
            " x " + std::to_string(args.side) + " taxels at level " + args.level + "\n",
        {{"command", "imprint scene"},
         {"file", args.out.string()},
         {"bench", "simulated"},
         {"level", args.level},
         {"imprints", dataset->trials.size()},
         {"side", args.side},
         {"seed", args.seed},
         {"dataset_sha256", *sha256}});
  return exit_ok;
}

void add_options(CLI::App& command, ImprintTablesArgs& args) {
  command
      .add_option("DATASET", args.dataset,
                  "imprints (HDF5): weft dataset import, weft imprint scene")
      ->required();
  command.add_option("-o,--output", args.out, "also write the tables as a page (HTML)");
  command
      .add_option(
          "--experiments", args.experiments,
          "what is set aside in turn (all four): " + joined(all_names(ci::all_experiments), ","))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(all_names(ci::all_experiments)));
  command
      .add_option("--rules", args.rules,
                  "what learns: " + joined(all_names(ci::all_rules), ",") +
                      " (without pvalue cores and svc)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(all_names(ci::all_rules)));
  command.add_option("--scales", args.scales,
                     "a set of scales in taxels, such as 1,2,4; may be given again (the paper's "
                     "seven sets)");
  command.add_flag("--no-laws", args.no_laws, "without Laws' energies");
}

Result<int> run_imprint_tables(const ImprintTablesArgs& args, Console& console) {
  if (!args.out.empty())
    if (auto ok = check_output(args.dataset, args.out); !ok) return pass(ok.error());
  auto options = table_options(args);
  if (!options) return pass(options.error());
  const auto dataset = open_dataset(args.dataset);
  if (!dataset) return pass(dataset.error());
  const auto tables = measure_tables(*dataset, std::move(*options));
  if (!tables) return pass(tables.error(), args.dataset.string());
  if (!args.out.empty())
    if (auto ok = write_text_file(args.out, tables_html(*tables)); !ok) return pass(ok.error());
  print(console, tables_text(*tables), nlohmann::json(tables_json(*tables)));
  return exit_ok;
}

}  // namespace weft::daemon::cli
