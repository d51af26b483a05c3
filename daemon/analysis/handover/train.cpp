#include "daemon/analysis/handover/train.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/analysis/report/evaluation_page.hpp"
#include "daemon/analysis/report/json_parts.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/pages/plot/interval_text.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

classifier::FeatureSetup make_setup(const LearningMaterial& material, const DatasetInfo& info) {
  classifier::FeatureSetup setup;
  setup.taxels = material.trials.front().taxels;
  setup.phases = classifier::phases_of(material.trials.front());
  setup.sample_period_s = info.taxel_rate_hz > 0 ? 1 / info.taxel_rate_hz : 0;
  setup.exploration = material.exploration;
  return setup;
}

std::set<std::uint32_t> repetitions_of(const LearningMaterial& material,
                                       const std::vector<std::size_t>& rows) {
  std::set<std::uint32_t> out;
  for (const std::size_t row : rows) out.insert(material.repetition[row]);
  return out;
}

ordered_json groups_json(const LearningMaterial& material, const TrainingResult& training_result) {
  ordered_json out = ordered_json::array();
  for (std::size_t s = 0; s < training_result.splits.size(); ++s) {
    const classifier::Split& split = training_result.splits[s];
    out.push_back({{"repetitions", repetitions_of(material, split.test)},
                   {"trained", split.train.size()},
                   {"asked", split.test.size()},
                   {"learner", to_string(training_result.evaluation.recipes[s])},
                   {"accuracy", training_result.evaluation.splits[s].accuracy}});
  }
  return out;
}

}  // namespace

LearningMaterial collect_material(const Dataset& dataset, const std::string& exploration) {
  LearningMaterial out{exploration, complete_trials(dataset, exploration), {}};
  for (const TrialRecord& record : dataset.records)
    if (record.outcome == TrialOutcome::complete && record.spec.exploration == exploration)
      out.repetition.push_back(record.spec.repetition);
  return out;
}

std::vector<classifier::Split> splits_by_repetition(const std::vector<std::uint32_t>& repetition,
                                                    const std::vector<std::size_t>& group_of) {
  std::vector<classifier::Split> out;
  const std::set<std::size_t> groups(group_of.begin(), group_of.end());
  for (const std::size_t group : groups) {
    classifier::Split split;
    for (std::size_t row = 0; row < repetition.size(); ++row)
      (group_of.at(repetition[row] - 1) == group ? split.test : split.train).push_back(row);
    if (!split.test.empty()) out.push_back(std::move(split));
  }
  return out;
}

Result<EvaluatedModel> evaluate_and_train(const TrainingTask& task, classifier::Learner learner,
                                          const classifier::TrainOptions& options,
                                          const HandoverHooks& hooks,
                                          const std::function<void(const std::string&)>& announce) {
  const classifier::FeatureMatrix& matrix = task.matrix;
  announce(task.name + ": " + std::to_string(task.splits.size()) + " trainings, each without " +
           task.left_out);
  auto evaluation =
      classifier::evaluate(matrix, task.splits, learner, options, hooks.seconds_now, true);
  if (!evaluation) return pass(evaluation.error());
  name_groups_left_out(*evaluation);
  announce(task.name + ": the model of all " + std::to_string(matrix.size()) + " trials");
  const auto now = [&] { return hooks.seconds_now ? hooks.seconds_now() : 0.0; };
  const double began_s = now();
  auto chosen = classifier::train_learner(matrix, learner, options);
  if (!chosen) return pass(chosen.error());
  const double train_s = now() - began_s;
  auto postprocessing = classifier::fit_postprocessing(chosen->trained, matrix, options);
  if (!postprocessing) return pass(postprocessing.error());
  return EvaluatedModel{
      std::move(*evaluation),     std::move(chosen->trained),
      std::move(*postprocessing), classifier::fold_report(matrix, learner, options),
      to_string(chosen->recipe),  train_s};
}

std::string format_training(std::string_view learner, const classifier::TrainOptions& options,
                            std::size_t labels, const classifier::FoldReport& folds) {
  return "by the recipe's hand_over: learner " + std::string(learner) + ", seed " +
         std::to_string(options.seed) + ", cap " + std::to_string(options.cap) + ", folds " +
         std::to_string(options.folds) + " by recording" +
         (folds.as_requested() ? "" : " (" + format_folds(folds) + ")") +
         ", selection inside each fold, ties by " +
         std::string(to_string(classifier::resolved(options.tie, labels)));
}

Result<TrainingResult> train_exploration(const LearningMaterial& material, const DatasetInfo& info,
                                         const std::string& dataset_sha256,
                                         const recipes::Handover& wanted, std::uint32_t repetitions,
                                         const classifier::TrainOptions& options,
                                         const HandoverHooks& hooks,
                                         const std::function<void(const std::string&)>& announce) {
  const auto learner = classifier::learner_from(wanted.learner);
  if (!learner) return pass(learner.error());
  announce(material.exploration + ": features of " + std::to_string(material.trials.size()) +
           " trials");
  auto matrix = classifier::build_feature_matrix(material.trials, {}, options.threads);
  if (!matrix) return pass(matrix.error());
  TrainingTask task{material.exploration, std::move(*matrix),
                    splits_by_repetition(material.repetition,
                                         recipes::repetition_groups(repetitions, wanted.groups)),
                    "one group of repetitions"};
  auto got = evaluate_and_train(task, *learner, options, hooks, announce);
  if (!got) return pass(got.error());
  const std::string how =
      format_training(wanted.learner, options, got->learner.labels().size(), got->folds);
  return TrainingResult{
      {std::move(got->learner),
       make_setup(material, info),
       {std::string(to_string(info.kind)), dataset_sha256, software_version(), how},
       std::move(got->postprocessing)},
      std::move(got->words),
      std::move(got->evaluation),
      std::move(task.splits),
      task.matrix.names.size(),
      got->train_s};
}

ordered_json evaluated_json(const classifier::LearnerEvaluation& evaluation) {
  ordered_json out = evaluation_json(evaluation);
  out["pooled_accuracy"] = evaluation.confusion.accuracy();
  if (const auto& check = evaluation.calibration)
    out["calibration"] = {
        {"answers", check->reliability.trials},
        {"calibration_error", check->reliability.calibration_error},
        {"ci95", {check->calibration_error_ci95.low, check->calibration_error_ci95.high}},
        {"brier", check->reliability.brier},
        {"log_loss", check->reliability.log_loss}};
  return out;
}

ordered_json training_json(const LearningMaterial& material,
                           const TrainingResult& training_result) {
  ordered_json out{{"trials", material.trials.size()},
                   {"features", training_result.features},
                   {"learner", training_result.learner},
                   {"training", training_result.model.provenance.training}};
  out.update(evaluated_json(training_result.evaluation));
  out["groups"] = groups_json(material, training_result);
  out["model_train_s"] = training_result.train_s;
  return out;
}

std::string training_html(const LearningMaterial& material, const DatasetInfo& info,
                          const recipes::Handover& wanted, const TrainingResult& training_result) {
  const std::vector<EvaluatedLearner> learners{
      {wanted.learner, training_result.evaluation,
       wanted.learner.ends_with("best") ? training_result.learner : ""}};
  std::vector<GroupLeftOut> groups;
  for (std::size_t s = 0; s < training_result.splits.size(); ++s) {
    const auto repetitions = repetitions_of(material, training_result.splits[s].test);
    groups.push_back({"repetitions " + std::to_string(*repetitions.begin()) + " to " +
                          std::to_string(*repetitions.rbegin()),
                      training_result.splits[s].test.size(),
                      {training_result.evaluation.splits[s].accuracy}});
  }
  const EvaluationPage page{
      info.kind,
      info.name + ", " + material.exploration,
      {{"data", info.name + " (" + std::string(to_string(info.kind)) + "), exploration " +
                    material.exploration + ", " + thousands(material.trials.size()) + " trials, " +
                    std::to_string(training_result.model.learner.labels().size()) + " fabrics"},
       {"split",
        "each of " + std::to_string(groups.size()) + " groups of repetitions left out in turn"},
       {"training", training_result.model.provenance.training},
       {"model", material.exploration + ".model: " + training_result.learner +
                     ", trained on all trials; the figures are of models that were not"}},
      0.0,
      learners,
      groups,
      {}};
  return evaluation_html(page);
}

}  // namespace weft::daemon
