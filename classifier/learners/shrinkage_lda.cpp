#include "classifier/learners/shrinkage_lda.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "classifier/fabric/folds.hpp"
#include "classifier/fabric/model_text.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Least variance of a direction, relative to the whole set's. It is far below any spread that
// counts, and large enough to keep the covariance regular.
constexpr double least_variance = 1e-10;

Eigen::Map<const RowMajor> view(const Matrix& m) {
  return {m.data().data(), static_cast<Eigen::Index>(m.rows()),
          static_cast<Eigen::Index>(m.cols())};
}

// factor' factor + diagonal: the weighted sum of all classes' shrunk covariances.
struct Covariance {
  RowMajor factor;
  Eigen::VectorXd diagonal;
};

void add_class(const Matrix& rows, double share, Eigen::Index at, Covariance& sum) {
  const Scaler own = fit_scaler(rows);
  const Matrix z = scaled(own, rows);
  const double s = ledoit_wolf_shrinkage(z);
  const auto n = static_cast<double>(rows.rows());
  const double mean_variance = view(z).squaredNorm() / (n * static_cast<double>(rows.cols()));
  const Eigen::Map<const Eigen::VectorXd> deviation(own.deviation.data(),
                                                    static_cast<Eigen::Index>(rows.cols()));
  sum.factor.middleRows(at, static_cast<Eigen::Index>(rows.rows())) =
      std::sqrt(share * (1.0 - s) / n) * (view(z) * deviation.asDiagonal());
  sum.diagonal += share * s * mean_variance * deviation.cwiseAbs2();
}

// C^-1 B for B [features x classes]. With fewer rows than features it uses the matrix inversion
// lemma, so no [features x features] matrix is needed.
Eigen::MatrixXd solve(const Covariance& c, const Eigen::MatrixXd& b) {
  const auto& a = c.factor;
  if (a.rows() >= a.cols()) {
    Eigen::MatrixXd whole = c.diagonal.asDiagonal();
    whole.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
    return whole.selfadjointView<Eigen::Lower>().ldlt().solve(b);
  }
  const Eigen::VectorXd inverse = c.diagonal.cwiseInverse();
  const Eigen::MatrixXd scaled_b = inverse.asDiagonal() * b;
  Eigen::MatrixXd inner = a * inverse.asDiagonal() * a.transpose();
  inner.diagonal().array() += 1.0;
  return scaled_b - inverse.asDiagonal() * (a.transpose() * inner.ldlt().solve(a * scaled_b));
}

}  // namespace

double ledoit_wolf_shrinkage(const Matrix& rows) {
  const auto x = view(rows);
  const auto n = static_cast<double>(x.rows());
  const auto p = static_cast<double>(x.cols());
  const double trace = x.squaredNorm() / n;
  const bool wide = x.cols() > x.rows();
  const Eigen::MatrixXd gram = wide ? Eigen::MatrixXd(x * x.transpose()) : x.transpose() * x;
  const double norm = gram.squaredNorm() / (n * n);
  const double fourth = x.rowwise().squaredNorm().array().square().sum();
  const double distance = (norm - trace * trace / p) / p;
  const double noise = std::min((fourth / n - norm) / (p * n), distance);
  return noise > 0.0 ? noise / distance : 0.0;
}

Result<ShrinkageLda> ShrinkageLda::fit(const Matrix& rows, std::span<const std::size_t> of_row,
                                       std::size_t classes) {
  const auto members = rows_by_class(of_row, classes);
  if (of_row.size() != rows.rows() ||
      std::any_of(members.begin(), members.end(), [](const auto& m) { return m.empty(); }))
    return fail({.code = Errc::invalid_argument,
                 .where = "LDA",
                 .what = "class without rows or row without class"});
  ShrinkageLda out;
  out.scaler_ = fit_scaler(rows);
  const Matrix z = scaled(out.scaler_, rows);
  const auto features = static_cast<Eigen::Index>(rows.cols());
  Covariance covariance{RowMajor(static_cast<Eigen::Index>(rows.rows()), features),
                        Eigen::VectorXd::Zero(features)};
  Eigen::MatrixXd mean(features, static_cast<Eigen::Index>(classes));
  Eigen::Index at = 0;
  for (std::size_t c = 0; c < classes; ++c) {
    const Matrix own = z.take(members[c]);
    const double share = static_cast<double>(own.rows()) / static_cast<double>(rows.rows());
    mean.col(static_cast<Eigen::Index>(c)) = view(own).colwise().mean();
    add_class(own, share, at, covariance);
    at += static_cast<Eigen::Index>(own.rows());
    out.bias_.push_back(std::log(share));
  }
  covariance.diagonal = covariance.diagonal.cwiseMax(least_variance);
  const Eigen::MatrixXd weight = solve(covariance, mean);
  if (!weight.allFinite())
    return fail({.code = Errc::range, .where = "LDA", .what = "covariance not invertible"});
  out.weight_ = Matrix(classes, rows.cols());
  for (std::size_t c = 0; c < classes; ++c) {
    const auto column = weight.col(static_cast<Eigen::Index>(c));
    std::copy(column.begin(), column.end(), out.weight_.row(c).begin());
    out.bias_[c] -= 0.5 * column.dot(mean.col(static_cast<Eigen::Index>(c)));
  }
  return out;
}

Result<std::vector<double>> ShrinkageLda::discriminants(std::span<const double> features) const {
  if (auto ok = check_length(features, weight_.cols(), "LDA"); !ok) return pass(ok.error());
  std::vector<double> score = bias_;
  for (std::size_t k = 0; k < features.size(); ++k) {
    const double z = scaler_.apply(k, features[k]);
    for (std::size_t c = 0; c < score.size(); ++c) score[c] += weight_(c, k) * z;
  }
  if (!std::all_of(score.begin(), score.end(), [](double v) { return std::isfinite(v); }))
    return fail({.code = Errc::range,
                 .where = "LDA",
                 .what = "discriminant not finite",
                 .hint = "Check the trial: its values are far outside the training range"});
  return score;
}

Result<ClassScores> ShrinkageLda::predict(std::span<const double> features) const {
  auto score = discriminants(features);
  if (!score) return pass(score.error());
  return ClassScores{place_of_largest(*score), std::move(*score)};
}

void ShrinkageLda::write(LineWriter& out) const {
  write_scaler(out, scaler_);
  write_rows(out, "weight", weight_);
  out.numbers("bias", bias_);
}

ShrinkageLda ShrinkageLda::read(LineReader& in, std::size_t features, std::size_t classes) {
  Scaler scaler = read_scaler(in, features);
  Matrix weight = read_rows(in, "weight", classes, features);
  return {std::move(scaler), std::move(weight), in.numbers("bias", classes)};
}

}  // namespace weft::classifier
