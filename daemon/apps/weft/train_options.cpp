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
  return "a seed is a whole number from 0 to 18446744073709551615, not " + text.substr(0, 40);
}

void add_train_options(CLI::App& command, TrainChoice& choice) {
  command.add_option("--seed", choice.seed, "of folds, random splits and trees")
      ->check(seed_problem)
      ->capture_default_str();
  add_number(command, "--time-budget", choice.time_budget_s, 0.0, 1e6,
             "limit on the estimated training time of all candidates of best [s on the reference "
             "machine]; it depends on the size of the data alone, so that every machine chooses "
             "alike; 0: no limit");
  add_count(command, "--cap", choice.cap, 1, 100000,
            "most features or components of a core, the paper's N");
  add_count(command, "--folds", choice.folds, 2, 1000, "of the cross-validation");
  add_keyword(command, "--fold-unit", choice.fold_unit, {"recording", "group"},
              "what stays together in a fold");
  command.add_flag("--paper-selection", choice.paper_selection,
                   "select features once from all training trials, as the paper does, instead of "
                   "inside each fold");
  add_keyword(
      command, "--t-test", choice.t_test, {"pooled", "welch"},
      "that selects features: pooled, one variance for both fabrics as in the paper; welch, a "
      "variance for each");
  add_keyword(
      command, "--solver", choice.solver, {"own", "libsvm"},
      "of the support vector machines: own; libsvm, the reference, which solves every point "
      "of the grid by itself: the same parameters and answers, far slower");
  add_keyword(command, "--tie", choice.tie, {"auto", "loss", "order"},
              "between parameters with equal errors: loss, the smaller hinge loss; order, the "
              "smaller C, gamma, delta, which trains in half the time; auto: loss, but order with "
              "--paper-selection or " +
                  std::to_string(classifier::many_fabrics) + " fabrics and more");
  add_count(command, "--threads", choice.threads, 0, 1024,
            "0: one per core; results do not depend on it");
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
         " support vector machines were not solved to the tolerance: libsvm reached its limit of "
         "iterations\n";
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
