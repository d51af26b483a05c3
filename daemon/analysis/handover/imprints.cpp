#include "daemon/analysis/handover/imprints.hpp"

#include <nlohmann/json.hpp>
#include <sstream>

#include "classifier/imprint/imprint_model.hpp"
#include "daemon/analysis/handover/learn.hpp"
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

struct LearntImprints {
  Lesson lesson;
  classifier::LearnerEvaluation evaluation;
  ci::ImprintModel model;
  std::string words;
  double train_s = 0;
};

Result<LearntImprints> learn_imprints(const Dataset& data, const std::string& dataset_sha256,
                                      const HandOverHooks& hooks, const std::function<bool()>& stop,
                                      const std::function<void(const std::string&)>& announce) {
  classifier::TrainOptions options;
  options.threads = hooks.threads;
  options.stop = stop;
  const auto imprints = imprints_of(data);
  if (!imprints) return pass(imprints.error());
  const auto grid = grid_of(data, *imprints);
  if (!grid) return pass(grid.error());
  const ci::FeaturePlan plan;
  auto matrix = ci::build_matrix(*imprints, plan, options.threads);
  if (!matrix) return pass(matrix.error());
  // The recipe was refused unless each class has other objects to learn from.
  auto splits = classifier::leave_one_group_out(matrix->groups, matrix->labels);
  if (!splits) return pass(splits.error());
  Lesson lesson{model_name, std::move(*matrix), std::move(*splits), "one object"};
  auto got = evaluate_and_train(lesson, learner, options, hooks, announce);
  if (!got) return pass(got.error());
  const std::string how =
      training_words(to_string(learner), options, got->learner.labels().size(), got->folds);
  return LearntImprints{
      std::move(lesson),
      std::move(got->evaluation),
      {{std::string(to_string(data.info.kind)), dataset_sha256, software_version(), how},
       {*grid, plan},
       std::move(got->learner),
       std::move(got->aids)},
      std::move(got->words),
      got->train_s};
}

ordered_json learnt_json(const LearntImprints& learnt) {
  ordered_json out{{"imprints", learnt.lesson.matrix.size()},
                   {"array", ci::words_of(learnt.model.setup.grid)},
                   {"features", learnt.lesson.matrix.names},
                   {"learner", learnt.words},
                   {"training", learnt.model.provenance.training},
                   {"left_out", learnt.lesson.left_out}};
  out.update(evaluated_json(learnt.evaluation));
  out["model_train_s"] = learnt.train_s;
  return out;
}

// The model as a file, and the lines of evaluation.json about it.
Status add_model(const LearntImprints& learnt, ordered_json& evaluation,
                 std::vector<HandOverText>& texts) {
  std::ostringstream model;
  if (Status ok = ci::save_imprint_model(learnt.model, model); !ok) return ok;
  texts.push_back({std::string(model_name) + ".model", model.str()});
  const classifier::LearnerEvaluation& e = learnt.evaluation;
  evaluation["models"].push_back(
      model_json({model_name, std::string(hand_over_folder_name) + "/" + texts.back().name,
                  sha256_hex(texts.back().text), learnt.words, learnt.lesson.matrix.size(),
                  e.confusion.total(), e.accuracy, e.ci95.low, e.ci95.high}));
  evaluation["explorations"][model_name] = learnt_json(learnt);
  return {};
}

}  // namespace

Result<HandedImprints> hand_over_imprints(const Dataset& data, const std::string& dataset_sha256,
                                          const recipes::HandOver& wanted,
                                          const HandOverHooks& hooks, std::function<bool()> stop) {
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
  HandedImprints out;
  out.texts = {{"imprints.html", tables_html(*tables)}, {"imprints.json", figures.dump(2) + "\n"}};
  const auto learnt = learn_imprints(data, dataset_sha256, hooks, stop, announce);
  if (!learnt) return pass(learnt.error());
  if (Status ok = add_model(*learnt, evaluation, out.texts); !ok) return pass(ok.error());
  out.evaluation_json = evaluation.dump();
  return out;
}

}  // namespace weft::daemon
