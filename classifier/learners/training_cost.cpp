#include "classifier/learners/training_cost.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "classifier/learners/tree_ensemble.hpp"

namespace weft::classifier {
namespace {

constexpr double cores = 2.0;  // of the reference machine

// Only products and roots: they round equally everywhere; std::pow() does not.
struct Size {
  double rows, columns, classes;

  [[nodiscard]] double cells() const { return rows * columns; }
  // Cost of a product with its own transpose on the shorter side.
  [[nodiscard]] double gram() const { return cells() * std::min(rows, columns); }
  [[nodiscard]] double squared() const { return rows * rows; }
};

// Seconds for the predictions of cores with all features, for one fold.
double answers(const Size& n) {
  return 1.5e-10 * n.squared() * n.columns * n.classes;
}

// Seconds for extremely randomised trees and forests, which grow until their leaves are pure.
double trees_cost(const Size& n, double trees, double each) {
  return each * trees * n.rows * std::sqrt(n.columns) + 2e-10 * n.cells() * n.classes;
}

// Seconds of one core for one training and the predictions on its fold. The separation of the
// classes counts too, most for p-value cores, but is not known before.
double fit_cost(Learner learner, const Size& n, const TrainOptions& options) {
  switch (learner) {
    case Learner::lda:
    case Learner::least_squares:
    case Learner::ridge:
      return 2e-10 * n.gram() + 4e-10 * n.cells() * n.classes;
    case Learner::svc:
      return n.squared() * (3e-7 + 7e-10 * n.columns) + 1e-5 * n.rows * n.classes;
    case Learner::all:
      return n.squared() * (1e-7 + 5e-10 * n.columns) + 7e-6 * n.rows * n.classes + answers(n);
    case Learner::pca:
      return n.squared() * (4e-7 + 4e-9 * n.columns) + 2e-5 * n.rows * n.classes + answers(n);
    case Learner::pvalue:
      return n.squared() * (1.5e-6 + 3e-10 * n.columns) + 1.5e-5 * n.rows * n.classes;
    case Learner::trees:
      return trees_cost(n, static_cast<double>(extra_trees), 6e-8);
    case Learner::forest:
      return trees_cost(n, static_cast<double>(options.trees), 1.8e-7);
    case Learner::tree:
      return trees_cost(n, n.columns, 1.8e-7);
    case Learner::nb:
      return 2e-10 * n.cells() * n.classes;
    case Learner::knn:
      return 5e-11 * n.squared() * n.columns + 2e-10 * n.cells() * n.classes;
    case Learner::svm:
      return n.squared() * (7e-9 + 7e-10 * n.columns) + 2e-10 * n.cells() * n.classes;
    case Learner::logistic:
      return n.rows * n.classes * (1.2e-6 + 5e-8 * n.columns);
    default:  // perceptrons, networks and boosters: no choice has them, so they were not measured
      return 1e-5 * n.cells() * n.classes;
  }
}

std::string seconds_text(double seconds) {
  char out[32];
  std::snprintf(out, sizeof out, seconds < 10.0 ? "%.1f s" : "%.0f s", seconds);
  return out;
}

}  // namespace

double training_cost(const Recipe& recipe, const TrainingShape& shape,
                     const TrainOptions& options) {
  const std::size_t columns = recipe.columns.empty() ? shape.columns : recipe.columns.size();
  Size n{static_cast<double>(shape.rows), static_cast<double>(columns),
         static_cast<double>(shape.classes)};
  double view = 2e-8 * n.cells();  // copied, scaled or ranked
  if (recipe.view == View::components && recipe.components > 0) {
    view += 4e-10 * n.gram();
    n.columns = std::min(n.columns, static_cast<double>(recipe.components));
  }
  return static_cast<double>(shape.trainings) * (view + fit_cost(recipe.learner, n, options)) /
         cores;
}

std::vector<RecipeScore> within_budget(std::span<const Recipe> candidates,
                                       const TrainingShape& shape, const TrainOptions& options) {
  const bool limited = options.budget > 0.0 && std::isfinite(options.budget);
  double sum = 0.0;
  std::vector<RecipeScore> out;
  for (const Recipe& recipe : candidates) {
    RecipeScore score{recipe};
    score.cost_s = training_cost(recipe, shape, options);
    const bool first_fits = out.empty() || !out.front().skipped();
    const bool fits = first_fits && sum + score.cost_s <= options.budget;
    if (limited && !fits) score.budget_s = options.budget;
    if (!score.skipped()) sum += score.cost_s;
    out.push_back(std::move(score));
  }
  return out;
}

std::string format_skipped(std::span<const RecipeScore> scores) {
  std::string out;
  double budget = 0.0;
  for (const RecipeScore& score : scores) {
    if (!score.skipped()) continue;
    budget = score.budget_s;
    out += (out.empty() ? "not tried: " : "; ") + to_string(score.recipe) + ", estimated " +
           seconds_text(score.cost_s);
  }
  return out.empty() ? out : out + " (--time-budget allows " + seconds_text(budget) + " in total)";
}

}  // namespace weft::classifier
