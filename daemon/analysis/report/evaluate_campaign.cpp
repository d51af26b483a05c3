#include "daemon/analysis/report/evaluate_campaign.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <thread>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "daemon/analysis/report/confounding.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

constexpr std::array reductions = {Reduction::pvalue, Reduction::pca, Reduction::all};
constexpr std::size_t label_permutations = 8;  // a single permutation deviates from chance by one
                                               // or two per cent
constexpr std::size_t best_permutations = 1;   // costs as much as two or three splits with
                                               // Learner::best
constexpr std::size_t timed_trials = 32;       // enough for a mean, at negligible cost

std::size_t steps_per_exploration(const EvaluateOptions& options) {
  return 2 + reductions.size() + (options.best_splits > 0 ? 1 : 0);
}

// The timed trials are spread over the campaign, to include every fabric.
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

classifier::TrainOptions train_options(const EvaluateOptions& options) {
  classifier::TrainOptions train;
  train.seed = options.seed;
  train.threads = options.threads;
  train.stop = options.stop;
  return train;
}

std::span<const classifier::Split> first(const std::vector<classifier::Split>& splits,
                                         std::size_t most) {
  return std::span(splits).first(std::min(most, splits.size()));
}

Result<BestResult> evaluate_best(const classifier::FeatureMatrix& matrix,
                                 std::span<const classifier::Split> splits,
                                 const EvaluateOptions& options) {
  constexpr auto learner = classifier::Learner::best;
  const classifier::TrainOptions train = train_options(options);
  auto evaluation = classifier::evaluate(matrix, splits, learner, train);
  if (!evaluation) return pass(evaluation.error(), "best");
  const auto permuted = classifier::evaluate_permuted(
      matrix, learner, train, {options.train_fraction, best_permutations, 1});
  if (!permuted) return pass(permuted.error(), "best");
  return BestResult{std::move(*evaluation), permuted->mean};
}

/// Every reduction on `splits`, with the motion levels of the trials removed.
Result<std::vector<ReductionResult>> evaluate_without_level(
    std::vector<classifier::Trial> trials, std::span<const classifier::Split> splits,
    const EvaluateOptions& options) {
  for (classifier::Trial& trial : trials)
    if (Status ok = classifier::without_level(trial, Phase::motion); !ok) return pass(ok.error());
  const auto matrix = classifier::build_feature_matrix(trials, {}, options.threads);
  if (!matrix) return pass(matrix.error());
  std::vector<ReductionResult> out;
  for (const Reduction reduction : reductions) {
    auto evaluation = classifier::evaluate(*matrix, splits, classifier::cores_with(reduction),
                                           train_options(options));
    if (!evaluation) return pass(evaluation.error(), "levels removed");
    out.push_back({reduction, std::move(*evaluation)});
  }
  return out;
}

// Runs the steps for one exploration; each is announced before it starts.
Result<ExplorationResult> evaluate_exploration(const Dataset& dataset,
                                               const std::string& exploration,
                                               const EvaluateOptions& options,
                                               const classifier::SecondsNow& seconds_now,
                                               StepAnnouncer& announce) {
  const std::vector<classifier::Trial> trials = complete_trials(dataset, exploration);
  ExplorationResult out;
  out.exploration = exploration;
  out.trials = trials.size();
  out.threads = options.threads != 0 ? options.threads : std::thread::hardware_concurrency();
  announce(exploration + ": features of " + std::to_string(trials.size()) + " trials");
  const Result<double> seconds = time_features(trials, seconds_now);
  if (!seconds) return pass(seconds.error());
  out.feature_s_per_sample = *seconds;
  const auto matrix = classifier::build_feature_matrix(trials, {}, options.threads);
  if (!matrix) return pass(matrix.error());
  out.features = matrix->names.size();
  const auto splits = options.leave_groups_out
                          ? classifier::leave_one_group_out(matrix->groups, matrix->labels)
                          : classifier::stratified_splits(matrix->labels, options.train_fraction,
                                                          options.repeats, options.seed);
  if (!splits) return pass(splits.error());
  for (const Reduction reduction : reductions) {
    announce(exploration + ": " + std::string(classifier::to_string(reduction)) + ", " +
             std::to_string(splits->size()) + " trainings");
    auto evaluation = classifier::evaluate(*matrix, *splits, classifier::cores_with(reduction),
                                           train_options(options), seconds_now);
    if (!evaluation) return pass(evaluation.error(), classifier::to_string(reduction));
    out.reductions.push_back({reduction, std::move(*evaluation)});
  }
  out.confounded = shares_mountings(dataset, matrix->files, *splits);
  const bool without_level = out.confounded && options.level_splits > 0;
  announce(exploration + ": shuffled labels" + (without_level ? ", levels removed" : ""));
  if (without_level) {
    auto results = evaluate_without_level(trials, first(*splits, options.level_splits), options);
    if (!results) return pass(results.error());
    out.level_removed = std::move(*results);
  }
  const auto permuted =
      classifier::evaluate_permuted(*matrix, classifier::Learner::pvalue, train_options(options),
                                    {options.train_fraction, label_permutations, 1});
  if (!permuted) return pass(permuted.error());
  out.permuted_accuracy = permuted->mean;
  if (options.best_splits == 0) return out;
  announce(exploration + ": best");
  auto best = evaluate_best(*matrix, first(*splits, options.best_splits), options);
  if (!best) return pass(best.error());
  out.best = std::move(*best);
  return out;
}

}  // namespace

const classifier::Evaluation* find(const std::vector<ReductionResult>& results,
                                   Reduction reduction) {
  for (const ReductionResult& result : results)
    if (result.reduction == reduction) return &result.evaluation;
  return nullptr;
}

const classifier::Evaluation* ExplorationResult::find(Reduction reduction) const {
  return daemon::find(reductions, reduction);
}

Repeated repeated_in(const Dataset& dataset) {
  TrialPlace most;
  for (const TrialRecord& record : dataset.records) {
    const TrialPlace& place = record.spec.place;
    if (place == TrialPlace{}) return Repeated::unknown;
    most = {std::max(most.piece, place.piece), std::max(most.mounting, place.mounting),
            std::max(most.patch, place.patch)};
  }
  if (most.piece > 1) return Repeated::piece;
  if (most.mounting > 1) return Repeated::mounting;
  return most.patch > 1 ? Repeated::patch : Repeated::touch;
}

std::string_view to_string(Repeated repeated) {
  switch (repeated) {
    case Repeated::unknown:
      break;
    case Repeated::touch:
      return "another touch of the same path";
    case Repeated::patch:
      return "a new patch of the mounted piece";
    case Repeated::mounting:
      return "a new mounting of the piece";
    case Repeated::piece:
      return "a new piece of the fabric";
  }
  return "not recorded";
}

Result<CampaignBeside> evaluate_beside(Dataset dataset, EvaluateOptions options,
                                       const EvaluationSink& progress) {
  CampaignBeside out{dataset.info.name, repeated_in(dataset), dataset.trials.size(), {}};
  const bool by_piece = out.repeated == Repeated::piece;
  options.leave_groups_out = by_piece || out.repeated == Repeated::mounting;
  options.level_splits = 0;
  for (std::size_t i = 0; options.leave_groups_out && i < dataset.trials.size(); ++i) {
    TrialSpec& spec = dataset.records[i].spec;
    spec.group = std::to_string(by_piece ? spec.place.piece : spec.place.mounting);
    dataset.trials[i].group = spec.group;
  }
  auto results = evaluate_campaign(dataset, options, {}, progress);
  if (!results) return pass(results.error(), out.name);
  out.results = std::move(*results);
  return out;
}

std::string interval_methods(const std::vector<ExplorationResult>& results) {
  std::vector<std::pair<std::string, std::string>> figures;
  for (const ExplorationResult& result : results)
    for (const ReductionResult& r : result.reductions)
      figures.emplace_back(result.exploration + " " + std::string(to_string(r.reduction)),
                           r.evaluation.ci95.method);
  for (const ExplorationResult& result : results)
    if (result.best)
      figures.emplace_back(result.exploration + " best", result.best->scores.ci95.method);
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
                 .what = "no complete trials to evaluate"});
  StepAnnouncer announce{progress, {0, explorations.size() * steps_per_exploration(options), {}}};
  std::vector<ExplorationResult> out;
  for (const std::string& exploration : explorations) {
    auto result = evaluate_exploration(dataset, exploration, options, seconds_now, announce);
    if (!result) return pass(result.error(), exploration);
    out.push_back(std::move(*result));
  }
  return out;
}

}  // namespace weft::daemon
