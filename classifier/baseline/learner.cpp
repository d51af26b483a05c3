#include "classifier/baseline/learner.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "classifier/baseline/class_folds.hpp"

namespace weft::classifier {
namespace {

constexpr std::array names = {
    std::pair{Learner::pvalue, "pvalue"}, std::pair{Learner::pca, "pca"},
    std::pair{Learner::all, "all"},       std::pair{Learner::lda, "lda"},
    std::pair{Learner::svc, "svc"},       std::pair{Learner::cores_best, "cores-best"},
    std::pair{Learner::best, "best"}};

constexpr std::string_view cores_prefix = "cores-";

Reduction reduction_of(Learner learner) {
  if (learner == Learner::pca) return Reduction::pca;
  return learner == Learner::all ? Reduction::all : Reduction::pvalue;
}

bool is_cores(Learner learner) {
  return learner == Learner::pvalue || learner == Learner::pca || learner == Learner::all;
}

double compress(double z) {
  return std::copysign(std::log1p(std::abs(z)), z);
}

std::vector<double> compress(const Scaler& scaler, std::span<const double> features) {
  std::vector<double> out(features.begin(), features.end());
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = compress(scaler.apply(k, out[k]));
  return out;
}

FeatureMatrix compress(const Scaler& scaler, FeatureMatrix matrix) {
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const std::vector<double> row = compress(scaler, matrix.values.row(r));
    std::copy(row.begin(), row.end(), matrix.values.row(r).begin());
  }
  return matrix;
}

Status check_rows(const FeatureMatrix& matrix, const Classes& classes) {
  if (auto ok = check(matrix); !ok) return ok;
  if (classes.labels.size() < 2)
    return fail(Errc::invalid_argument, "nothing to tell apart", "labels", "at least 2",
                std::to_string(classes.labels.size()));
  std::vector<std::size_t> rows(classes.labels.size());
  for (const std::size_t c : classes.of_row) ++rows[c];
  const auto lonely = std::find(rows.begin(), rows.end(), 1U);
  if (lonely == rows.end()) return {};
  return fail(Errc::invalid_argument, "too few training trials",
              "label " + classes.labels[static_cast<std::size_t>(lonely - rows.begin())],
              "at least 2", "1", "Record more trials of it or leave it out");
}

// Folds of a choice and of a learner without cores.
std::vector<Fold> folds_of(const FeatureMatrix& matrix, const TrainOptions& options) {
  return class_folds(classes_of(matrix).of_row, row_units(matrix, options.fold_unit), options.folds,
                     options.seed);
}

Result<TrainedLearner::Machine> train_cores_of(const FeatureMatrix& rows, const CoreTask& task,
                                               TrainOptions options, const TaskTrainer& trainer) {
  options.reduction = task.reduction;
  const CoreTrainer ask = [&](const TrainOptions& kind) {
    return trainer ? trainer(task) : train_cores(rows, kind);
  };
  auto model = train(rows, options, ask);
  if (!model) return pass(model.error());
  return std::move(*model);
}

// `rows` compressed already.
Result<TrainedLearner::Machine> train_simple(const FeatureMatrix& rows, const Classes& classes,
                                             Learner learner, const TrainOptions& options) {
  const std::size_t count = classes.labels.size();
  if (learner == Learner::lda) {
    auto lda = ShrinkageLda::fit(rows.values, classes.of_row, count);
    if (!lda) return pass(lda.error());
    return std::move(*lda);
  }
  auto svc =
      MultiClassSvc::fit(rows.values, classes.of_row, count, folds_of(rows, options), options);
  if (!svc) return pass(svc.error());
  return std::move(*svc);
}

// `fold`: whose training rows these are.
Result<TrainedLearner> train_on(FeatureMatrix rows, std::optional<std::size_t> fold,
                                const Recipe& recipe, TrainOptions options,
                                const TaskTrainer& trainer) {
  const Classes classes = classes_of(rows);
  if (auto ok = check_rows(rows, classes); !ok) return pass(ok.error());
  std::optional<Scaler> compression;
  if (recipe.compressed) {
    compression = fit_scaler(rows.values);
    rows = compress(*compression, std::move(rows));
  }
  options.cap = recipe.cap;
  auto machine = is_cores(recipe.learner)
                     ? train_cores_of(rows, {reduction_of(recipe.learner), recipe.compressed, fold},
                                      options, trainer)
                     : train_simple(rows, classes, recipe.learner, options);
  if (!machine) return pass(machine.error());
  return TrainedLearner(classes.labels, rows.names, std::move(compression), std::move(*machine));
}

std::vector<Recipe> candidates(Learner learner, std::size_t cap) {
  std::vector<Recipe> out;
  for (const bool compressed : {false, true}) {
    if (learner == Learner::best)
      for (const Learner simple : {Learner::lda, Learner::svc})
        out.push_back({simple, cap, compressed});
    out.push_back({Learner::all, cap, compressed});
  }
  out.push_back({Learner::pca, cap, false});
  out.push_back({Learner::pvalue, cap, false});
  return out;
}

Result<std::size_t> errors_in(const FeatureMatrix& matrix, const Fold& fold,
                              const TrainedLearner& trained) {
  std::size_t errors = 0;
  for (const std::size_t r : fold.validate) {
    const auto winner = trained.classify(matrix.values.row(r));
    if (!winner) return pass(winner.error(), matrix.files[r]);
    errors += trained.labels()[*winner] != matrix.labels[r] ? 1 : 0;
  }
  return errors;
}

Result<std::vector<RecipeScore>> score_all(const FeatureMatrix& matrix,
                                           const std::vector<Recipe>& recipes,
                                           const TrainOptions& options,
                                           const TaskTrainer& trainer) {
  const std::vector<Fold> folds = folds_of(matrix, options);
  std::vector<RecipeScore> out;
  std::size_t least = matrix.size() + 1;  // of those that are through
  for (const Recipe& recipe : recipes) {
    RecipeScore score{recipe, 0, 0};
    for (std::size_t f = 0; f < folds.size() && score.errors < least; ++f) {
      const auto trained = train_on(take_rows(matrix, folds[f].train), f, recipe, options, trainer);
      if (!trained) return pass(trained.error());
      const auto errors = errors_in(matrix, folds[f], *trained);
      if (!errors) return pass(errors.error());
      score.errors += *errors;
      score.tested += folds[f].validate.size();
    }
    least = std::min(least, score.errors);
    out.push_back(score);
  }
  return out;
}

// Breiman's rule of one standard error: a count of e errors is uncertain by about sqrt(e), and what
// is not clearly worse and simpler is taken. Candidates come in order of simplicity; one that was
// dropped is behind one that is as good and through.
Recipe first_within_one_deviation(const std::vector<RecipeScore>& scores) {
  std::size_t least = scores.front().errors;
  for (const RecipeScore& score : scores) least = std::min(least, score.errors);
  const double bound = static_cast<double>(least) + std::sqrt(static_cast<double>(least));
  return std::find_if(
             scores.begin(), scores.end(),
             [&](const RecipeScore& score) { return static_cast<double>(score.errors) <= bound; })
      ->recipe;
}

}  // namespace

std::string_view to_string(Learner learner) {
  for (const auto& [value, name] : names)
    if (value == learner) return name;
  return "?";
}

Result<Learner> learner_from(std::string_view text) {
  const std::string_view plain =
      text.substr(0, cores_prefix.size()) == cores_prefix && text != "cores-best"
          ? text.substr(cores_prefix.size())
          : text;
  for (const auto& [value, name] : names)
    if (plain == name && (plain == text || is_cores(value))) return value;
  return fail(Errc::invalid_argument, "unknown learner", {},
              "pvalue, pca, all, lda, svc, cores-best or best", std::string(text));
}

std::vector<Learner> all_learners() {
  std::vector<Learner> out;
  for (const auto& entry : names) out.push_back(entry.first);
  return out;
}

std::string to_string(const Recipe& recipe) {
  const bool capped = recipe.learner == Learner::pvalue || recipe.learner == Learner::pca;
  return std::string(to_string(recipe.learner)) +
         (capped ? ", N " + std::to_string(recipe.cap) : "") +
         (recipe.compressed ? ", compressed" : "");
}

Learner TrainedLearner::kind() const {
  if (std::holds_alternative<ShrinkageLda>(machine_)) return Learner::lda;
  if (std::holds_alternative<MultiClassSvc>(machine_)) return Learner::svc;
  const Reduction reduction = cores()->reduction();
  if (reduction == Reduction::pca) return Learner::pca;
  return reduction == Reduction::all ? Learner::all : Learner::pvalue;
}

Result<std::vector<double>> TrainedLearner::prepared(std::span<const double> features) const {
  if (features.size() != features_.size())
    return fail(Errc::invalid_argument, "wrong number of features", "classify",
                std::to_string(features_.size()), std::to_string(features.size()),
                "Was the model trained for another sensor?");
  for (std::size_t k = 0; k < features.size(); ++k)
    if (!std::isfinite(features[k]))
      return fail(Errc::invalid_argument, "feature is not finite", features_[k], "a finite number",
                  std::to_string(features[k]));
  if (compression_) return compress(*compression_, features);
  return std::vector<double>(features.begin(), features.end());
}

FeatureMatrix TrainedLearner::prepared(FeatureMatrix matrix) const {
  return compression_ ? compress(*compression_, std::move(matrix)) : std::move(matrix);
}

Result<std::size_t> TrainedLearner::classify(std::span<const double> features) const {
  const auto own = prepared(features);
  if (!own) return pass(own.error());
  if (const auto* lda = std::get_if<ShrinkageLda>(&machine_)) return lda->classify(*own);
  if (const auto* svc = std::get_if<MultiClassSvc>(&machine_)) return svc->classify(*own);
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
    const std::vector<Fold> folds = folds_of(matrix, options);
    if (*task.fold >= folds.size())
      return fail(Errc::range, "a fold that does not exist", "train_task",
                  "< " + std::to_string(folds.size()), std::to_string(*task.fold));
    rows = take_rows(matrix, folds[*task.fold].train);
  }
  if (task.compressed) {
    const Scaler scaler = fit_scaler(rows.values);
    rows = compress(scaler, std::move(rows));
  }
  return train_cores(rows, options, first, stride);
}

Result<TrainedLearner> train_recipe(const FeatureMatrix& matrix, const Recipe& recipe,
                                    const TrainOptions& options) {
  return train_on(matrix, {}, recipe, options, {});
}

Result<ChosenLearner> train_learner(const FeatureMatrix& matrix, Learner learner,
                                    const TrainOptions& options, const TaskTrainer& trainer) {
  Recipe recipe{learner, options.cap, false};
  std::vector<RecipeScore> scores;
  if (learner == Learner::best || learner == Learner::cores_best) {
    if (auto ok = check(matrix); !ok) return pass(ok.error());
    auto all = score_all(matrix, candidates(learner, options.cap), options, trainer);
    if (!all) return pass(all.error());
    scores = std::move(*all);
    recipe = first_within_one_deviation(scores);
  }
  auto trained = train_on(matrix, {}, recipe, options, trainer);
  if (!trained) return pass(trained.error());
  return ChosenLearner{std::move(*trained), recipe, std::move(scores)};
}

}  // namespace weft::classifier
