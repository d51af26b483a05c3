#include "daemon/analysis/handover/train.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "classifier/imprint/feature_sets.hpp"
#include "classifier/imprint/imprint_model.hpp"
#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/analysis/report/evaluation_page.hpp"
#include "daemon/analysis/report/headline.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/pages/plot/interval_text.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon {
namespace {

namespace ci = classifier::imprint;
using nlohmann::ordered_json;

constexpr const char* model_name = "imprints";
constexpr classifier::Learner imprint_learner = classifier::Learner::best;

/// A learner trained on all rows of a matrix, and the evaluation of models that lacked some rows.
struct EvaluatedModel {
  classifier::Evaluation evaluation;
  classifier::TrainedLearner learner;
  std::optional<classifier::VotePostprocessing>
      postprocessing;  ///< nothing if no fold could be made
  classifier::FoldReport folds;
  classifier::Recipe recipe;
  double train_s = 0;  ///< training time of the model, measured [s]
};
/// Training data, and a description of what each split leaves out.
struct TrainingTask {
  std::string name;
  classifier::FeatureMatrix matrix;
  std::vector<classifier::Recipe> candidates;
  std::vector<classifier::Split> splits;
  std::string left_out;
};

/// Calls `announce` before both parts: "M1: 5 trainings, each without one group of repetitions".
/// Errors: the classifier's.
Result<EvaluatedModel> evaluate_and_train(const TrainingTask& task, classifier::Learner learner,
                                          const classifier::TrainOptions& options,
                                          const HandoverHooks& hooks,
                                          const std::function<void(const std::string&)>& announce) {
  const classifier::FeatureMatrix& matrix = task.matrix;
  announce(task.name + ": " + std::to_string(task.splits.size()) + " trainings, each without " +
           task.left_out);
  auto evaluation =
      classifier::evaluate(matrix, task.splits, task.candidates, options, hooks.seconds_now, true);
  if (!evaluation) return pass(evaluation.error());
  name_groups_left_out(*evaluation);
  announce(task.name + ": model of all " + std::to_string(matrix.size()) + " trials");
  const auto now = [&] { return hooks.seconds_now ? hooks.seconds_now() : 0.0; };
  const double began_s = now();
  auto chosen = classifier::train_best(matrix, task.candidates, options);
  if (!chosen) return pass(chosen.error());
  const double train_s = now() - began_s;
  auto used = ci::used_features(chosen->trained, matrix);
  auto postprocessing = classifier::fit_postprocessing(used.learner, used.matrix, options);
  if (!postprocessing) return pass(postprocessing.error());
  return EvaluatedModel{
      std::move(*evaluation),     std::move(used.learner),
      std::move(*postprocessing), classifier::fold_report(matrix, learner, options),
      std::move(chosen->recipe),  train_s};
}

/// Description of the training, for the model's provenance.
std::string format_training(std::string_view learner, const classifier::TrainOptions& options,
                            std::size_t labels, const classifier::FoldReport& folds) {
  return "by the recipe's hand_over: learner " + std::string(learner) + ", seed " +
         std::to_string(options.seed) + ", cap " + std::to_string(options.cap) + ", folds " +
         std::to_string(options.folds) + " by recording" +
         (folds.as_requested() ? "" : " (" + format_folds(folds) + ")") +
         ", selection inside each fold, ties by " +
         std::string(to_string(classifier::resolved(options.tie, labels)));
}

/// An evaluation for evaluation.json: evaluation_json() plus pooled accuracy and calibration.
ordered_json evaluated_json(const classifier::Evaluation& evaluation) {
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

LearningMaterial collect_material(const Dataset& dataset, const std::string& exploration) {
  LearningMaterial out{exploration, complete_trials(dataset, exploration), {}};
  for (const TrialRecord& record : dataset.records)
    if (record.outcome == TrialOutcome::complete && record.spec.exploration == exploration)
      out.repetition.push_back(record.spec.repetition);
  return out;
}

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

ordered_json groups_json(const TrainingResult& training_result) {
  ordered_json out = ordered_json::array();
  for (std::size_t s = 0; s < training_result.splits.size(); ++s) {
    const classifier::Split& split = training_result.splits[s];
    out.push_back({{"repetitions", repetitions_of(training_result.material, split.test)},
                   {"trained", split.train.size()},
                   {"asked", split.test.size()},
                   {"learner", to_string(training_result.evaluation.recipes[s])},
                   {"accuracy", training_result.evaluation.splits[s].accuracy}});
  }
  return out;
}

struct ImprintTrainingResult {
  TrainingTask task;
  classifier::Evaluation evaluation;
  ci::ImprintModel model;
  std::string words;
  double train_s = 0;
};

Result<ImprintTrainingResult> train_imprints(
    const Dataset& data, const std::string& dataset_sha256, const HandoverHooks& hooks,
    const std::function<bool()>& stop, const std::function<void(const std::string&)>& announce) {
  classifier::TrainOptions options;
  options.threads = hooks.threads;
  options.stop = stop;
  const auto imprints = extract_imprints(data);
  if (!imprints) return pass(imprints.error());
  const auto grid = find_grid(data, *imprints);
  if (!grid) return pass(grid.error());
  const ci::FeaturePlan plan;
  auto matrix = ci::build_matrix(*imprints, ci::with_maps(plan), options.threads);
  if (!matrix) return pass(matrix.error());
  // The recipe check requires that each class keeps two imprints when any object is left out.
  auto splits = classifier::leave_one_group_out(matrix->groups, matrix->labels);
  if (!splits) return pass(splits.error());
  auto candidates = ci::feature_set_candidates(*matrix, plan, options.cap);
  TrainingTask task{model_name, std::move(*matrix), std::move(candidates), std::move(*splits),
                    "one object"};
  auto got = evaluate_and_train(task, imprint_learner, options, hooks, announce);
  if (!got) return pass(got.error());
  const std::string how = format_training(to_string(imprint_learner), options,
                                          got->learner.labels().size(), got->folds);
  return ImprintTrainingResult{
      std::move(task),
      std::move(got->evaluation),
      {std::move(got->learner),
       {*grid, ci::chosen_plan(plan, got->recipe)},
       {std::string(to_string(data.info.kind)), dataset_sha256, software_version(), how},
       std::move(got->postprocessing),
       ci::content_digests(*imprints)},
      to_string(got->recipe),
      got->train_s};
}

ordered_json training_json(const ImprintTrainingResult& training_result) {
  ordered_json out{{"imprints", training_result.task.matrix.size()},
                   {"array", ci::format_grid(training_result.model.setup.grid)},
                   {"features", training_result.model.learner.feature_names()},
                   {"learner", training_result.words},
                   {"training", training_result.model.provenance.training},
                   {"left_out", training_result.task.left_out}};
  out.update(evaluated_json(training_result.evaluation));
  out["model_train_s"] = training_result.train_s;
  return out;
}

// Adds the model file and its entries in evaluation.json.
Status add_model(const ImprintTrainingResult& training_result, ordered_json& evaluation,
                 std::vector<HandoverText>& texts) {
  std::ostringstream model;
  if (Status ok = classifier::save_model(training_result.model, model); !ok) return ok;
  texts.push_back({std::string(model_name) + ".model", model.str()});
  evaluation["models"].push_back(model_line_json(model_name, texts.back(), training_result.words,
                                                 training_result.task.matrix.size(),
                                                 training_result.evaluation));
  evaluation["explorations"][model_name] = training_json(training_result);
  return {};
}

}  // namespace

ordered_json handover_heading_json(const DatasetInfo& info, const std::string& dataset_sha256) {
  return {{"bench", to_string(info.kind)},    {"campaign", info.name},
          {"dataset_sha256", dataset_sha256}, {"recipe_sha256", info.recipe_sha256},
          {"rig_sha256", info.rig_sha256},    {"software_version", software_version()}};
}

ordered_json model_line_json(const std::string& name, const HandoverText& model,
                             const std::string& learner, std::size_t trials,
                             const classifier::Evaluation& e) {
  return model_json({name, std::string(handover_folder_name) + "/" + model.name,
                     sha256_hex(model.text), learner, trials, e.confusion.total(), e.accuracy,
                     e.ci95.low, e.ci95.high});
}

Result<TrainingResult> train_exploration(const Dataset& dataset, const std::string& exploration,
                                         const std::string& dataset_sha256,
                                         const recipes::Handover& wanted, std::uint32_t repetitions,
                                         const classifier::TrainOptions& options,
                                         const HandoverHooks& hooks,
                                         const std::function<void(const std::string&)>& announce) {
  const auto learner = classifier::learner_from(wanted.learner);
  if (!learner) return pass(learner.error());
  const DatasetInfo& info = dataset.info;
  LearningMaterial material = collect_material(dataset, exploration);
  announce(material.exploration + ": features of " + std::to_string(material.trials.size()) +
           " trials");
  auto matrix = classifier::build_feature_matrix(material.trials, {}, options.threads);
  if (!matrix) return pass(matrix.error());
  TrainingTask task{material.exploration, std::move(*matrix),
                    classifier::candidates(*learner, options.cap),
                    splits_by_repetition(material.repetition,
                                         recipes::repetition_groups(repetitions, wanted.groups)),
                    "one group of repetitions"};
  auto got = evaluate_and_train(task, *learner, options, hooks, announce);
  if (!got) return pass(got.error());
  const std::string how =
      format_training(wanted.learner, options, got->learner.labels().size(), got->folds);
  classifier::FeatureSetup setup = make_setup(material, info);
  std::vector<std::uint64_t> digests = classifier::content_digests(material.trials);
  return TrainingResult{
      std::move(material),
      {std::move(got->learner),
       std::move(setup),
       {std::string(to_string(info.kind)), dataset_sha256, software_version(), how},
       std::move(got->postprocessing),
       std::move(digests)},
      to_string(got->recipe),
      std::move(got->evaluation),
      std::move(task.splits),
      task.matrix.names.size(),
      got->train_s};
}

Status add_page(const std::string& name, const ordered_json& record, const Document& document,
                std::vector<HandoverText>& texts) {
  std::string text = record_with_page(record, document);
  auto page = page_of_record(text);
  if (!page) return pass(page.error(), name);
  texts.push_back({name + ".html", std::move(*page)});
  if (name + ".json" != evaluation_file_name)  // an exploration of that name has no record
    texts.push_back({name + ".json", std::move(text)});
  return {};
}

ordered_json training_json(const TrainingResult& training_result) {
  ordered_json out{{"trials", training_result.material.trials.size()},
                   {"features", training_result.features},
                   {"learner", training_result.learner},
                   {"training", training_result.model.provenance.training}};
  out.update(evaluated_json(training_result.evaluation));
  out["groups"] = groups_json(training_result);
  out["model_train_s"] = training_result.train_s;
  return out;
}

Document training_document(const DatasetInfo& info, const recipes::Handover& wanted,
                           const TrainingResult& training_result) {
  const LearningMaterial& material = training_result.material;
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
        "cross-validation over " + std::to_string(groups.size()) + " groups of repetitions"},
       {"training", training_result.model.provenance.training},
       {"model", material.exploration + ".model: " + training_result.learner +
                     ", trained on all trials; the accuracy is cross-validated"}},
      0.0,
      learners,
      groups,
      {}};
  return evaluation_document(page);
}

Result<ordered_json> run_imprint_handover(const Dataset& data, const std::string& dataset_sha256,
                                          const recipes::Handover& wanted,
                                          const HandoverHooks& hooks, const StopRequested& stop,
                                          std::vector<HandoverText>& texts) {
  StepAnnouncer announce{hooks.progress, {0, 3, {}}};
  announce("imprints: four experiments at all scales");
  TableOptions options;
  options.threads = hooks.threads;
  options.stop = stop;
  const auto tables = measure_tables(data, options);
  if (!tables) return pass(tables.error());
  const ordered_json figures = tables_json(*tables);
  if (Status ok = add_page("imprints", figures, tables_document(*tables), texts); !ok)
    return pass(ok.error());
  ordered_json evaluation = handover_heading_json(data.info, dataset_sha256);
  evaluation["hand_over"] = {{"from", "imprints"}, {"at_most_s", wanted.at_most_s}};
  evaluation["meaning"] =
      "The experiments of Ellis 1986 use the last scan of phase P of each trial. They count right "
      "predictions of rules trained without the tested imprints. The saved model is trained on all "
      "imprints; its accuracy is cross-validated by object.";
  evaluation["models"] = ordered_json::array();
  evaluation["imprints"] = figures;
  const auto training_result =
      train_imprints(data, dataset_sha256, hooks, stop, std::ref(announce));
  if (!training_result) return pass(training_result.error());
  if (Status ok = add_model(*training_result, evaluation, texts); !ok) return pass(ok.error());
  return evaluation;
}

}  // namespace weft::daemon
