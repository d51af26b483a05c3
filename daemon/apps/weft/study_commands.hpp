#pragma once
// Commands that write pages and figures: `weft report`, `trade`, `design`.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/evaluate_command.hpp"
#include "daemon/apps/weft/trial_choice.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

// `weft design`: which setting a pilot study recommends, and how many repetitions are enough.

struct DesignAnalyseArgs {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path out;  ///< page; empty: not written
  std::string learner = "lda";
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
  double shortest_mm = 0.2, longest_mm = 5;
};
void add_options(CLI::App& command, DesignAnalyseArgs& args);
Result<int> run_design_analyse(const DesignAnalyseArgs& args, Console& console);

struct DesignRepetitionsArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;  ///< page; empty: not written
  TrialChoice trials;
  std::string learner = "pvalue";
  std::size_t predict = 20;
  double accuracy = 0.9;
  std::size_t most = 200;
  std::size_t first = 0;
  bool strokes = false;
  std::size_t draws = 4;
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
};
void add_options(CLI::App& command, DesignRepetitionsArgs& args);
Result<int> run_design_repetitions(const DesignRepetitionsArgs& args, Console& console);

// `weft trade vibro`: F-score against time on recordings of sound and vibration.

struct TradeVibroArgs {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path out;   ///< page
  std::filesystem::path data;  ///< JSON; empty: not written
  std::vector<std::string> methods;
  std::vector<std::string> families;
  std::string exploration;  ///< of campaigns; empty: the only one there is
  std::vector<double> windows_s = {1.0, 2.0};
  std::size_t blocks = 5;
  double step_s = 0.25;
  std::size_t per_recording = 100;
  std::size_t repeats = 5;
  std::size_t timings = 101;
  std::uint64_t seed = 1;
};
void add_options(CLI::App& command, TradeVibroArgs& args);

Result<int> run_trade_vibro(const TradeVibroArgs& args, Console& console);

// `weft trade sim`: what accuracy of the plant costs in processor time.

struct TradeSimArgs {
  std::filesystem::path out;        ///< page
  std::filesystem::path data;       ///< JSON; empty: not written
  std::filesystem::path table;      ///< sim/fidelity.json; empty: not written
  std::filesystem::path reference;  ///< trajectories of another solver; empty: the finest run
  std::filesystem::path fabrics = "sim/fabrics.json";
  std::vector<std::string> scenes;  ///< empty: all; "none"
  bool quick = false;
  std::size_t timings = 7;
  bool downstream = false;
  std::size_t seeds = 5;   ///< of downstream
  std::size_t trials = 8;  ///< of downstream: on each swatch
};
void add_options(CLI::App& command, TradeSimArgs& args);

Result<int> run_trade_sim(const TradeSimArgs& args, Console& console);

// `weft report`: the report of a campaign that is over, from its folder alone.

struct ReportArgs {
  std::filesystem::path folder;  ///< campaign.sqlite and dataset.h5, of weft run or weftd
  std::filesystem::path out;     ///< page; its JSON document goes beside it
  std::size_t repeats = 30;      ///< random splits, as of weft run
  std::vector<std::string> vary{"features", "learner", "slide"};  ///< of the classifier's trade
  bool no_tradeoff = false;
  std::size_t tradeoff_splits = 5;
  std::filesystem::path fidelity;  ///< table of weft trade sim; empty: no such section
};
void add_options(CLI::App& command, ReportArgs& args);

/// Errors: not_found, where the folder has no data set; verify()'s, the trade's.
Result<int> run_report(const ReportArgs& args, Console& console);

struct TradeClassifierArgs {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path out;      ///< page
  std::filesystem::path data;     ///< JSON; empty: not written
  std::vector<std::string> vary;  ///< families; empty: all
  std::string learner = "pvalue";
  std::string exploration;  ///< of the default; empty: each data set's first
  std::string norm = "l2";
  std::vector<std::string> train_groups;
  std::vector<std::string> test_groups;
  bool leave_one_group_out = false;
  double train_fraction = 0.0;  ///< 0: by groups, or what suits the data set
  std::size_t splits = 10;      ///< at most
  std::size_t timings = 9;
  TrainChoice training;
};
void add_options(CLI::App& command, TradeClassifierArgs& args);

/// What it measures; `text` gets its tables, for a terminal.
Result<TradeoffReport> measured_tradeoff(const TradeClassifierArgs& args, Console& console,
                                         std::string& text);
Result<int> run_trade_classifier(const TradeClassifierArgs& args, Console& console);

}  // namespace weft::daemon::cli
