
#include <nlohmann/json.hpp>
#include <sstream>

#include "classifier/imprint/imprint_model.hpp"
#include "daemon/analysis/handover/train.hpp"
#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon {
namespace {

namespace ci = classifier::imprint;

using nlohmann::ordered_json;

constexpr const char* model_name = "imprints";
constexpr classifier::Learner learner = classifier::Learner::best;

struct ImprintTrainingResult {
  TrainingTask task;
  classifier::LearnerEvaluation evaluation;
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
  auto matrix = ci::build_matrix(*imprints, plan, options.threads);
  if (!matrix) return pass(matrix.error());
  // The recipe was refused unless each class has other objects to learn from.
  auto splits = classifier::leave_one_group_out(matrix->groups, matrix->labels);
  if (!splits) return pass(splits.error());
  TrainingTask task{model_name, std::move(*matrix), std::move(*splits), "one object"};
  auto got = evaluate_and_train(task, learner, options, hooks, announce);
  if (!got) return pass(got.error());
  const std::string how =
      format_training(to_string(learner), options, got->learner.labels().size(), got->folds);
  return ImprintTrainingResult{
      std::move(task),
      std::move(got->evaluation),
      {{std::string(to_string(data.info.kind)), dataset_sha256, software_version(), how},
       {*grid, plan},
       std::move(got->learner),
       std::move(got->postprocessing)},
      std::move(got->words),
      got->train_s};
}

ordered_json training_json(const ImprintTrainingResult& training_result) {
  ordered_json out{{"imprints", training_result.task.matrix.size()},
                   {"array", ci::format_grid(training_result.model.setup.grid)},
                   {"features", training_result.task.matrix.names},
                   {"learner", training_result.words},
                   {"training", training_result.model.provenance.training},
                   {"left_out", training_result.task.left_out}};
  out.update(evaluated_json(training_result.evaluation));
  out["model_train_s"] = training_result.train_s;
  return out;
}

// The model as a file, and the lines of evaluation.json about it.
Status add_model(const ImprintTrainingResult& training_result, ordered_json& evaluation,
                 std::vector<HandoverText>& texts) {
  std::ostringstream model;
  if (Status ok = ci::save_imprint_model(training_result.model, model); !ok) return ok;
  texts.push_back({std::string(model_name) + ".model", model.str()});
  const classifier::LearnerEvaluation& e = training_result.evaluation;
  evaluation["models"].push_back(model_json(
      {model_name, std::string(handover_folder_name) + "/" + texts.back().name,
       sha256_hex(texts.back().text), training_result.words, training_result.task.matrix.size(),
       e.confusion.total(), e.accuracy, e.ci95.low, e.ci95.high}));
  evaluation["explorations"][model_name] = training_json(training_result);
  return {};
}

}  // namespace

Result<HandoverImprints> run_imprint_handover(const Dataset& data,
                                              const std::string& dataset_sha256,
                                              const recipes::Handover& wanted,
                                              const HandoverHooks& hooks,
                                              std::function<bool()> stop) {
  EvaluationProgress progress{0, 3, {}};
  const auto announce = [&](const std::string& what) {
    progress.what = what;
    if (hooks.progress) hooks.progress(progress);
    ++progress.step;
  };
  announce("imprints: four experiments at all scales");
  TableOptions options;
  options.threads = hooks.threads;
  options.stop = stop;
  const auto tables = measure_tables(data, options);
  if (!tables) return pass(tables.error());
  const ordered_json figures = tables_json(*tables);
  const DatasetInfo& info = data.info;
  ordered_json evaluation{
      {"bench", to_string(info.kind)},
      {"campaign", info.name},
      {"dataset_sha256", dataset_sha256},
      {"recipe_sha256", info.recipe_sha256},
      {"rig_sha256", info.rig_sha256},
      {"software_version", software_version()},
      {"hand_over", {{"from", "imprints"}, {"at_most_s", wanted.at_most_s}}},
      {"meaning",
       "The experiments of Ellis 1986 on the last scan of phase P of each trial: right "
       "answers of rules that were trained without the imprints they are asked about. The model is "
       "of all imprints; its accuracy is of others, each trained without what it was asked about."},
      {"models", ordered_json::array()},
      {"imprints", figures}};
  HandoverImprints out;
  out.texts = {{"imprints.html", tables_html(*tables)}, {"imprints.json", figures.dump(2) + "\n"}};
  const auto training_result = train_imprints(data, dataset_sha256, hooks, stop, announce);
  if (!training_result) return pass(training_result.error());
  if (Status ok = add_model(*training_result, evaluation, out.texts); !ok) return pass(ok.error());
  out.evaluation_json = evaluation.dump();
  return out;
}

}  // namespace weft::daemon
