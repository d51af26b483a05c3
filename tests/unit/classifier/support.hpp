#pragma once
// Trials and tables shared by several classifier tests.

#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/random.hpp"
#include "classifier/fabric/grid_search.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/features/trial.hpp"
#include "classifier/selection/selection.hpp"

namespace weft::classifier::testing {

/// The reduction with this to_string().
inline Reduction reduction_named(std::string_view name) {
  for (const Reduction r : {Reduction::pvalue, Reduction::pca, Reduction::all})
    if (name == to_string(r)) return r;
  throw std::invalid_argument("no reduction is called " + std::string(name));
}

/// t statistics over all rows.
inline std::vector<double> t_of_all(const Matrix& rows, std::span<const int> sign) {
  return t_statistics(rows, numbers_below(rows.rows()), sign);
}

/// A single core.
inline Result<FabricCore> lone_core(const Matrix& rows, std::span<const int> sign,
                                    std::span<const Fold> folds, const TrainOptions& options) {
  GridSearch search;
  return train_core(rows, sign, folds, options, RareT(), search);
}

/// Votes of the model on every row of `matrix`, which has its features.
inline std::vector<Vote> votes_on(const FabricModel& model, const FeatureMatrix& matrix) {
  std::vector<Vote> out;
  for (std::size_t r = 0; r < matrix.size(); ++r)
    out.push_back(model.classify(matrix.values.row(r)).value());
  return out;
}

/// A trial of phase M only, from rows of samples.
inline Trial motion_trial(const std::vector<std::vector<double>>& rows) {
  Trial out;
  out.file = "trial.csv";
  out.taxels = rows.empty() ? 1 : rows.front().size();
  for (const auto& row : rows) out.counts.insert(out.counts.end(), row.begin(), row.end());
  out.phase.assign(rows.size(), Phase::motion);
  return out;
}

/// One taxel.
inline Trial motion_trial(const std::vector<double>& signal) {
  std::vector<std::vector<double>> rows;
  for (const double v : signal) rows.push_back({v});
  return motion_trial(rows);
}

/// Standard normal by the polar method, from the portable engine.
inline double normal(RandomEngine& engine) {
  for (;;) {
    const double u = 2.0 * static_cast<double>(engine() >> 11) * 0x1p-53 - 1.0;
    const double v = 2.0 * static_cast<double>(engine() >> 11) * 0x1p-53 - 1.0;
    const double s = u * u + v * v;
    if (s > 0.0 && s < 1.0) return u * std::sqrt(-2.0 * std::log(s) / s);
  }
}

/// `per_class` rows of every class; feature k of class c has mean separation * ((c >> k) & 1), unit
/// noise.
inline FeatureMatrix gaussian_classes(std::size_t classes, std::size_t per_class,
                                      std::size_t features, double separation, std::uint64_t seed) {
  RandomEngine engine(seed);
  FeatureMatrix out;
  out.values = Matrix(classes * per_class, features);
  for (std::size_t k = 0; k < features; ++k)
    out.names.push_back(std::to_string(k).insert(0, 1, 'f'));
  for (std::size_t r = 0; r < out.values.rows(); ++r) {
    const std::size_t c = r / per_class;
    for (std::size_t k = 0; k < features; ++k) {
      const bool high = k < 16 && ((c >> k) & 1U) != 0;
      out.values(r, k) = (high ? separation : 0.0) + normal(engine);
    }
    out.labels.emplace_back("class");
    out.labels.back().push_back(static_cast<char>('a' + c));
    out.groups.push_back(std::to_string(r % per_class));
    out.files.push_back(std::to_string(r).append(".csv"));
  }
  return out;
}

/// |a - b| relative to the larger; 0 when both are 0.
inline double relative_difference(double a, double b) {
  const double top = std::max(std::abs(a), std::abs(b));
  return top == 0.0 ? 0.0 : std::abs(a - b) / top;
}

}  // namespace weft::classifier::testing
