#include "daemon/analysis/report/evaluate_campaign.hpp"

#include <algorithm>
#include <array>
#include <thread>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

constexpr std::array reductions = {Reduction::pvalue, Reduction::pca, Reduction::all};
constexpr std::size_t steps_per_exploration = 2 + reductions.size();
constexpr std::size_t label_permutations = 8;  // one alone is off chance by a point or two
constexpr std::size_t timed_trials = 32;       // enough for a mean, few enough to cost nothing

// Spread over the campaign, so that every kind of cloth is among them.
Result<double> time_features(const std::vector<classifier::Trial>& trials,
                             const classifier::SecondsNow& seconds_now) {
  if (!seconds_now) return 0.0;
  classifier::FeatureExtractor extractor;
  const std::size_t count = std::min(timed_trials, trials.size());
  const double began = seconds_now();
  for (std::size_t k = 0; k < count; ++k) {
    const classifier::Trial& trial = trials[k * trials.size() / count];
    if (const auto features = extractor.extract(trial); !features)
      return pass(features.error(), trial.file);
  }
  return (seconds_now() - began) / static_cast<double>(count);
}

// The steps of one exploration, each announced before it starts.
class ExplorationEvaluator {
 public:
  ExplorationEvaluator(const EvaluateOptions& options, const classifier::SecondsNow& seconds_now,
                       std::function<void(const std::string&)> announce)
      : options_(&options), seconds_now_(&seconds_now), announce_(std::move(announce)) {}

  Result<ExplorationResult> run(const std::string& exploration,
                                const std::vector<classifier::Trial>& trials) {
    out_.exploration = exploration;
    out_.trials = trials.size();
    out_.threads = options_->threads != 0 ? options_->threads : std::thread::hardware_concurrency();
    if (Status ok = prepare(trials); !ok) return pass(ok.error(), exploration);
    for (const Reduction reduction : reductions)
      if (Status ok = add(reduction); !ok) return pass(ok.error(), exploration);
    if (Status ok = permute(); !ok) return pass(ok.error(), exploration);
    return std::move(out_);
  }

 private:
  Status prepare(const std::vector<classifier::Trial>& trials) {
    announce_(out_.exploration + ": features of " + std::to_string(trials.size()) + " trials");
    const Result<double> seconds = time_features(trials, *seconds_now_);
    if (!seconds) return pass(seconds.error());
    out_.feature_s_per_sample = *seconds;
    auto matrix = classifier::build_feature_matrix(trials, {}, options_->threads);
    if (!matrix) return pass(matrix.error());
    matrix_ = std::move(*matrix);
    out_.features = matrix_.names.size();
    auto splits = classifier::stratified_splits(matrix_.labels, options_->train_fraction,
                                                options_->repeats, options_->seed);
    if (!splits) return pass(splits.error());
    splits_ = std::move(*splits);
    return {};
  }

  [[nodiscard]] classifier::TrainOptions train_options(Reduction reduction) const {
    classifier::TrainOptions train;
    train.reduction = reduction;
    train.seed = options_->seed;
    train.threads = options_->threads;
    return train;
  }

  Status add(Reduction reduction) {
    announce_(out_.exploration + ": " + std::string(classifier::to_string(reduction)) + ", " +
              std::to_string(splits_.size()) + " trainings");
    auto evaluation =
        classifier::evaluate(matrix_, splits_, train_options(reduction), *seconds_now_);
    if (!evaluation) return pass(evaluation.error(), classifier::to_string(reduction));
    out_.reductions.push_back({reduction, std::move(*evaluation)});
    return {};
  }

  Status permute() {
    announce_(out_.exploration + ": labels in random order");
    const auto permuted =
        classifier::evaluate_permuted(matrix_, train_options(Reduction::pvalue),
                                      {options_->train_fraction, label_permutations, 1});
    if (!permuted) return pass(permuted.error());
    out_.permuted_accuracy = permuted->mean;
    return {};
  }

  const EvaluateOptions* options_;
  const classifier::SecondsNow* seconds_now_;
  std::function<void(const std::string&)> announce_;
  classifier::FeatureMatrix matrix_;
  std::vector<classifier::Split> splits_;
  ExplorationResult out_;
};

}  // namespace

const classifier::Evaluation* ExplorationResult::find(Reduction reduction) const {
  for (const ReductionResult& result : reductions)
    if (result.reduction == reduction) return &result.evaluation;
  return nullptr;
}

std::string interval_methods(const std::vector<ExplorationResult>& results) {
  std::vector<std::pair<std::string, std::string>> figures;
  for (const ExplorationResult& result : results)
    for (const ReductionResult& r : result.reductions)
      figures.emplace_back(result.exploration + " " + std::string(to_string(r.reduction)),
                           r.evaluation.ci95.method);
  return methods_text(figures);
}

Result<std::vector<ExplorationResult>> evaluate_campaign(const Dataset& dataset,
                                                         const EvaluateOptions& options,
                                                         const classifier::SecondsNow& seconds_now,
                                                         const EvaluationSink& progress) {
  if (Status ok = check(dataset); !ok) return pass(ok.error());
  const std::vector<std::string> explorations = list_explorations(dataset);
  if (explorations.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = dataset.info.name,
                 .what = "no complete trial to evaluate"});
  EvaluationProgress progress_now{0, explorations.size() * steps_per_exploration, {}};
  std::vector<ExplorationResult> out;
  for (const std::string& exploration : explorations) {
    ExplorationEvaluator evaluator(options, seconds_now, [&](const std::string& what) {
      progress_now.what = what;
      if (progress) progress(progress_now);
      ++progress_now.step;
    });
    auto result = evaluator.run(exploration, complete_trials(dataset, exploration));
    if (!result) return pass(result.error());
    out.push_back(std::move(*result));
  }
  return out;
}

}  // namespace weft::daemon
