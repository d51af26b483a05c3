#include "daemon/apps/weft/train_command.hpp"

#include <charconv>

#include "daemon/apps/weft/options.hpp"

namespace weft::daemon::cli {
namespace {

classifier::Tie tie_of(const TrainChoice& choice) {
  if (choice.tie == "loss") return classifier::Tie::loss;
  if (choice.tie == "order" || choice.paper_selection) return classifier::Tie::order;
  return classifier::Tie::automatic;
}

}  // namespace

std::string seed_problem(const std::string& text) {
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto [read_to, error] = std::from_chars(text.data(), end, seed);
  if (error == std::errc{} && read_to == end) return {};
  return "not a seed: " + text.substr(0, 40) + " (expected 0 to 18446744073709551615)";
}

void add_train_options(CLI::App& command, TrainChoice& choice) {
  command.add_option("--seed", choice.seed, "set the seed of folds, random splits and trees")
      ->check(seed_problem)
      ->capture_default_str();
  add_number(command, "--time-budget", choice.time_budget_s, 0.0, 1e6,
             "limit the estimated training time of all candidates of best [s]; 0: no limit");
  add_count(command, "--cap", choice.cap, 1, 100000,
            "use at most N features or components in each core");
  add_count(command, "--folds", choice.folds, 2, 1000, "cross-validate with this number of folds");
  add_keyword(command, "--fold-unit", choice.fold_unit, {"recording", "group"},
              "keep recordings or groups together in a fold");
  command.add_flag("--paper-selection", choice.paper_selection,
                   "select features once from all training trials, as in the paper");
  add_keyword(command, "--t-test", choice.t_test, {"pooled", "welch"},
              "select features with a common variance (pooled) or one per fabric (welch)");
  add_keyword(command, "--solver", choice.solver, {"own", "libsvm"},
              "solve support vector machines with Weft's own solver or with libsvm");
  add_keyword(command, "--tie", choice.tie, {"auto", "loss", "order"},
              "choose between parameters with equal errors by this rule");
  add_count(command, "--threads", choice.threads, 0, 1024,
            "use this number of threads; 0: one per processor core");
}

classifier::TrainOptions train_options(const TrainChoice& choice) {
  classifier::TrainOptions options;
  if (choice.t_test == "welch") options.t_test = classifier::TTest::welch;
  if (choice.solver == "libsvm") options.search = classifier::Search::libsvm;
  options.nested = !choice.paper_selection;
  options.tie = tie_of(choice);
  options.cap = choice.cap;
  options.folds = choice.folds;
  options.fold_unit =
      choice.fold_unit == "group" ? classifier::FoldUnit::group : classifier::FoldUnit::recording;
  options.seed = choice.seed;
  options.budget = choice.time_budget_s;
  options.threads = choice.threads;
  options.unconverged = std::make_shared<std::atomic<std::size_t>>(0);
  return options;
}

std::string unconverged_text(const classifier::TrainOptions& options) {
  const std::size_t count = options.unconverged ? options.unconverged->load() : 0;
  if (count == 0) return {};
  return "  WARNING: " + std::to_string(count) +
         " support vector machines did not converge: libsvm reached its limit of iterations\n";
}

std::string describe(const TrainChoice& choice, const std::string& folds) {
  return "seed " + std::to_string(choice.seed) + ", cap " + std::to_string(choice.cap) +
         ", folds " + std::to_string(choice.folds) + " by " + choice.fold_unit +
         (folds.empty() ? "" : " (" + folds + ")") + ", selection " +
         (choice.paper_selection ? "once (paper)" : "inside each fold") +
         (choice.t_test == "pooled" ? "" : " by Welch's t") +
         (choice.solver == "own" ? "" : ", solver " + choice.solver) +
         (choice.tie == "auto" ? "" : ", ties by " + choice.tie);
}

std::string describe(TrainChoice choice, std::size_t fabrics, const std::string& folds) {
  choice.tie = to_string(classifier::resolved(tie_of(choice), fabrics));
  return describe(choice, folds);
}

}  // namespace weft::daemon::cli
