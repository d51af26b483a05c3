#include "classifier/imprint/experiments.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "classifier/baseline/learner.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/imprint/linear_rule.hpp"

namespace weft::classifier::imprint {
namespace {

using Rounds = std::vector<std::vector<std::size_t>>;

Rounds rows_by(const Classes& classes) {
  Rounds out(classes.names.size());
  for (std::size_t r = 0; r < classes.of_row.size(); ++r) out[classes.of_row[r]].push_back(r);
  return out;
}

// The k-th of each list together, for all k that every list has.
Rounds side_by_side(const std::vector<Rounds>& lists) {
  std::size_t least = lists.empty() ? 0 : lists.front().size();
  for (const Rounds& list : lists) least = std::min(least, list.size());
  Rounds out(least);
  for (std::size_t k = 0; k < least; ++k)
    for (const Rounds& list : lists) out[k].insert(out[k].end(), list[k].begin(), list[k].end());
  return out;
}

// Says of a feature vector of what class it is: its name.
using DecisionRule = std::function<Result<std::string>(std::span<const double>)>;

struct Trained {
  DecisionRule answer;
  std::size_t rounds = 0;
  bool converged = true;
};

DecisionRule answer_of(LinearRule rule, std::vector<std::string> names) {
  return [rule = std::move(rule),
          names = std::move(names)](std::span<const double> features) -> Result<std::string> {
    const auto predicted = rule.classify(features);
    if (!predicted) return pass(predicted.error());
    return names[*predicted];
  };
}

Learner learner_of(Rule rule) {
  switch (rule) {
    case Rule::cores:
      return Learner::pvalue;
    case Rule::cores_all:
      return Learner::all;
    case Rule::lda:
      return Learner::lda;
    default:
      return Learner::svc;
  }
}

Result<Trained> train_learner_rule(const FeatureMatrix& matrix, Rule rule) {
  auto trained = train_recipe(matrix, {.learner = learner_of(rule)}, {});
  if (!trained) return pass(trained.error());
  return Trained{[own = std::move(*trained)](std::span<const double> f) -> Result<std::string> {
                   const auto predicted = own.classify(f);
                   if (!predicted) return pass(predicted.error());
                   return own.labels()[*predicted];
                 },
                 0, true};
}

Result<Trained> train_rule(const FeatureMatrix& matrix, Rule rule) {
  Classes classes = find_classes(matrix.labels);
  if (rule == Rule::kesler || rule == Rule::kesler_zscore) {
    KeslerOptions options;
    options.scaling = rule == Rule::kesler ? FeatureScaling::none : FeatureScaling::zscore;
    auto out = train_kesler(matrix.values, classes.of_row, classes.names.size(), options);
    if (!out) return pass(out.error());
    return Trained{answer_of(std::move(out->rule), std::move(classes.names)), out->rounds,
                   out->converged};
  }
  if (rule != Rule::least_squares) return train_learner_rule(matrix, rule);
  auto out = train_least_squares(matrix.values, classes.of_row, classes.names.size(),
                                 FeatureScaling::zscore);
  if (!out) return pass(out.error());
  return Trained{answer_of(std::move(*out), std::move(classes.names)), 0, true};
}

std::vector<std::size_t> others(std::size_t rows, const std::vector<std::size_t>& aside) {
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < rows; ++r)
    if (std::find(aside.begin(), aside.end(), r) == aside.end()) out.push_back(r);
  return out;
}

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double no_distance = 1e-7;
constexpr double least_product = 1e-10;  // of unit vectors: far above rounding
constexpr double least_weight = 1e-12;

// A row of unit length, once with every wrong class: +row in its own class's block of weights, -row
// in the wrong one's, divided by sqrt 2.
struct Corner {
  Index row;
  Index own, wrong;
};

class Hull {
 public:
  Hull(const Matrix& rows, std::span<const std::size_t> of_row, std::size_t classes)
      : rows_(static_cast<Index>(rows.rows()), static_cast<Index>(rows.cols())) {
    for (Index r = 0; r < rows_.rows(); ++r) {
      const auto from = rows.row(static_cast<std::size_t>(r));
      rows_.row(r) = Eigen::Map<const Eigen::RowVectorXd>(from.data(), rows_.cols()).normalized();
      const auto own = static_cast<Index>(of_row[static_cast<std::size_t>(r)]);
      for (Index wrong = 0; wrong < static_cast<Index>(classes); ++wrong)
        if (wrong != own) corners_.push_back({r, own, wrong});
    }
    products_ = rows_ * rows_.transpose();
    weight_ = MatrixXd::Zero(static_cast<Index>(classes), rows_.cols());
  }

  [[nodiscard]] double product(const Corner& a, const Corner& b) const {
    const double blocks = (a.own == b.own ? 1.0 : 0.0) - (a.own == b.wrong ? 1.0 : 0.0) -
                          (a.wrong == b.own ? 1.0 : 0.0) + (a.wrong == b.wrong ? 1.0 : 0.0);
    return 0.5 * blocks * products_(a.row, b.row);
  }

  /// The corner with the least product with the point, and that product.
  std::pair<std::size_t, double> least() {
    const MatrixXd scores = rows_ * weight_.transpose();
    std::pair<std::size_t, double> out{0, std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Corner& c = corners_[i];
      const double value = (scores(c.row, c.own) - scores(c.row, c.wrong)) / std::sqrt(2.0);
      if (value < out.second) out = {i, value};
    }
    return out;
  }

  /// The point as a combination of corners.
  void place(const std::vector<std::size_t>& corral, const VectorXd& share) {
    weight_.setZero();
    for (std::size_t i = 0; i < corral.size(); ++i) {
      const Corner& c = corners_[corral[i]];
      const Eigen::RowVectorXd part =
          share(static_cast<Index>(i)) / std::sqrt(2.0) * rows_.row(c.row);
      weight_.row(c.own) += part;
      weight_.row(c.wrong) -= part;
    }
  }

  [[nodiscard]] double squared_length() const { return weight_.squaredNorm(); }
  [[nodiscard]] const std::vector<Corner>& corners() const { return corners_; }

 private:
  MatrixXd rows_, products_, weight_;
  std::vector<Corner> corners_;
};

// Shares, summing to 1, of the point nearest to the origin in the plane through the corral.
VectorXd nearest_in_plane(const Hull& hull, const std::vector<std::size_t>& corral) {
  const auto n = static_cast<Index>(corral.size());
  MatrixXd system(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j <= i; ++j)
      system(i, j) = system(j, i) =
          1.0 + hull.product(hull.corners()[corral[static_cast<std::size_t>(i)]],
                             hull.corners()[corral[static_cast<std::size_t>(j)]]);
  const VectorXd solution = system.ldlt().solve(VectorXd::Ones(n));
  return solution / solution.sum();
}

// Wolfe's minor cycle: towards the plane's nearest point until a share would turn negative; that
// corner is dropped.
void shrink(const Hull& hull, std::vector<std::size_t>& corral, VectorXd& share) {
  for (;;) {
    const VectorXd goal = nearest_in_plane(hull, corral);
    if (goal.minCoeff() > least_weight || corral.size() == 1) {
      share = goal;
      return;
    }
    double step = 1.0;
    for (Index i = 0; i < goal.size(); ++i)
      if (goal(i) <= least_weight && share(i) > goal(i))
        step = std::min(step, share(i) / (share(i) - goal(i)));
    share = (1.0 - step) * share + step * goal;
    std::vector<std::size_t> retained;
    std::vector<double> retained_share;
    for (Index i = 0; i < share.size(); ++i)
      if (share(i) > least_weight) {
        retained.push_back(corral[static_cast<std::size_t>(i)]);
        retained_share.push_back(share(i));
      }
    if (retained.size() == corral.size() || retained.empty())
      return;  // rounding: nothing left to drop
    corral = std::move(retained);
    share = Eigen::Map<const VectorXd>(retained_share.data(),
                                       static_cast<Index>(retained_share.size()));
    share /= share.sum();
  }
}

SeparabilityOutcome walk(Hull& hull, std::size_t most_steps) {
  std::vector<std::size_t> corral{0};
  VectorXd share = VectorXd::Ones(1);
  SeparabilityOutcome out;
  for (out.steps = 1; out.steps <= most_steps; ++out.steps) {
    hull.place(corral, share);
    const double length = std::sqrt(hull.squared_length());
    if (length <= no_distance) {
      out.verdict = Separability::not_separable;
      return out;
    }
    const auto [corner, product] = hull.least();
    if (product > least_product * length) {
      out.verdict = Separability::separable;
      out.margin = product / length;
      return out;
    }
    if (std::find(corral.begin(), corral.end(), corner) != corral.end()) return out;  // rounding
    corral.push_back(corner);
    share.conservativeResize(share.size() + 1);
    share(share.size() - 1) = 0.0;
    shrink(hull, corral, share);
  }
  return out;
}

}  // namespace

std::string_view to_string(Experiment experiment) {
  constexpr std::array<std::string_view, 4> names{"1/N", "2/N", "1/CLASS", "2/CLASS"};
  return names.at(static_cast<std::size_t>(experiment));
}

std::string_view to_string(Rule rule) {
  constexpr std::array<std::string_view, 7> names{
      "kesler", "kesler-zscore", "least-squares", "cores", "cores-all", "lda", "svc"};
  return names.at(static_cast<std::size_t>(rule));
}

Result<Rounds> test_rounds(Experiment experiment, std::span<const std::string> labels,
                           std::span<const std::string> objects) {
  if (labels.size() != objects.size())
    return fail({.code = Errc::invalid_argument,
                 .where = "imprints",
                 .what = "every imprint needs a class and an object",
                 .expected = std::to_string(labels.size()),
                 .got = std::to_string(objects.size())});
  const Rounds of_class = rows_by(find_classes(labels)), of_object = rows_by(find_classes(objects));
  for (const auto& rows : of_object)
    for (const std::size_t r : rows)
      if (labels[r] != labels[rows.front()])
        return fail({.code = Errc::invalid_argument,
                     .where = objects[r],
                     .what = "an object is of two classes",
                     .expected = labels[rows.front()],
                     .got = labels[r]});
  const auto singly = [](const std::vector<std::size_t>& rows) {
    Rounds out;
    for (const std::size_t r : rows) out.push_back({r});
    return out;
  };
  std::vector<Rounds> lists;
  switch (experiment) {
    case Experiment::one_of_all: {
      std::vector<std::size_t> all(labels.size());
      for (std::size_t r = 0; r < all.size(); ++r) all[r] = r;
      return singly(all);
    }
    case Experiment::object_of_all:
      return of_object;
    case Experiment::one_of_class:
      for (const auto& rows : of_class) lists.push_back(singly(rows));
      break;
    case Experiment::object_of_class:
      for (const auto& rows : of_class) {
        lists.emplace_back();
        for (const auto& object : of_object)
          if (labels[object.front()] == labels[rows.front()]) lists.back().push_back(object);
      }
      break;
  }
  return side_by_side(lists);
}

Status check_rounds(const Rounds& rounds, std::span<const std::string> labels) {
  const Rounds of_class = rows_by(find_classes(labels));
  for (const auto& aside : rounds)
    for (const auto& rows : of_class) {
      const auto left = std::ranges::count_if(
          rows, [&](std::size_t r) { return std::ranges::find(aside, r) == aside.end(); });
      if (left == 0)
        return fail({.code = Errc::invalid_argument,
                     .where = labels[rows.front()],
                     .what = "a round leaves the class nothing to learn from",
                     .expected = "an imprint that is not set aside",
                     .hint = "Leave the class out, or press more of its objects"});
    }
  return {};
}

Result<ExperimentOutcome> run_experiment(const FeatureMatrix& matrix, Experiment experiment,
                                         Rule rule) {
  const auto rounds = test_rounds(experiment, matrix.labels, matrix.groups);
  if (!rounds) return pass(rounds.error());
  if (auto ok = check_rounds(*rounds, matrix.labels); !ok)
    return pass(ok.error(), to_string(experiment));
  ExperimentOutcome out;
  for (const auto& aside : *rounds) {
    const auto trained = train_rule(select_rows(matrix, others(matrix.size(), aside)), rule);
    if (!trained) return pass(trained.error(), to_string(experiment));
    out.most_rounds = std::max(out.most_rounds, trained->rounds);
    out.converged = trained->converged;
    if (!out.converged) break;
    for (const std::size_t r : aside) {
      const auto predicted = trained->answer(matrix.values.row(r));
      if (!predicted) return pass(predicted.error(), matrix.files[r]);
      ++out.total;
      if (*predicted == matrix.labels[r])
        ++out.correct;
      else
        out.wrong.push_back(r);
    }
  }
  return out;
}

std::string_view to_string(Separability verdict) {
  switch (verdict) {
    case Separability::separable:
      return "separable";
    case Separability::not_separable:
      return "not separable";
    case Separability::undecided:
      break;
  }
  return "undecided";
}

Result<SeparabilityOutcome> separability(const Matrix& rows, std::span<const std::size_t> of_row,
                                         std::size_t classes, std::size_t most_steps) {
  if (auto ok = check_training(rows, of_row, classes); !ok) return pass(ok.error(), "separability");
  Hull hull(with_ones(scaled(fit_scaler(rows), rows)), of_row, classes);
  return walk(hull, most_steps);
}

}  // namespace weft::classifier::imprint
