#include "daemon/apps/weft/data_commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "classifier/imprint/experiments.hpp"
#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/imprint_features.hpp"
#include "daemon/apps/weft/number_range.hpp"
#include "daemon/apps/weft/table.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {
namespace {

namespace ci = classifier::imprint;

/// The imprints to learn from.
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
                 .what = "no imprint is of these groups",
                 .got = joined(args.groups, ",")});
  return out;
}

Result<ci::ScaleSearchOptions> search_options(const ImprintSearchArgs& args) {
  ci::ScaleSearchOptions out;
  auto sigmas = scales_from(args.scales);
  if (!sigmas) return pass(sigmas.error(), "--scales");
  out.sigmas = std::move(*sigmas);
  out.most_scales = args.most_scales;
  out.form = args.form == "10" ? ci::Form::full : ci::Form::brief;
  out.rule = *std::ranges::find_if(ci::all_rules,
                                   [&](ci::Rule rule) { return to_string(rule) == args.rule; });
  out.evaluated_by = *std::ranges::find_if(
      ci::all_experiments, [&](ci::Experiment e) { return to_string(e) == args.evaluated_by; });
  return out;
}

}  // namespace

void add_options(CLI::App& command, ImprintSearchArgs& args) {
  const auto names = [](const auto& all) {
    std::vector<std::string> out;
    for (const auto one : all) out.emplace_back(to_string(one));
    return out;
  };
  command.add_option("DATASET", args.dataset, "imprints (HDF5)")->required();
  command
      .add_option("--groups", args.groups,
                  "search on these groups alone, those that train: what is found on imprints says "
                  "nothing about the accuracy on the same ones")
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_option("--scales", args.scales, "scales to choose from [taxels]")
      ->capture_default_str();
  command.add_option("--most-scales", args.most_scales, "largest number of scales in a set")
      ->check(CLI::Range(1, 5))
      ->capture_default_str();
  command.add_option("--form", args.form, "features a scale")
      ->check(CLI::IsMember({"10", "7"}))
      ->capture_default_str();
  command.add_option("--rule", args.rule, "what learns")
      ->check(CLI::IsMember(names(ci::all_rules)))
      ->capture_default_str();
  command.add_option("--judge", args.evaluated_by, "what is set aside in turn")
      ->check(CLI::IsMember(names(ci::all_experiments)))
      ->capture_default_str();
  command.add_option("--shown", args.shown, "best sets to show")
      ->check(CLI::Range(1, 2000))
      ->capture_default_str();
}

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
  table.row({"scales", "right"});
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
            ", " + args.evaluated_by + ", " + args.form + " features a scale\n" + table.text(),
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

}  // namespace weft::daemon::cli
