#include "classifier/learners/learners.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "classifier/fabric/model_text.hpp"

namespace weft::classifier {
namespace {

class NaiveBayes final : public Predictor {
 public:
  explicit NaiveBayes(const TrainingSet& training)
      : mean_(training.classes(), training.rows().cols()),
        precision_(training.classes(), training.rows().cols()),
        constant_(training.classes(), 0.0) {
    const Matrix& rows = training.rows();
    std::vector<double> count(training.classes(), 0.0);
    for (std::size_t r = 0; r < rows.rows(); ++r) {
      const std::size_t c = training.of_row()[r];
      count[c] += 1.0;
      for (std::size_t f = 0; f < rows.cols(); ++f) mean_(c, f) += rows(r, f);
    }
    for (std::size_t c = 0; c < training.classes(); ++c)
      for (double& m : mean_.row(c)) m /= count[c];
    Matrix variance(training.classes(), rows.cols());
    for (std::size_t r = 0; r < rows.rows(); ++r) {
      const std::size_t c = training.of_row()[r];
      for (std::size_t f = 0; f < rows.cols(); ++f) {
        const double away = rows(r, f) - mean_(c, f);
        variance(c, f) += away * away / count[c];
      }
    }
    const double widened = widening(rows);
    for (std::size_t c = 0; c < training.classes(); ++c) {
      constant_[c] = std::log(count[c] / static_cast<double>(rows.rows()));
      for (std::size_t f = 0; f < rows.cols(); ++f) {
        const double v = variance(c, f) + widened;
        precision_(c, f) = 1.0 / v;
        constant_[c] -= 0.5 * std::log(2.0 * std::numbers::pi * v);
      }
    }
  }

  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override {
    std::vector<double> score = constant_;
    for (std::size_t c = 0; c < score.size(); ++c) {
      for (std::size_t f = 0; f < features.size(); ++f) {
        const double away = features[f] - mean_(c, f);
        score[c] -= 0.5 * away * away * precision_(c, f);
      }
    }
    return scores_of(std::move(score), "naive Bayes");
  }

  void write(LineWriter& out) const override {
    write_rows(out, "mean", mean_);
    write_rows(out, "precision", precision_);
    out.numbers("constant", constant_);
  }
  NaiveBayes(LineReader& in, std::size_t features, std::size_t classes)
      : mean_(read_rows(in, "mean", classes, features)),
        precision_(read_rows(in, "precision", classes, features)),
        constant_(in.numbers("constant", classes)) {}

 private:
  // Never 0, so that features without any spread have no effect instead of a division by zero.
  static double widening(const Matrix& rows) {
    const auto n = static_cast<double>(rows.rows());
    double most = 0.0;
    for (std::size_t f = 0; f < rows.cols(); ++f) {
      double mean = 0.0, variance = 0.0;
      for (std::size_t r = 0; r < rows.rows(); ++r) mean += rows(r, f) / n;
      for (std::size_t r = 0; r < rows.rows(); ++r)
        variance += (rows(r, f) - mean) * (rows(r, f) - mean) / n;
      most = std::max(most, variance);
    }
    return std::max(1e-9 * most, 1e-150);
  }

  Matrix mean_, precision_;  // [classes x features]
  std::vector<double> constant_;
};

class Neighbours final : public Predictor {
 public:
  explicit Neighbours(const TrainingSet& training)
      : rows_(training.rows()),
        of_row_(training.of_row().begin(), training.of_row().end()),
        classes_(training.classes()) {}

  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override {
    constexpr std::size_t neighbours = 5;
    std::pair<double, std::size_t> near[neighbours];  // sorted by distance
    std::size_t found = 0;
    for (std::size_t r = 0; r < rows_.rows(); ++r) {
      const std::span<const double> own = rows_.row(r);
      double distance = 0.0;
      for (std::size_t f = 0; f < own.size(); ++f)
        distance += (own[f] - features[f]) * (own[f] - features[f]);
      if (found == neighbours && !(distance < near[found - 1].first)) continue;
      std::size_t at = found < neighbours ? found++ : found - 1;
      for (; at > 0 && distance < near[at - 1].first; --at) near[at] = near[at - 1];
      near[at] = {distance, of_row_[r]};
    }
    ClassScores out{0, std::vector<double>(classes_), std::vector<int>(classes_)};
    for (std::size_t i = 0; i < found; ++i) ++out.votes[near[i].second];
    out.winner = place_of_largest(out.votes);
    // The share of a class by Laplace's rule is never 0.
    const auto whole = static_cast<double>(found + classes_);
    for (std::size_t c = 0; c < classes_; ++c) out.score[c] = std::log((out.votes[c] + 1) / whole);
    return out;
  }

  void write(LineWriter& out) const override {
    write_matrix(out, "rows", rows_);
    out.counts("classes", of_row_);
  }
  Neighbours(LineReader& in, std::size_t features, std::size_t classes)
      : rows_(read_matrix(in, "rows", features)),
        of_row_(in.counts("classes", rows_.rows())),
        classes_(classes) {
    in.within(of_row_, classes, "class");
  }

 private:
  Matrix rows_;
  std::vector<std::size_t> of_row_;
  std::size_t classes_;
};

}  // namespace

Result<PredictorPtr> fit_naive_bayes(const TrainingSet& training, const TrainOptions& /*options*/) {
  return std::make_unique<NaiveBayes>(training);
}

Result<PredictorPtr> fit_neighbours(const TrainingSet& training, const TrainOptions& /*options*/) {
  return std::make_unique<Neighbours>(training);
}

PredictorPtr read_naive_bayes(LineReader& in, std::size_t features, std::size_t classes) {
  auto out = std::make_unique<NaiveBayes>(in, features, classes);
  if (!in.ok()) return nullptr;
  return out;
}

PredictorPtr read_neighbours(LineReader& in, std::size_t features, std::size_t classes) {
  auto out = std::make_unique<Neighbours>(in, features, classes);
  if (!in.ok()) return nullptr;
  return out;
}

}  // namespace weft::classifier
