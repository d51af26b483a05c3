#include "classifier/baseline/learner.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "classifier/base/parallel.hpp"
#include "classifier/baseline/class_folds.hpp"
#include "classifier/fabric/folds.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier {
namespace {

constexpr NameTable<Learner, 8> learner_names = {{{Learner::pvalue, "pvalue"},
                                                  {Learner::pca, "pca"},
                                                  {Learner::all, "all"},
                                                  {Learner::lda, "lda"},
                                                  {Learner::svc, "svc"},
                                                  {Learner::trees, "trees"},
                                                  {Learner::cores_best, "cores-best"},
                                                  {Learner::best, "best"}}};

constexpr std::string_view cores_prefix = "cores-";

Reduction reduction_of(Learner learner) {
  if (learner == Learner::pca) return Reduction::pca;
  return learner == Learner::all ? Reduction::all : Reduction::pvalue;
}

// Folds of a learner without cores.
std::vector<Fold> build_folds(const FeatureMatrix& matrix, const TrainOptions& options) {
  return class_folds(matrix, options).folds;
}

// How few trials happen to fall to folds weighs more than what separates the learners: over eight
// seeds LDA on ranks got 0 to 7 of the 54 training strokes of fabricslide at 10 mm/s wrong. Groups
// are so few that every seed deals them alike.
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

Result<TrainedLearner::Machine> train_cores_of(const FeatureMatrix& rows, const CoreTask& task,
                                               TrainOptions options, const TaskTrainer& trainer) {
  options.reduction = task.reduction;
  const CoreTrainer train_core_with = [&](const TrainOptions& kind) {
    return trainer ? trainer(task) : train_cores(rows, kind);
  };
  auto model = train(rows, options, train_core_with);
  if (!model) return pass(model.error());
  return std::move(*model);
}

// `rows` as the learner sees them.
Result<TrainedLearner::Machine> train_simple(const FeatureMatrix& rows, const Classes& classes,
                                             Learner learner, const TrainOptions& options) {
  const std::size_t count = classes.labels.size();
  if (learner == Learner::lda) {
    auto lda = ShrinkageLda::fit(rows.values, classes.of_row, count);
    if (!lda) return pass(lda.error());
    return std::move(*lda);
  }
  if (learner == Learner::trees) {
    auto trees = fit_extra_trees(rows.values, classes.of_row, count, options);
    if (!trees) return pass(trees.error());
    return std::move(*trees);
  }
  auto svc =
      MultiClassSvc::fit(rows.values, classes.of_row, count, build_folds(rows, options), options);
  if (!svc) return pass(svc.error());
  return std::move(*svc);
}

Result<TrainedLearner> trained_on(FeatureMatrix rows, std::optional<std::size_t> fold,
                                  const Recipe& recipe, TrainOptions options,
                                  const TaskTrainer& trainer) {
  if (auto ok = check(rows); !ok) return pass(ok.error());
  if (auto ok = check_labels(rows.labels); !ok) return pass(ok.error());
  const Classes classes = find_classes(rows);
  if (auto ok = unless_stopped(options.stop); !ok) return pass(ok.error());
  FeatureView view = FeatureView::fit(recipe.view, rows.values);
  view.apply(rows.values);
  options.cap = recipe.cap;
  auto machine = is_cores(recipe.learner)
                     ? train_cores_of(rows, {reduction_of(recipe.learner), recipe.view, fold},
                                      options, trainer)
                     : train_simple(rows, classes, recipe.learner, options);
  if (!machine) return pass(machine.error());
  return TrainedLearner(classes.labels, rows.names, std::move(view), std::move(*machine));
}

// `fold`: whose training rows these are.
Result<TrainedLearner> train_on(FeatureMatrix rows, std::optional<std::size_t> fold,
                                const Recipe& recipe, const TrainOptions& options,
                                const TaskTrainer& trainer) {
  return within_memory(rows.size(),
                       [&] { return trained_on(std::move(rows), fold, recipe, options, trainer); });
}

std::vector<Recipe> candidates(Learner learner, std::size_t cap) {
  std::vector<Recipe> out;
  for (const View view : all_views()) {
    if (learner == Learner::best)
      for (const Learner simple : {Learner::lda, Learner::svc}) out.push_back({simple, cap, view});
    out.push_back({Learner::all, cap, view});
  }
  out.push_back({Learner::pca, cap});
  out.push_back({Learner::pvalue, cap});
  if (learner == Learner::best) out.push_back({Learner::trees, cap});
  return out;
}

// Rows held out that are got wrong.
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

Result<Choice> choose(const FeatureMatrix& matrix, const std::vector<Recipe>& recipes,
                      const TrainOptions& options, const TaskTrainer& trainer) {
  const std::vector<Fold> folds = folds_of_choice(matrix, options);
  Choice out;
  std::size_t least = std::numeric_limits<std::size_t>::max();  // errors of the one taken
  for (const Recipe& recipe : recipes) {
    RecipeScore score{recipe, 0, 0, rounds_of(matrix, options)};
    for (std::size_t f = 0; f < folds.size() && score.errors < least; ++f) {
      const auto trained =
          train_on(select_rows(matrix, folds[f].train), f, recipe, options, trainer);
      if (!trained) return pass(trained.error());
      const auto errors = errors_on(matrix, folds[f], *trained);
      if (!errors) return pass(errors.error());
      score.errors += *errors;
      score.tested += folds[f].validate.size();
    }
    if (score.errors < least) {
      least = score.errors;
      out.taken = out.scores.size();
    }
    out.scores.push_back(score);
  }
  return out;
}

}  // namespace

std::string_view to_string(Learner learner) {
  return name_in(learner_names, learner);
}

Result<Learner> learner_from(std::string_view text) {
  if (text.starts_with(cores_prefix)) {
    const auto cores = value_in(learner_names, text.substr(cores_prefix.size()));
    if (cores && is_cores(*cores)) return *cores;
  }
  return value_from(learner_names, text, "unknown learner",
                    "pvalue, pca, all, lda, svc, trees, cores-best or best");
}

std::vector<Learner> all_learners() {
  return values_of(learner_names);
}

std::string to_string(const Recipe& recipe) {
  const bool capped = recipe.learner == Learner::pvalue || recipe.learner == Learner::pca;
  return std::string(to_string(recipe.learner)) +
         (capped ? ", N " + std::to_string(recipe.cap) : "") +
         (recipe.view == View::plain ? "" : ", " + std::string(to_string(recipe.view)));
}

Learner TrainedLearner::kind() const {
  if (std::holds_alternative<ShrinkageLda>(machine_)) return Learner::lda;
  if (std::holds_alternative<MultiClassSvc>(machine_)) return Learner::svc;
  if (std::holds_alternative<TreeEnsemble>(machine_)) return Learner::trees;
  const Reduction reduction = cores()->reduction();
  if (reduction == Reduction::pca) return Learner::pca;
  return reduction == Reduction::all ? Learner::all : Learner::pvalue;
}

Result<std::vector<double>> TrainedLearner::prepared(std::span<const double> features) const {
  if (auto ok = check_length(features, features_.size(), "classify", another_sensor); !ok)
    return pass(ok.error());
  if (auto ok = check_features(features, features_); !ok) return pass(ok.error());
  std::vector<double> out(features.begin(), features.end());
  view_.apply(out);
  return out;
}

FeatureMatrix TrainedLearner::prepared(FeatureMatrix matrix) const {
  view_.apply(matrix.values);
  return matrix;
}

Result<std::size_t> TrainedLearner::classify(std::span<const double> features) const {
  const auto own = prepared(features);
  if (!own) return pass(own.error());
  if (const auto* lda = std::get_if<ShrinkageLda>(&machine_)) return lda->classify(*own);
  if (const auto* svc = std::get_if<MultiClassSvc>(&machine_)) return svc->classify(*own);
  if (const auto* trees = std::get_if<TreeEnsemble>(&machine_)) return trees->classify(*own);
  const auto vote = cores()->classify(*own);
  if (!vote) return pass(vote.error());
  return vote->winner;
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
                   .what = "a fold that does not exist",
                   .expected = "< " + std::to_string(folds.size()),
                   .got = std::to_string(*task.fold)});
    rows = select_rows(matrix, folds[*task.fold].train);
  }
  FeatureView::fit(task.view, rows.values).apply(rows.values);
  return train_cores(rows, options, first, stride);
}

Result<TrainedLearner> train_recipe(const FeatureMatrix& matrix, const Recipe& recipe,
                                    const TrainOptions& options) {
  return train_on(matrix, {}, recipe, options, {});
}

Result<ChosenLearner> train_learner(const FeatureMatrix& matrix, Learner learner,
                                    const TrainOptions& options, const TaskTrainer& trainer) {
  Recipe recipe{learner, options.cap};
  std::vector<RecipeScore> scores;
  if (learner == Learner::best || learner == Learner::cores_best) {
    if (auto ok = check(matrix); !ok) return pass(ok.error());
    auto choice = choose(matrix, candidates(learner, options.cap), options, trainer);
    if (!choice) return pass(choice.error());
    scores = std::move(choice->scores);
    recipe = scores[choice->taken].recipe;
  }
  auto trained = train_on(matrix, {}, recipe, options, trainer);
  if (!trained) return pass(trained.error());
  return ChosenLearner{std::move(*trained), recipe, std::move(scores)};
}

}  // namespace weft::classifier
