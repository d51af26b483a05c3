#include "daemon/apps/weft/trade_command.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/apps/weft/campaign_report.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"

namespace weft::daemon::cli {
namespace {

constexpr double paper_fraction = 0.4;  // Khan et al. 2016: 8 of 20 trials train

std::string family_problem(const std::string& word) {
  const auto family = tradeoff_family_from(word);
  return family ? std::string() : to_string(family.error());
}

bool has_groups(const Dataset& dataset) {
  std::vector<std::string> groups;
  for (const auto& trial : dataset.trials) {
    if (trial.group.empty()) return false;
    if (std::ranges::find(groups, trial.group) == groups.end()) groups.push_back(trial.group);
  }
  return groups.size() >= 2;
}

/// The requested splits. Default: random splits for a campaign, because its trials are independent;
/// for other data with groups, each group is held out once.
EvaluateArgs split_args(const TradeClassifierArgs& args, const Dataset& dataset) {
  EvaluateArgs out;
  static_cast<SplitChoice&>(out) = args;
  out.repeats = args.splits;
  out.training = args.training;
  const bool given =
      !args.train_groups.empty() || args.train_fraction > 0 || args.leave_one_group_out;
  if (given) return out;
  out.leave_one_group_out = dataset.info.source != "campaign" && has_groups(dataset);
  if (!out.leave_one_group_out) out.train_fraction = paper_fraction;
  return out;
}

std::string format_split(const EvaluateArgs& args, std::size_t splits) {
  if (args.leave_one_group_out)
    return std::to_string(splits) + " groups, each tested once with all others as training";
  if (args.train_fraction > 0)
    return std::to_string(splits) + " random splits, " + percent(args.train_fraction, 0) +
           " % of each label for training";
  return "groups " + joined(args.train_groups, ",") + " train, groups " +
         joined(args.test_groups, ",") + " test";
}

SplitMaker split_maker(const TradeClassifierArgs& args, const Dataset& dataset) {
  const EvaluateArgs how = split_args(args, dataset);
  const std::size_t most = args.splits;
  return [how, most](const classifier::FeatureMatrix& features) -> Result<SplitPlan> {
    auto splits = make_splits(how, features);
    if (!splits) return pass(splits.error());
    if (splits->size() > most) splits->resize(most);
    std::string words = format_split(how, splits->size());
    return SplitPlan{std::move(*splits), std::move(words), how.leave_one_group_out};
  };
}

Result<ClassifierTradeoffOptions> make_options(const TradeClassifierArgs& args) {
  ClassifierTradeoffOptions out;
  if (!args.vary.empty()) out.vary.clear();
  for (const std::string& word : args.vary) {
    const auto family = tradeoff_family_from(word);
    if (!family) return pass(family.error(), "--vary");
    out.vary.push_back(*family);
  }
  const auto learner = classifier::learner_from(args.learner);
  if (!learner) return pass(learner.error(), "--learner");
  out.learner = *learner;
  out.training = train_options(args.training);
  out.features.norm = args.norm == "rms" ? classifier::Norm::rms : classifier::Norm::l2;
  out.exploration = args.exploration;
  out.timings = args.timings;
  return out;
}

Result<TradeoffSet> measure(const TradeClassifierArgs& args, ClassifierTradeoffOptions options,
                            const std::filesystem::path& path, Console& console) {
  const Result<Dataset> dataset = open_dataset(path);
  if (!dataset) return pass(dataset.error());
  options.split = split_maker(args, *dataset);
  const auto progress = [&](std::size_t step, std::size_t steps, const std::string& what) {
    print_step(console, step, steps, what);
  };
  auto set = measure_classifier_tradeoff(*dataset, options, steady_wall_seconds, progress);
  if (!set) return pass(set.error(), path.string());
  set->dataset = path.string();
  set->sha256 = dataset_sha256(*dataset);
  return set;
}

TradeoffReport empty_report(const TradeClassifierArgs& args) {
  TradeoffReport out;
  out.title = "Classifier: accuracy against time";
  out.command = "trade classifier";
  out.costs = classifier_costs();
  out.notes = {
      "Each choice differs from the default in one setting. All choices use the same splits, with "
      "two exceptions. A choice of speed is tested on the trials of that speed only. Another "
      "exploration has its own trials.",
      "Left: the time that this machine needs for one prediction. All features are computed, "
      "whatever number is selected. Right: the seconds of stroke (phase M) that the prediction "
      "uses.",
      "In the family \"stop\" a stroke can end early. A live vote is taken after 0.5, 1, 2, 3, 4, "
      "6, 8, 12 ... s. The stroke ends when one fabric reaches the probability in the name of the "
      "choice. If none does, the default predicts from the whole stroke. The prediction time is "
      "that of one vote, with its probability."};
  out.timing = "median of " + std::to_string(args.timings) +
               " repetitions per trial, mean over the timed trials; features and vote on one "
               "thread, all choices within each repetition, after all trainings";
  out.training = describe(args.training);
  out.machine = machine_text();
  out.software = software_version();
  out.commit = software_commit();
  return out;
}

Result<std::string> set_text(const TradeoffSet& set, const std::vector<TradeoffCost>& costs) {
  Table table;
  std::vector<std::string> head{"choice",     "accuracy %", "95 % interval",
                                "prediction", "stroke",     "training"};
  std::vector<std::vector<std::size_t>> fronts;
  for (const TradeoffCost& cost : costs) {
    auto front = find_front(set, cost);
    if (!front) return pass(front.error(), set.dataset);
    fronts.push_back(std::move(*front));
    head.push_back("front: " + cost.words);
  }
  table.row(head);
  for (std::size_t i = 0; i < set.points.size(); ++i) {
    const TradeoffPoint& p = set.points[i];
    std::vector<std::string> row{p.name,
                                 percent(p.accuracy, 2),
                                 percent(p.ci95.low, 2) + " to " + percent(p.ci95.high, 2),
                                 duration(p.answer_s),
                                 fixed(p.contact_s, 2) + " s",
                                 duration(p.train_s)};
    for (const auto& front : fronts)
      row.emplace_back(std::ranges::find(front, i) == front.end() ? "" : "*");
    table.row(row);
  }
  std::string out = bench_banner(set.bench) + set.dataset + " (" +
                    std::string(to_string(set.bench)) + ")\n" + table.text();
  for (const auto& [family, why] : set.left_out) out += "  left out: " + family + ", " + why + "\n";
  return out;
}

Result<int> run_trade_classifier(const TradeClassifierArgs& args, Console& console) {
  const Output outputs[] = {{"page", args.files.page}, {"data", args.files.data}};
  if (Status ok = check_outputs(args.datasets, outputs); !ok) return pass(ok.error());
  if (Status ok = check_page(args.datasets, args.files); !ok) return pass(ok.error());
  std::string text;
  const auto report = measured_tradeoff(args, console, text);
  if (!report) return pass(report.error());
  return write_tradeoff(args.files, *report, text, console);
}

}  // namespace

Result<TradeoffReport> measured_tradeoff(const TradeClassifierArgs& args, Console& console,
                                         std::string& text) {
  const auto options = make_options(args);
  if (!options) return pass(options.error());
  TradeoffReport report = empty_report(args);
  for (const auto& path : args.datasets) {
    auto set = measure(args, *options, path, console);
    if (!set) return pass(set.error());
    const auto lines = set_text(*set, report.costs);
    if (!lines) return pass(lines.error());
    text += *lines;
    report.sets.push_back(std::move(*set));
  }
  return report;
}

void add_options(CLI::App& command, TradeClassifierArgs& args) {
  command.add_option("DATASET", args.datasets, "data sets (HDF5), each with its own picture")
      ->required();
  add_options(command, args.files);
  add_list(command, "--vary", args.vary,
           "vary these (comma-separated: features, learner, slide, speed, vote, stop, ...)")
      ->check(family_problem);
  add_keyword(command, "--learner", args.learner,
              {"pvalue", "pca", "all", "lda", "svc", "trees", "cores-best", "best"},
              "use this learner where --vary does not change it");
  command.add_option("--exploration", args.exploration,
                     "use this exploration where --vary does not change it, such as M2 or M1+M2");
  add_keyword(command, "--norm", args.norm, {"l2", "rms"},
              "compute F_norm by l2 as in the paper, or by rms");
  add_split_options(command, args, "train on this share of each label's trials, such as 0.4",
                    "test each group once, with all others as training");
  add_count(command, "--splits", args.splits, 1, 100000, "use at most this number of splits");
  add_count(command, "--timings", args.timings, 5, 10000,
            "repeat each timing N times and show the median");
  add_train_options(command, args.training);
}

void add_options(CLI::App& command, TradeoffFiles& files) {
  command.add_option("-o,--output", files.page, "write the page to this file (HTML)")->required();
  command.add_option("--data", files.data, "write the numbers of the page to this file (JSON)");
}

Status check_page(std::span<const std::filesystem::path> inputs, const TradeoffFiles& files) {
  // --data may be the record itself
  return files.data == record_beside(files.page) ? Status{} : check_page(inputs, files.page);
}

Status write_json(const std::filesystem::path& file, const nlohmann::ordered_json& object,
                  int indent) {
  const auto replace = nlohmann::ordered_json::error_handler_t::replace;
  return write_text_file(file, object.dump(indent, ' ', false, replace) + "\n");
}

Result<int> write_tradeoff(const TradeoffFiles& files, const TradeoffReport& report,
                           const std::string& text, Console& console,
                           std::span<const nlohmann::ordered_json> more_of_set) {
  const auto page = tradeoff_document(report);
  if (!page) return pass(page.error());
  auto data = tradeoff_json(report);
  if (!data) return pass(data.error());
  for (std::size_t i = 0; i < more_of_set.size(); ++i)
    (*data)["data_sets"][i].update(more_of_set[i]);
  if (Status ok = write_page_files(files.page, *data, *page); !ok) return pass(ok.error());
  if (!files.data.empty() && files.data != record_beside(files.page))
    if (Status ok = write_json(files.data, *data, 2); !ok) return pass(ok.error());
  print(console, text + "page: " + files.page.string() + "\n", nlohmann::json(*data));
  return exit_ok;
}

Result<int> write_tradeoff(const TradeoffFiles& files, const TradeoffReport& report,
                           const std::string& text, Console& console) {
  return write_tradeoff(files, report, text, console, {});
}

void print_step(Console& console, std::size_t step, std::size_t steps, const std::string& what) {
  console.err << "trade " << step + 1 << "/" << steps << ": " << what << std::endl;
}

void add_trade_commands(const CommandGroup& weft) {
  const CommandGroup trade = weft.group("trade");
  trade.add<TradeClassifierArgs>("classifier", run_trade_classifier);
  add_trade_vibro_command(trade);
  add_trade_sim_command(trade);
}

}  // namespace weft::daemon::cli
