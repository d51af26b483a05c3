#include "classifier/vibro/learn/learners.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "classifier/fabric/core_text.hpp"
#include "classifier/vibro/learn/minimise.hpp"

namespace weft::classifier::vibro {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Weights = Eigen::Map<const Eigen::MatrixXd>;

Eigen::Index index(std::size_t n) {
  return static_cast<Eigen::Index>(n);
}

// A column of ones behind the features carries the intercepts.
RowMatrix with_intercept(const Matrix& rows) {
  RowMatrix out(index(rows.rows()), index(rows.cols() + 1));
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    for (std::size_t f = 0; f < rows.cols(); ++f) out(index(r), index(f)) = rows(r, f);
    out(index(r), index(rows.cols())) = 1.0;
  }
  return out;
}

// Cross entropy and penalty of weights [features + 1 x classes]; scores become probabilities less
// the truth.
double loss(const RowMatrix& rows, const Training& training, const std::vector<double>& x,
            std::vector<double>& slope) {
  const Weights weight(x.data(), rows.cols(), index(training.classes));
  RowMatrix score = rows * weight;
  double sum = 0.0;
  for (Eigen::Index r = 0; r < score.rows(); ++r) {
    const auto truth = index(training.of_row[static_cast<std::size_t>(r)]);
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

class Logistic final : public Classifier {
 public:
  explicit Logistic(const Training& training) {
    const RowMatrix rows = with_intercept(*training.rows);
    const auto x =
        minimum([&](const std::vector<double>& at,
                    std::vector<double>& slope) { return loss(rows, training, at, slope); },
                std::vector<double>(static_cast<std::size_t>(rows.cols()) * training.classes, 0.0));
    weight_ = Weights(x.data(), rows.cols(), index(training.classes));
  }

  [[nodiscard]] std::size_t classify(std::span<const double> features) const override {
    const Eigen::Index n = index(features.size());
    const Eigen::Map<const Eigen::VectorXd> own(features.data(), n);
    Eigen::Index best = 0;
    (weight_.topRows(n).transpose() * own + weight_.row(n).transpose()).maxCoeff(&best);
    return static_cast<std::size_t>(best);
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

}  // namespace

Result<std::unique_ptr<Classifier>> fit_logistic(const Training& training) {
  return std::make_unique<Logistic>(training);
}

std::unique_ptr<Classifier> read_logistic(LineReader& in, std::size_t features,
                                          std::size_t classes) {
  auto out = std::make_unique<Logistic>(in, features, classes);
  return in.ok() ? std::move(out) : nullptr;
}

}  // namespace weft::classifier::vibro
