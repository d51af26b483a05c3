#include "classifier/learners/outliers.hpp"

#include <cmath>
#include <vector>

#include "classifier/learn/feature_view.hpp"

namespace weft::classifier {
namespace {

bool is_outlier(const Scaler& scaler, std::span<const double> row, double deviations) {
  for (std::size_t c = 0; c < row.size(); ++c)
    if (std::abs(scaler.apply(c, row[c])) > deviations) return true;
  return false;
}

}  // namespace

Result<std::map<std::string, std::size_t>> remove_outliers(FeatureMatrix& rows, double deviations) {
  std::map<std::string, std::size_t> left_out, remain;
  if (!(deviations > 0.0)) return left_out;
  const Scaler scaler = fit_scaler(rows.values);
  std::vector<std::size_t> remaining;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const bool is_out = is_outlier(scaler, rows.values.row(r), deviations);
    left_out[rows.labels[r]] += is_out ? 1 : 0;
    remain[rows.labels[r]] += is_out ? 0 : 1;
    if (!is_out) remaining.push_back(r);
  }
  for (const auto& [label, count] : remain)
    if (count == 0)
      return fail({.code = Errc::range,
                   .where = label,
                   .what = "all training rows are outliers",
                   .expected = "at least one within " + std::to_string(deviations) +
                               " standard deviations of the mean of all rows",
                   .got = "0 of " + std::to_string(left_out[label]) + " rows",
                   .hint = "Use a larger --outliers value, or omit the option"});
  if (remaining.size() < rows.size()) rows = select_rows(rows, remaining);
  return left_out;
}

}  // namespace weft::classifier
