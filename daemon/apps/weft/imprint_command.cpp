#include <algorithm>
#include <nlohmann/json.hpp>

#include "classifier/imprint/experiments.hpp"
#include "daemon/analysis/imprint/imprint_scene.hpp"
#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/imprint_features.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {
namespace {

namespace ci = classifier::imprint;
using classifier::Learner;

struct ImprintSceneArgs {
  std::filesystem::path out;
  std::string level = "Z+";
  std::size_t side = 32;
  std::size_t presses = 1;
  std::uint64_t seed = 1;
};
struct ImprintTablesArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;  ///< page; empty: none
  std::vector<std::string> experiments;
  std::vector<std::string> rules;
  std::vector<std::string> scales;  ///< "1,2,4"; empty: the paper's
  bool no_laws = false;
  EdgeChoice edges;
};
struct ImprintSearchArgs {
  std::filesystem::path dataset;
  std::vector<std::string> groups;  ///< groups for training; empty: all
  std::string scales = "0,0.5,1,1.5,2,2.5,3,3.5,4,5,6,8";
  std::size_t most_scales = 3;
  std::string form = "10";
  std::string rule = "least-squares";
  std::string evaluated_by = "2/N";
  std::size_t shown = 10;
};

template <class Kind, std::size_t count>
std::vector<std::string> all_names(const std::array<Kind, count>& all) {
  std::vector<std::string> out;
  for (const Kind one : all) out.emplace_back(to_string(one));
  return out;
}

/// The value with this name; `all` must contain it.
template <class Kind, std::size_t count>
Kind named_one(const std::string& name, const std::array<Kind, count>& all) {
  return *std::ranges::find_if(all, [&](Kind one) { return to_string(one) == name; });
}

/// The named values of `all`, in the given order.
template <class Kind, std::size_t count>
std::vector<Kind> named_ones(const std::vector<std::string>& names,
                             const std::array<Kind, count>& all) {
  std::vector<Kind> out;
  for (const std::string& name : names) out.push_back(named_one(name, all));
  return out;
}

Result<TableOptions> table_options(const ImprintTablesArgs& args) {
  TableOptions out;
  if (!args.experiments.empty())
    out.experiments = named_ones(args.experiments, ci::all_experiments);
  if (!args.rules.empty()) out.rules.clear();
  for (const std::string& name : args.rules) {
    const auto learner = classifier::single_learner_from(name);
    if (!learner) return pass(learner.error(), "--rules");
    out.rules.push_back(*learner);
  }
  out.laws = !args.no_laws;
  args.edges.apply_to(out.edges);
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
  for (const Learner rule : tables.options.rules) head.emplace_back(to_string(rule));
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
         " features per scale\n" + table.text() + "\n";
}

std::string tables_text(const ImprintTables& tables) {
  std::string out = bench_banner(tables.bench) + wrapped(tables_note(tables), "") + "\n";
  for (std::size_t e = 0; e < tables.options.experiments.size(); ++e)
    for (const ci::Form form : {ci::Form::full, ci::Form::brief})
      out += experiment_text(tables, e, form);
  Table table(Align::left);
  std::vector<std::string> head{"features", "scales", "paper"};
  for (const Learner rule : convergence_rules) head.emplace_back(to_string(rule));
  head.emplace_back("all imprints linearly separable");
  table.row(head);
  for (const auto* sets : {&tables.sets, &tables.partial_sets})
    for (const FeatureSet& set : *sets) {
      std::vector<std::string> cells{std::string(set.kind()), set.name(),
                                     paper_text(ci::Experiment::one_of_all, set)};
      for (std::size_t r = 0; r < convergence_rules.size(); ++r)
        cells.push_back(set.convergence.empty() ? std::string(no_value)
                                                : convergence_text(set.convergence[r]));
      cells.emplace_back(to_string(set.separability.verdict));
      table.row(cells);
    }
  return out + "Convergence of the trainings of 1/N, and linear separability\n" + table.text();
}

void add_options(CLI::App& command, ImprintSceneArgs& args) {
  command.add_option("-o,--output", args.out, "write the data set to this file (HDF5)")->required();
  add_keyword(command, "--level", args.level, {"Z", "Z+"},
              "simulate independent springs (Z) or an elastic half-space (Z+)");
  add_count(command, "--side", args.side, 1, 128,
            "read a square with N taxels per side of the 128 x 128 array");
  add_count(command, "--presses", args.presses, 1, 1000,
            "press each object N times with each force");
  command.add_option("--seed", args.seed, "set the seed of placements, hand and noise")
      ->capture_default_str();
}

/// Makes a data set of simulated imprints.
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
                  "imprints (HDF5) of weft dataset import or weft imprint scene")
      ->required();
  command.add_option("-o,--output", args.out, "also write the tables to this page (HTML)");
  add_list(
      command, "--experiments", args.experiments,
      "run these experiments (comma-separated: " + joined(all_names(ci::all_experiments)) + ")")
      ->check(CLI::IsMember(all_names(ci::all_experiments)));
  add_list(command, "--rules", args.rules,
           "train these learners (comma-separated: perceptron, ridge, lda, ...)");
  command.add_option("--scales", args.scales,
                     "use this set of scales [taxels], such as 1,2,4 (repeatable)");
  command.add_flag("--no-laws", args.no_laws, "leave out Laws' energies");
  add_edge_options(command, args.edges);
}

/// The tables of Ellis 1986 on a data set of imprints.
Result<int> run_imprint_tables(const ImprintTablesArgs& args, Console& console) {
  if (!args.out.empty())
    if (auto ok = check_page(args.dataset, args.out); !ok) return pass(ok.error());
  auto options = table_options(args);
  if (!options) return pass(options.error());
  const auto dataset = open_dataset(args.dataset);
  if (!dataset) return pass(dataset.error());
  const auto tables = measure_tables(*dataset, std::move(*options));
  if (!tables) return pass(tables.error(), args.dataset.string());
  if (!args.out.empty())
    if (auto ok = write_page_files(args.out, tables_json(*tables), tables_document(*tables)); !ok)
      return pass(ok.error());
  print(console, tables_text(*tables), nlohmann::json(tables_json(*tables)));
  return exit_ok;
}

/// Reads the imprints to train on.
Result<std::vector<ci::Imprint>> imprints_to_search(const ImprintSearchArgs& args,
                                                    const Dataset& dataset) {
  auto all = extract_imprints(dataset);
  if (!all) return pass(all.error(), args.dataset.string());
  if (args.groups.empty()) return all;
  const std::vector<std::string> groups = imprint_groups(dataset, *all);
  std::vector<ci::Imprint> out;
  for (std::size_t i = 0; i < groups.size(); ++i)
    if (std::ranges::find(args.groups, groups[i]) != args.groups.end())
      out.push_back(std::move((*all)[i]));
  if (out.empty())
    return fail({.code = Errc::not_found,
                 .where = "--groups",
                 .what = "no imprints in these groups",
                 .got = joined(args.groups, ",")});
  return out;
}

Result<ci::ScaleSearchOptions> search_options(const ImprintSearchArgs& args) {
  ci::ScaleSearchOptions out;
  auto sigmas = scales_from(args.scales);
  if (!sigmas) return pass(sigmas.error(), "--scales");
  out.sigmas = std::move(*sigmas);
  out.most_scales = args.most_scales;
  out.form =
      static_cast<ci::Form>(std::ranges::find(ci::form_names, args.form) - ci::form_names.begin());
  const auto learner = classifier::single_learner_from(args.rule);
  if (!learner) return pass(learner.error(), "--rule");
  out.rule = *learner;
  out.evaluated_by = named_one(args.evaluated_by, ci::all_experiments);
  return out;
}

void add_options(CLI::App& command, ImprintSearchArgs& args) {
  command.add_option("DATASET", args.dataset, "imprints (HDF5)")->required();
  add_name_list(command, "--groups", args.groups,
                "search only on these groups, the training groups (comma-separated)");
  command
      .add_option("--scales", args.scales, "choose from these scales [taxels] (comma-separated)")
      ->capture_default_str();
  add_count(command, "--most-scales", args.most_scales, 1, 5, "use at most N scales in a set");
  add_keyword(command, "--form", args.form, {ci::form_names.begin(), ci::form_names.end()},
              "use these features per scale");
  command.add_option("--rule", args.rule, "train this learner")->capture_default_str();
  add_keyword(command, "--judge", args.evaluated_by, all_names(ci::all_experiments),
              "hold out this part of the data in each test");
  add_count(command, "--shown", args.shown, 1, 2000, "show this number of best sets");
}

/// Finds the sets of scales that separate the classes of a data set best.
Result<int> run_imprint_search(const ImprintSearchArgs& args, Console& console) {
  const auto options = search_options(args);
  if (!options) return pass(options.error());
  const auto dataset = open_dataset(args.dataset);
  if (!dataset) return pass(dataset.error());
  const auto imprints = imprints_to_search(args, *dataset);
  if (!imprints) return pass(imprints.error());
  const auto ranked = ci::search_scales(*imprints, *options);
  if (!ranked) return pass(ranked.error(), args.dataset.string());
  Table table;
  table.row({"scales", "correct"});
  nlohmann::json best = nlohmann::json::array();
  for (std::size_t i = 0; i < std::min(args.shown, ranked->size()); ++i) {
    const ci::ScaleScore& score = (*ranked)[i];
    const auto count = [&](std::size_t n) {
      return score.outcome.converged ? nlohmann::json(n) : nlohmann::json(nullptr);
    };
    std::vector<std::string> words;
    for (const double sigma : score.sigmas) words.push_back(general(sigma));
    table.row({joined(words), cell_text(score.outcome)});
    best.push_back({{"scales", score.sigmas},
                    {"converged", score.outcome.converged},
                    {"correct", count(score.outcome.correct)},
                    {"total", count(score.outcome.total)}});
  }
  print(console,
        bench_banner(dataset->info.kind) + "Best of " + std::to_string(ranked->size()) +
            " sets of scales on " + std::to_string(imprints->size()) + " imprints, " + args.rule +
            ", " + args.evaluated_by + ", " + args.form + " features per scale\n" + table.text(),
        {{"command", "imprint search"},
         {"bench", to_string(dataset->info.kind)},
         {"imprints", imprints->size()},
         {"sets", ranked->size()},
         {"rule", args.rule},
         {"judge", args.evaluated_by},
         {"features", args.form},
         {"best", best}});
  return exit_ok;
}

}  // namespace

void add_imprint_commands(const CommandGroup& imprint) {
  imprint.add<ImprintSceneArgs>("scene", run_imprint_scene);
  imprint.add<ImprintTablesArgs>("tables", run_imprint_tables);
  imprint.add<ImprintSearchArgs>("search", run_imprint_search);
}

}  // namespace weft::daemon::cli
