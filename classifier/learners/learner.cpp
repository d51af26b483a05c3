#include "classifier/learners/learner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/learners/class_folds.hpp"
#include "classifier/learners/learner_text.hpp"
#include "classifier/learners/learners.hpp"
#include "classifier/learners/linear_rule.hpp"
#include "classifier/learners/multi_class_svc.hpp"
#include "classifier/learners/outliers.hpp"
#include "classifier/learners/shrinkage_lda.hpp"
#include "classifier/learners/training_cost.hpp"
#include "classifier/learners/tree_ensemble.hpp"

namespace weft::classifier {
namespace {

using Fit = Result<PredictorPtr> (*)(const TrainingSet& training, const TrainOptions& options);
using Read = PredictorPtr (*)(LineReader& in, std::size_t features, std::size_t classes);

template <std::size_t layers>
Result<PredictorPtr> fit_layers(const TrainingSet& training, const TrainOptions& options) {
  constexpr std::size_t hidden_units = 100;
  return fit_network(training, std::vector<std::size_t>(layers, hidden_units), options);
}

Result<PredictorPtr> fit_lda(const TrainingSet& training, const TrainOptions& /*options*/) {
  auto lda = ShrinkageLda::fit(training.rows(), training.of_row(), training.classes());
  if (!lda) return pass(lda.error());
  return std::make_unique<ShrinkageLda>(std::move(*lda));
}

Result<PredictorPtr> fit_svc(const TrainingSet& training, const TrainOptions& options) {
  auto svc = MultiClassSvc::fit(training.rows(), training.of_row(), training.classes(),
                                class_folds(training.matrix, options).folds, options);
  if (!svc) return pass(svc.error());
  return std::make_unique<MultiClassSvc>(std::move(*svc));
}

struct LearnerInfo {
  Learner learner;
  std::string_view name;
  std::array<std::string_view, 2> aliases = {};  ///< the first one is that of the paper
  Fit fit = nullptr;                             ///< null for cores and choices
  Read read = nullptr;
  std::size_t least_rows = 1;  ///< of each label
};

constexpr std::array<LearnerInfo, 22> registry = {{
    {Learner::pvalue, "pvalue", {"cores", "cores-pvalue"}, nullptr, nullptr, 2},
    {Learner::pca, "pca", {"cores-pca"}, nullptr, nullptr, 2},
    {Learner::all, "all", {"Cores", "cores-all"}, nullptr, nullptr, 2},
    {Learner::lda, "lda", {"LDA"}, fit_lda, read_as<ShrinkageLda>, 2},
    {Learner::svc, "svc", {}, fit_svc, read_as<MultiClassSvc>, 2},
    {Learner::trees, "trees", {}, fit_extra_trees, read_as<TreeEnsemble>, 2},
    {Learner::nb, "nb", {"NB"}, fit_naive_bayes, read_naive_bayes},
    {Learner::knn, "knn", {"kNN"}, fit_neighbours, read_neighbours},
    {Learner::tree, "tree", {"Tree"}, fit_tree, read_as<TreeEnsemble>},
    {Learner::forest, "forest", {"RForest"}, fit_forest, read_as<TreeEnsemble>},
    {Learner::svm, "svm", {"SVM"}, fit_svm, read_svm},
    {Learner::logistic, "lg", {"LG"}, fit_logistic, read_logistic},
    {Learner::nn, "nn", {"NN"}, fit_layers<1>, read_network},
    {Learner::mlp2, "mlp2", {"MLP2"}, fit_layers<2>, read_network},
    {Learner::xgb, "xgb", {"XGB"}, fit_xgb, read_boosted},
    {Learner::xgbrf, "xgbrf", {"XGBRF"}, fit_xgbrf, read_boosted},
    {Learner::perceptron, "perceptron", {"kesler"}, fit_perceptron, read_as<LinearRule>},
    {Learner::perceptron_zscore,
     "perceptron-zscore",
     {"kesler-zscore"},
     fit_scaled_perceptron,
     read_as<LinearRule>},
    {Learner::least_squares, "least-squares", {}, fit_least_squares, read_as<LinearRule>},
    {Learner::ridge, "ridge", {}, fit_ridge, read_as<LinearRule>},
    {Learner::cores_best, "cores-best", {}},
    {Learner::best, "best", {}},
}};
static_assert(
    [] {
      for (std::size_t i = 0; i < registry.size(); ++i)
        if (registry[i].learner != static_cast<Learner>(i)) return false;
      return true;
    }(),
    "the registry is in the order of Learner");

constexpr const LearnerInfo& info_of(Learner learner) {
  return registry[static_cast<std::size_t>(learner)];
}

class Cores final : public Predictor {
 public:
  explicit Cores(FabricModel model) : model_(std::move(model)) {}
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> row) const override {
    auto vote = model_.classify(row);
    if (!vote) return pass(vote.error());
    return ClassScores{vote->winner, std::move(vote->support), std::move(vote->votes)};
  }
  void write(LineWriter& out) const override { write_cores(out, model_.cores()); }
  [[nodiscard]] std::vector<std::size_t> used_columns() const override {
    std::set<std::size_t> out;
    for (const FabricCore& core : model_.cores())
      out.insert(core.reducer().columns().begin(), core.reducer().columns().end());
    return {out.begin(), out.end()};
  }
  [[nodiscard]] const FabricModel* cores() const override { return &model_; }

 private:
  FabricModel model_;
};

Reduction reduction_of(Learner learner) {
  if (learner == Learner::pca) return Reduction::pca;
  return learner == Learner::all ? Reduction::all : Reduction::pvalue;
}

// Folds of a learner without cores.
std::vector<Fold> build_folds(const FeatureMatrix& matrix, const TrainOptions& options) {
  return class_folds(matrix, options).folds;
}

// With few trials the random folds matter more than the differences between learners. Over eight
// seeds LDA on ranks had 0 to 7 errors on the 54 training strokes of fabricslide at 10 mm/s. Groups
// are so few that every seed gives the same folds.
std::size_t rounds_of(const FeatureMatrix& matrix, const TrainOptions& options) {
  constexpr std::size_t few = 100, rounds = 5;
  return matrix.size() < few && options.fold_unit != FoldUnit::group ? rounds : 1;
}

// Folds of a choice, one round after the other; each round validates every trial once.
std::vector<Fold> folds_of_choice(const FeatureMatrix& matrix, TrainOptions options) {
  const std::size_t rounds = rounds_of(matrix, options);
  std::vector<Fold> out = build_folds(matrix, options);
  for (std::size_t round = 1; round < rounds; ++round) {
    ++options.seed;
    std::ranges::move(build_folds(matrix, options), std::back_inserter(out));
  }
  return out;
}

Result<PredictorPtr> train_cores_of(const FeatureMatrix& rows, const CoreTask& task,
                                    TrainOptions options, const TaskTrainer& trainer) {
  options.reduction = task.reduction;
  const CoreTrainer train_core_with = [&](const TrainOptions& kind) {
    return trainer ? trainer(task) : train_cores(rows, kind);
  };
  auto model = train(rows, options, train_core_with);
  if (!model) return pass(model.error());
  return predictor_of(std::move(*model));
}

Result<TrainedLearner> trained_on(FeatureMatrix rows, std::optional<std::size_t> fold,
                                  const Recipe& recipe, TrainOptions options,
                                  const TaskTrainer& trainer) {
  if (is_choice(recipe.learner))
    return fail({.code = Errc::invalid_argument,
                 .where = std::string(to_string(recipe.learner)),
                 .what = "training needs one learner, not a choice of several"});
  if (auto ok = check(rows); !ok) return pass(ok.error());
  std::vector<std::string> names = rows.names;
  if (!recipe.columns.empty()) rows = select_columns(rows, recipe.columns);
  auto outliers = remove_outliers(rows, options.outliers);
  if (!outliers) return pass(outliers.error());
  if (auto ok = check_labels(rows.labels, info_of(recipe.learner).least_rows); !ok)
    return pass(ok.error());
  Classes classes = find_classes(rows);
  if (auto ok = unless_stopped(options.stop); !ok) return pass(ok.error());
  FeatureView view = FeatureView::fit(recipe.view, rows.values, recipe.components);
  rows.values = view.apply(std::move(rows.values));
  rows.names = view.apply(rows.names);
  options.cap = recipe.cap;
  const CoreTask task{reduction_of(recipe.learner), recipe.view, fold, recipe.components};
  auto predictor = is_cores(recipe.learner) ? train_cores_of(rows, task, options, trainer)
                                            : info_of(recipe.learner).fit({rows, classes}, options);
  if (!predictor) return pass(predictor.error());
  return TrainedLearner(recipe.learner, std::move(classes.labels), std::move(names),
                        std::move(view), std::move(*predictor), recipe.columns,
                        std::move(*outliers));
}

// `fold`: the fold with these training rows.
Result<TrainedLearner> train_on(FeatureMatrix rows, std::optional<std::size_t> fold,
                                const Recipe& recipe, const TrainOptions& options,
                                const TaskTrainer& trainer) {
  return within_memory(rows.size(),
                       [&] { return trained_on(std::move(rows), fold, recipe, options, trainer); });
}

// Number of wrong predictions on the held-out rows.
Result<std::size_t> errors_on(const FeatureMatrix& matrix, const Fold& fold,
                              const TrainedLearner& trained) {
  std::size_t out = 0;
  for (const std::size_t r : fold.validate) {
    const auto winner = trained.classify(matrix.values.row(r));
    if (!winner) return pass(winner.error(), matrix.files[r]);
    out += trained.labels()[*winner] == matrix.labels[r] ? 0 : 1;
  }
  return out;
}

struct Choice {
  std::vector<RecipeScore> scores;
  std::size_t taken = 0;
};

/// Recipes that this build has a library for.
std::vector<Recipe> available_of(std::span<const Recipe> recipes) {
  std::vector<Recipe> out;
  for (const Recipe& recipe : recipes)
    if (is_available(recipe.learner)) out.push_back(recipe);
  return out;
}

Result<Choice> choose(const FeatureMatrix& matrix, std::span<const Recipe> recipes,
                      const TrainOptions& options, const TaskTrainer& trainer) {
  const std::vector<Fold> folds = folds_of_choice(matrix, options);
  const TrainingShape shape{matrix.size(), matrix.names.size(), find_classes(matrix).labels.size(),
                            folds.size()};
  Choice out{within_budget(available_of(recipes), shape, options)};
  std::size_t least = std::numeric_limits<std::size_t>::max();  // errors of the best recipe so far
  for (std::size_t i = 0; i < out.scores.size(); ++i) {
    RecipeScore& score = out.scores[i];
    score.rounds = rounds_of(matrix, options);
    for (std::size_t f = 0; f < folds.size() && score.errors < least && !score.skipped(); ++f) {
      const auto trained =
          train_on(select_rows(matrix, folds[f].train), f, score.recipe, options, trainer);
      if (!trained) return pass(trained.error());
      const auto errors = errors_on(matrix, folds[f], *trained);
      if (!errors) return pass(errors.error());
      score.errors += *errors;
      score.tested += folds[f].validate.size();
    }
    if (score.skipped() || score.errors >= least) continue;
    least = score.errors;
    out.taken = i;
  }
  return out;
}

}  // namespace

Result<ClassScores> scores_of(std::vector<double> score, std::string_view learner) {
  if (!std::ranges::all_of(score, [](double s) { return std::isfinite(s); }))
    return fail({.code = Errc::range,
                 .where = std::string(learner),
                 .what = "score not finite",
                 .hint = "Check the row: its values are far outside the training range"});
  return ClassScores{place_of_largest(score), std::move(score)};
}

Result<std::size_t> Predictor::classify(std::span<const double> row) const {
  const auto scores = predict(row);
  if (!scores) return pass(scores.error());
  return scores->winner;
}

std::string_view to_string(Learner learner) {
  return info_of(learner).name;
}

Result<Learner> learner_from(std::string_view text) {
  std::string names;
  for (const LearnerInfo& info : registry) {
    if (!text.empty() && (info.name == text || info.aliases[0] == text || info.aliases[1] == text))
      return info.learner;
    names += (names.empty() ? "" : ", ") + std::string(info.name);
  }
  return fail({.code = Errc::invalid_argument,
               .what = "unknown learner",
               .expected = names,
               .got = std::string(text)});
}

Result<Learner> single_learner_from(std::string_view text) {
  const auto learner = learner_from(text);
  if (!learner || !is_choice(*learner)) return learner;
  return fail({.code = Errc::invalid_argument,
               .what = "choice of several learners not supported here",
               .expected = "one learner, such as lda",
               .got = std::string(text)});
}

std::vector<Learner> all_learners() {
  std::vector<Learner> out;
  for (const LearnerInfo& info : registry) out.push_back(info.learner);
  return out;
}

bool is_available(Learner learner) {
  return (learner != Learner::xgb && learner != Learner::xgbrf) || have_xgboost();
}

std::string_view paper_name(Learner learner) {
  const LearnerInfo& info = info_of(learner);
  return info.aliases[0].empty() || is_cores(learner) ? info.name : info.aliases[0];
}

std::string to_string(const Recipe& recipe) {
  const bool capped = recipe.learner == Learner::pvalue || recipe.learner == Learner::pca;
  return std::string(to_string(recipe.learner)) +
         (capped ? ", N " + std::to_string(recipe.cap) : "") +
         (recipe.view == View::plain ? "" : ", " + std::string(to_string(recipe.view))) +
         (recipe.features.empty() ? "" : ", " + recipe.features);
}

// Learners that add up squares or products of features in one unit: a fifth moment would outweigh
// all others. The other learners scale by themselves or do not depend on the scale.
constexpr bool needs_scale(Learner learner) {
  return learner == Learner::knn || learner == Learner::svm || learner == Learner::logistic ||
         learner == Learner::nn || learner == Learner::mlp2;
}

std::vector<Recipe> candidates(Learner learner, std::size_t cap) {
  if (!is_choice(learner))
    return {{learner, cap, needs_scale(learner) ? View::standardised : View::plain}};
  std::vector<Recipe> out;
  for (const View view : tried_views()) {
    if (learner == Learner::best)
      for (const Learner simple : {Learner::lda, Learner::svc}) out.push_back({simple, cap, view});
    out.push_back({Learner::all, cap, view});
  }
  out.push_back({Learner::pca, cap});
  out.push_back({Learner::pvalue, cap});
  if (learner == Learner::best) out.push_back({Learner::trees, cap});
  return out;
}

PredictorPtr predictor_of(FabricModel cores) {
  return std::make_unique<Cores>(std::move(cores));
}

PredictorPtr read_predictor(Learner learner, LineReader& in, std::size_t features,
                            std::size_t classes) {
  const Read read = info_of(learner).read;
  if (read == nullptr) in.refuse("learner stored as cores", {}, std::string(to_string(learner)));
  return read == nullptr ? nullptr : read(in, features, classes);
}

Result<std::vector<FabricCore>> train_task(const FeatureMatrix& matrix, const CoreTask& task,
                                           TrainOptions options, std::size_t first,
                                           std::size_t stride) {
  options.reduction = task.reduction;
  FeatureMatrix rows = matrix;
  if (task.fold) {
    const std::vector<Fold> folds = folds_of_choice(matrix, options);
    if (*task.fold >= folds.size())
      return fail({.code = Errc::range,
                   .where = "train_task",
                   .what = "fold number out of range",
                   .expected = "less than " + std::to_string(folds.size()),
                   .got = std::to_string(*task.fold)});
    rows = select_rows(matrix, folds[*task.fold].train);
  }
  const FeatureView view = FeatureView::fit(task.view, rows.values, task.components);
  rows.values = view.apply(std::move(rows.values));
  rows.names = view.apply(rows.names);
  return train_cores(rows, options, first, stride);
}

Result<TrainedLearner> train_recipe(const FeatureMatrix& matrix, const Recipe& recipe,
                                    const TrainOptions& options) {
  return train_on(matrix, {}, recipe, options, {});
}

Result<ChosenLearner> train_best(const FeatureMatrix& matrix, std::span<const Recipe> candidates,
                                 const TrainOptions& options, const TaskTrainer& trainer) {
  if (candidates.empty())
    return fail({.code = Errc::invalid_argument, .what = "no learners to choose from"});
  Recipe recipe = candidates.front();
  std::vector<RecipeScore> scores;
  if (candidates.size() > 1) {
    if (auto ok = check(matrix); !ok) return pass(ok.error());
    auto choice = choose(matrix, candidates, options, trainer);
    if (!choice) return pass(choice.error());
    scores = std::move(choice->scores);
    recipe = scores[choice->taken].recipe;
  }
  auto trained = train_on(matrix, {}, recipe, options, trainer);
  if (!trained) return pass(trained.error());
  return ChosenLearner{std::move(*trained), recipe, std::move(scores)};
}

Result<ChosenLearner> train_learner(const FeatureMatrix& matrix, Learner learner,
                                    const TrainOptions& options, const TaskTrainer& trainer) {
  return train_best(matrix, candidates(learner, options.cap), options, trainer);
}

}  // namespace weft::classifier
