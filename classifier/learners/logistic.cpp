#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>

#include "classifier/fabric/model_text.hpp"
#include "classifier/learners/learners.hpp"

namespace weft::classifier {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Weights = Eigen::Map<const Eigen::MatrixXd>;

Eigen::Index index(std::size_t n) {
  return static_cast<Eigen::Index>(n);
}

// A column of ones after the features is for the intercepts.
RowMatrix with_intercept(const Matrix& rows) {
  RowMatrix out(index(rows.rows()), index(rows.cols() + 1));
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    for (std::size_t f = 0; f < rows.cols(); ++f) out(index(r), index(f)) = rows(r, f);
    out(index(r), index(rows.cols())) = 1.0;
  }
  return out;
}

// Cross entropy and penalty of weights [features + 1 x classes]. The scores are replaced by the
// probabilities minus the truth.
double loss(const RowMatrix& rows, const TrainingSet& training, const std::vector<double>& x,
            std::vector<double>& slope) {
  const Weights weight(x.data(), rows.cols(), index(training.classes()));
  RowMatrix score = rows * weight;
  double sum = 0.0;
  for (Eigen::Index r = 0; r < score.rows(); ++r) {
    const auto truth = index(training.of_row()[static_cast<std::size_t>(r)]);
    const double most = score.row(r).maxCoeff(), own = score(r, truth);
    score.row(r) = (score.row(r).array() - most).exp();
    const double whole = score.row(r).sum();
    score.row(r) /= whole;
    sum += std::log(whole) + most - own;
    score(r, truth) -= 1.0;
  }
  Eigen::Map<Eigen::MatrixXd> out(slope.data(), weight.rows(), weight.cols());
  out.noalias() = rows.transpose() * score;
  const auto penalised = weight.topRows(weight.rows() - 1);
  out.topRows(weight.rows() - 1) += penalised;
  return sum + 0.5 * penalised.squaredNorm();
}

class Logistic final : public Predictor {
 public:
  explicit Logistic(const TrainingSet& training) {
    const RowMatrix rows = with_intercept(training.rows());
    const auto x = minimum(
        [&](const std::vector<double>& at, std::vector<double>& slope) {
          return loss(rows, training, at, slope);
        },
        std::vector<double>(static_cast<std::size_t>(rows.cols()) * training.classes(), 0.0));
    weight_ = Weights(x.data(), rows.cols(), index(training.classes()));
  }

  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override {
    const Eigen::Index n = index(features.size());
    const Eigen::Map<const Eigen::VectorXd> own(features.data(), n);
    const Eigen::VectorXd score = weight_.topRows(n).transpose() * own + weight_.row(n).transpose();
    return scores_of({score.begin(), score.end()}, "logistic regression");
  }

  void write(LineWriter& out) const override {
    for (Eigen::Index c = 0; c < weight_.cols(); ++c)
      out.numbers("weight", {weight_.col(c).data(), static_cast<std::size_t>(weight_.rows())});
  }
  Logistic(LineReader& in, std::size_t features, std::size_t classes) {
    const Matrix rows = read_rows(in, "weight", classes, features + 1);
    if (in.ok()) weight_ = Weights(rows.data().data(), index(features + 1), index(classes));
  }

 private:
  Eigen::MatrixXd weight_;  // [features + 1 x classes]
};

using Vector = std::vector<double>;

double dot(const Vector& a, const Vector& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// a + factor b
Vector plus(const Vector& a, double factor, const Vector& b) {
  Vector out(a);
  for (std::size_t i = 0; i < a.size(); ++i) out[i] += factor * b[i];
  return out;
}

struct Step {
  Vector moved, turned;  // moved: change of the point; turned: change of the slopes
  double curvature = 0.0;
};

// Minus the slopes times the inverse curvature estimated from the last steps.
Vector downhill(const Vector& slope, const std::deque<Step>& steps) {
  Vector out(slope);
  Vector factor;
  for (auto s = steps.rbegin(); s != steps.rend(); ++s) {
    factor.push_back(dot(s->moved, out) / s->curvature);
    out = plus(out, -factor.back(), s->turned);
  }
  if (!steps.empty()) {
    const double scale = steps.back().curvature / dot(steps.back().turned, steps.back().turned);
    for (double& v : out) v *= scale;
  }
  for (const Step& s : steps) {
    out = plus(out, factor.back() - dot(s.turned, out) / s.curvature, s.moved);
    factor.pop_back();
  }
  for (double& v : out) v = -v;
  return out;
}

double largest_magnitude(const Vector& v) {
  double out = 0.0;
  for (const double x : v) out = std::max(out, std::abs(x));
  return out;
}

}  // namespace

Result<PredictorPtr> fit_logistic(const TrainingSet& training, const TrainOptions& /*options*/) {
  return std::make_unique<Logistic>(training);
}

PredictorPtr read_logistic(LineReader& in, std::size_t features, std::size_t classes) {
  auto out = std::make_unique<Logistic>(in, features, classes);
  if (!in.ok()) return nullptr;
  return out;
}

std::vector<double> minimum(const Slopes& function, std::vector<double> x,
                            const MinimumOptions& options) {
  constexpr std::size_t remembered = 10;
  constexpr double enough = 1e-4;  // share of the decrease that the slope predicts
  constexpr int most_halvings = 50;
  Vector slope(x.size());
  double value = function(x, slope);
  std::deque<Step> steps;
  for (std::size_t i = 0; i < options.most_steps; ++i) {
    if (largest_magnitude(slope) <= options.largest_slope) break;
    const Vector direction = downhill(slope, steps);
    const double promised = dot(direction, slope);
    double length = steps.empty() ? std::min(1.0, 1.0 / largest_magnitude(slope)) : 1.0;
    Vector next, next_slope(x.size());
    double next_value = value;
    bool fell = false;
    for (int h = 0; h < most_halvings && !fell; ++h, length *= 0.5) {
      next = plus(x, length, direction);
      next_value = function(next, next_slope);
      fell = next_value <= value + enough * length * promised;
    }
    if (!fell) break;
    Step step{plus(next, -1.0, x), plus(next_slope, -1.0, slope)};
    step.curvature = dot(step.moved, step.turned);
    if (step.curvature > 0.0) steps.push_back(std::move(step));
    if (steps.size() > remembered) steps.pop_front();
    x = std::move(next);
    slope = std::move(next_slope);
    value = next_value;
  }
  return x;
}

}  // namespace weft::classifier
