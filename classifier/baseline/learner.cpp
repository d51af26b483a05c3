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
  if (classes.labels.size() >= 2) return {};
  return fail(Errc::invalid_argument, "nothing to tell apart", "labels", "at least 2",
              std::to_string(classes.labels.size()));
}

Result<TrainedLearner::Machine> train_machine(const FeatureMatrix& matrix, const Classes& classes,
                                              const Recipe& recipe, TrainOptions options) {
  if (is_cores(recipe.learner)) {
    options.reduction = reduction_of(recipe.learner);
    options.cap = recipe.cap;
    auto model = train(matrix, options);
    if (!model) return pass(model.error());
    return std::move(*model);
  }
  if (recipe.learner == Learner::lda) {
    auto lda = ShrinkageLda::fit(matrix.values, classes.of_row, classes.labels.size());
    if (!lda) return pass(lda.error());
    return std::move(*lda);
  }
  const auto folds = class_folds(classes.of_row, row_units(matrix, options.fold_unit),
                                 options.folds, options.seed);
  auto svc =
      MultiClassSvc::fit(matrix.values, classes.of_row, classes.labels.size(), folds, options);
  if (!svc) return pass(svc.error());
  return std::move(*svc);
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

Result<std::size_t> errors_in(const FeatureMatrix& matrix, const Fold& fold, const Recipe& recipe,
                              const TrainOptions& options) {
  const auto trained = train_recipe(take_rows(matrix, fold.train), recipe, options);
  if (!trained) return pass(trained.error());
  std::size_t errors = 0;
  for (const std::size_t r : fold.validate) {
    const auto winner = trained->classify(matrix.values.row(r));
    if (!winner) return pass(winner.error(), matrix.files[r]);
    errors += trained->labels()[*winner] != matrix.labels[r] ? 1 : 0;
  }
  return errors;
}

Result<std::vector<RecipeScore>> score_all(const FeatureMatrix& matrix,
                                           const std::vector<Recipe>& recipes,
                                           const TrainOptions& options) {
  const std::vector<Fold> folds = class_folds(
      classes_of(matrix).of_row, row_units(matrix, options.fold_unit), options.folds, options.seed);
  std::vector<RecipeScore> out;
  std::size_t least = matrix.size() + 1;  // of those that are through
  for (const Recipe& recipe : recipes) {
    RecipeScore score{recipe, 0, 0};
    for (const Fold& fold : folds) {
      if (score.errors >= least) break;
      const auto errors = errors_in(matrix, fold, recipe, options);
      if (!errors) return pass(errors.error());
      score.errors += *errors;
      score.tested += fold.validate.size();
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

Result<std::size_t> TrainedLearner::classify(std::span<const double> features) const {
  std::vector<double> compressed;
  if (compression_ && features.size() == compression_->mean.size()) {
    compressed = compress(*compression_, features);
    features = compressed;
  }
  if (const auto* cores = std::get_if<FabricModel>(&machine_)) {
    const auto vote = cores->classify(features);
    if (!vote) return pass(vote.error());
    return vote->winner;
  }
  if (const auto* lda = std::get_if<ShrinkageLda>(&machine_)) return lda->classify(features);
  return std::get<MultiClassSvc>(machine_).classify(features);
}

Result<TrainedLearner> train_recipe(const FeatureMatrix& matrix, const Recipe& recipe,
                                    const TrainOptions& options) {
  const Classes classes = classes_of(matrix);
  if (auto ok = check_rows(matrix, classes); !ok) return pass(ok.error());
  std::optional<Scaler> compression;
  if (recipe.compressed) compression = fit_scaler(matrix.values);
  auto machine = compression
                     ? train_machine(compress(*compression, matrix), classes, recipe, options)
                     : train_machine(matrix, classes, recipe, options);
  if (!machine) return pass(machine.error());
  return TrainedLearner(classes.labels, std::move(compression), std::move(*machine));
}

Result<ChosenLearner> train_learner(const FeatureMatrix& matrix, Learner learner,
                                    const TrainOptions& options) {
  Recipe recipe{learner, options.cap, false};
  std::vector<RecipeScore> scores;
  if (learner == Learner::best || learner == Learner::cores_best) {
    if (auto ok = check(matrix); !ok) return pass(ok.error());
    auto all = score_all(matrix, candidates(learner, options.cap), options);
    if (!all) return pass(all.error());
    scores = std::move(*all);
    recipe = first_within_one_deviation(scores);
  }
  auto trained = train_recipe(matrix, recipe, options);
  if (!trained) return pass(trained.error());
  return ChosenLearner{std::move(*trained), recipe, std::move(scores)};
}

}  // namespace weft::classifier
