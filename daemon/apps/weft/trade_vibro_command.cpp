#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/analysis/tradeoff/measure_vibro.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/analysis/tradeoff/vibro_paper.hpp"
#include "daemon/apps/weft/campaign_report.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/evaluate_recordings.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
#include "daemon/apps/weft/trade_command.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon::cli {
namespace {

namespace vibro = classifier::vibro;

struct TradeVibroArgs {
  std::vector<std::filesystem::path> datasets;
  TradeoffFiles files;
  std::vector<std::string> methods;
  std::vector<std::string> families;
  std::string exploration;  ///< of campaigns; empty: the only one
  std::vector<double> windows_s = {1.0, 2.0};
  std::size_t blocks = 5;
  double step_s = 0.25;
  std::size_t per_recording = 100;
  std::size_t repeats = 5;
  std::size_t timings = 101;
  std::uint64_t seed = 1;
  double outliers = 0.0;
};

Result<VibroTradeoffOptions> vibro_options(const TradeVibroArgs& args) {
  VibroTradeoffOptions out;
  if (!args.methods.empty()) out.learners.clear();
  for (const std::string& word : args.methods) {
    const auto learner = classifier::single_learner_from(word);
    if (!learner) return pass(learner.error(), "--method");
    out.learners.push_back(*learner);
  }
  if (!args.families.empty()) out.families.clear();
  for (const std::string& word : args.families) {
    const auto family = vibro::family_from(word);
    if (!family) return pass(family.error(), "--features");
    out.families.push_back(*family);
  }
  out.windows_s = args.windows_s;
  out.protocol.blocks = args.blocks;
  out.protocol.step_s = args.step_s;
  out.protocol.per_recording = args.per_recording;
  out.protocol.repeats = args.repeats;
  out.protocol.seed = args.seed;
  out.training.seed = args.seed;
  out.training.outliers = args.outliers;
  out.timings = args.timings;
  return out;
}

struct NamedSet {
  std::string path;
  RecordingSet set;
};

// Opens all sets before the first long measurement.
Result<std::vector<NamedSet>> checked_sets(const TradeVibroArgs& args,
                                           const VibroTradeoffOptions& options) {
  std::vector<NamedSet> out;
  for (const std::filesystem::path& path : args.datasets) {
    auto set = open_recordings(path, args.exploration, false);
    if (!set) return pass(set.error());
    if (auto ok = check_vibro_tradeoff(*set, options); !ok) return pass(ok.error(), path.string());
    out.push_back({path.string(), std::move(*set)});
  }
  return out;
}

TradeoffReport vibro_report(const TradeVibroArgs& args) {
  TradeoffReport out;
  out.title = "Sound and vibration: F-score against time";
  out.command = "trade vibro";
  out.measure = "macro F-score";
  out.costs = classifier_costs();
  out.costs.back().title = "window [s]";
  out.costs.back().words = "window";
  out.notes = {
      "Each mark is a learner with a set of features, a window and a source. Scaling and three "
      "principal components are fitted on training windows only.",
      "Each set of recordings has two sections. Random windows are the paper's protocol: nearly "
      "every sample of a test window is also in a training window, so the accuracy is too high. "
      "Contiguous parts of a recording share no samples. With one recording per material, even "
      "they do not show that another recording would be recognised."};
  out.timing = "one prediction: features of one window, median of " + std::to_string(args.timings) +
               ", and the learner with scaling and components, median over the test windows; one "
               "thread";
  out.training = "defaults of scikit-learn and XGBoost; seed " + std::to_string(args.seed) +
                 format_outliers(args.outliers);
  out.machine = machine_text();
  out.software = software_version();
  out.commit = software_commit();
  return out;
}

// The best choice of each learner, with its time, under each protocol.
std::string vibro_summary(const TradeoffSet& set) {
  Table table;
  table.row({"best of", "choice", "F-score", "95 % interval", "prediction"});
  for (const std::string& learner : list_families(std::span(&set, 1))) {
    const TradeoffPoint* best = nullptr;
    for (const TradeoffPoint& p : set.points)
      if (p.family == learner && (best == nullptr || p.accuracy > best->accuracy)) best = &p;
    table.row({learner, best->name, fixed(best->accuracy, 3),
               fixed(best->ci95.low, 3) + " to " + fixed(best->ci95.high, 3),
               duration(best->answer_s)});
  }
  std::string left_out;
  for (const auto& [what, why] : set.left_out)
    left_out += "  left out: " + what + ", " + why + "\n";
  return bench_banner(set.bench) + set.dataset + "\n  " + daemon::format_text(set.facts.back()) +
         "\n" + left_out + table.text();
}

// Averages over the paper's learners, and the gain of longer windows; empty if none of them was
// measured.
std::string format_averages(const VibroTradeoff& tradeoff) {
  const auto averages = compute_averages(tradeoff);
  if (averages.empty()) return {};
  Table table;
  table.row({"average of", "window", "split", "F-score", "the paper", "windows %", "explained %",
             "the paper"});
  for (const VibroAverage& a : averages)
    table.row({std::to_string(a.learners) + " on " + a.source + " " +
                   std::string(vibro::to_string(a.family)),
               general(a.window_s) + " s", protocol_name(a.protocol), fixed(a.f_score, 3),
               a.papers_f_score ? fixed(*a.papers_f_score, 3) : "", percent(a.accuracy, 2),
               percent(a.explained, 2), a.papers_explained ? percent(*a.papers_explained, 0) : ""});
  std::string out = table.text();
  for (const VibroGain& g : compute_gains(tradeoff, averages))
    out += "  2 s over 1 s, " + g.source + ", " + protocol_name(g.protocol) + ": F-score " +
           signed_percent(g.f_score) + ", prediction time " + signed_percent(g.answer_s) +
           (g.is_papers ? " (the paper: " + signed_percent(papers_f_score_gain) + ", " +
                              signed_percent(papers_time_gain) + ")"
                        : "") +
           "\n";
  return out;
}

void add_options(CLI::App& command, TradeVibroArgs& args) {
  command
      .add_option("DATASET", args.datasets,
                  "recordings of `weft dataset import`, or campaigns with a vibration sensor")
      ->required();
  add_options(command, args.files);
  add_list(command, "--method", args.methods,
           "compare these learners (comma-separated: nb, knn, forest, svm, lda, all, ...)");
  add_list(command, "--features", args.families,
           "compare these features (comma-separated: SMMRP, FFT, SMMRPFFT, ALL, ...)");
  command.add_option("--exploration", args.exploration,
                     "use only this exploration of campaigns, such as V1");
  add_list(command, "--window-s", args.windows_s,
           "compare these window lengths [s] (comma-separated)")
      ->check(number_range(0.01, 1e4))
      ->capture_default_str();
  add_count(command, "--blocks", args.blocks, 2, 1000,
            "split every recording into N contiguous parts");
  add_number(command, "--step-s", args.step_s, 0.001, 1e6,
             "set the time from one window of a part to the next [s]");
  add_count(command, "--per-recording", args.per_recording, 10, 100000,
            "draw this number of random windows per recording");
  add_count(command, "--repeats", args.repeats, 2, 1000, "use this number of random splits");
  add_count(command, "--timings", args.timings, 5, 100000,
            "time this number of windows and show the median");
  add_outliers_option(command, args.outliers);
  command.add_option("--seed", args.seed, "set the seed of windows, splits and learners")
      ->capture_default_str();
}

Result<int> run_trade_vibro(const TradeVibroArgs& args, Console& console) {
  const Output outputs[] = {{"page", args.files.page}, {"data", args.files.data}};
  if (Status ok = check_outputs(args.datasets, outputs); !ok) return pass(ok.error());
  if (Status ok = check_page(args.datasets, args.files); !ok) return pass(ok.error());
  const auto options = vibro_options(args);
  if (!options) return pass(options.error());
  TradeoffReport report = vibro_report(args);
  std::string text;
  std::vector<nlohmann::ordered_json> more_of_set;
  const auto progress = [&](std::size_t step, std::size_t steps, const std::string& what) {
    print_step(console, step, steps, what);
  };
  const auto sets = checked_sets(args, *options);
  if (!sets) return pass(sets.error());
  for (const auto& [path, set] : *sets) {
    const auto tradeoff = measure_vibro_tradeoff(set, *options, steady_wall_seconds, progress);
    if (!tradeoff) return pass(tradeoff.error(), path);
    for (const vibro::Protocol protocol : {vibro::Protocol::random, vibro::Protocol::blocks}) {
      report.sets.push_back(vibro_tradeoff_set(*tradeoff, set, path, protocol));
      text += vibro_summary(report.sets.back());
      more_of_set.push_back({{"paper_2023", averages_json(*tradeoff, protocol)}});
    }
    text += format_averages(*tradeoff);
    report.tables +=
        section("The paper's tables, " + path, vibro_tables(*tradeoff, bench_badge(set.kind)));
  }
  return write_tradeoff(args.files, report, text, console, more_of_set);
}

}  // namespace

void add_trade_vibro_command(const CommandGroup& trade) {
  trade.add<TradeVibroArgs>("vibro", run_trade_vibro);
}

}  // namespace weft::daemon::cli
