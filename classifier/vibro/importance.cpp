#include "classifier/vibro/importance.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "classifier/evaluate/interval.hpp"
#include "classifier/learn/random.hpp"

namespace weft::classifier::vibro {
namespace {

Result<double> accuracy_of(const Pipeline& pipeline, const Matrix& rows,
                           std::span<const std::size_t> of_row) {
  std::size_t right = 0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const auto said = pipeline.classify(rows.row(r));
    if (!said) return pass(said.error(), "row " + std::to_string(r));
    right += *said == of_row[r] ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(rows.rows());
}

}  // namespace

Result<std::vector<Importance>> permutation_importance(const Pipeline& pipeline, const Matrix& rows,
                                                       std::span<const std::size_t> of_row,
                                                       std::size_t repeats, std::uint64_t seed) {
  if (rows.rows() == 0 || of_row.size() != rows.rows() || repeats == 0)
    return fail(Errc::invalid_argument, "importance needs rows with a class each, and a repeat");
  const auto whole = accuracy_of(pipeline, rows, of_row);
  if (!whole) return pass(whole.error());
  RandomEngine engine(seed);
  std::vector<Importance> out;
  Matrix dealt = rows;
  for (std::size_t f = 0; f < rows.cols(); ++f) {
    std::vector<double> column, lost;
    for (std::size_t r = 0; r < rows.rows(); ++r) column.push_back(rows(r, f));
    for (std::size_t i = 0; i < repeats; ++i) {
      shuffle(column, engine);
      for (std::size_t r = 0; r < rows.rows(); ++r) dealt(r, f) = column[r];
      const auto left = accuracy_of(pipeline, dealt, of_row);
      if (!left) return pass(left.error());
      lost.push_back(*whole - *left);
    }
    for (std::size_t r = 0; r < rows.rows(); ++r) dealt(r, f) = rows(r, f);
    out.push_back({mean_of(lost), deviation_of(lost)});
  }
  return out;
}

std::vector<std::size_t> most_important(std::span<const Importance> importance, std::size_t count) {
  std::vector<std::size_t> out(importance.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  std::stable_sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) {
    return importance[a].mean > importance[b].mean;
  });
  out.resize(std::min(count, out.size()));
  return out;
}

}  // namespace weft::classifier::vibro
