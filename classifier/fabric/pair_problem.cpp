#include "classifier/fabric/pair_problem.hpp"

#include <unordered_map>

namespace weft::classifier {

RowsOfLabel rows_by_label(const FeatureMatrix& matrix) {
  RowsOfLabel out;
  for (std::size_t r = 0; r < matrix.size(); ++r) out[matrix.labels[r]].push_back(r);
  return out;
}

Status check_labels(std::span<const std::string> labels) {
  std::map<std::string_view, std::size_t> rows;
  for (const std::string& label : labels) ++rows[label];
  if (rows.size() < 2)
    return fail({.code = Errc::invalid_argument,
                 .where = "labels",
                 .what = "nothing to tell apart",
                 .expected = "at least 2",
                 .got = std::to_string(rows.size())});
  for (const auto& [label, count] : rows)
    if (count < 2)
      return fail({.code = Errc::invalid_argument,
                   .where = "label " + std::string(label),
                   .what = "too few training trials",
                   .expected = "at least 2",
                   .got = "1",
                   .hint = "Record more trials of it or leave it out"});
  return {};
}

PairMaker::PairMaker(const FeatureMatrix& matrix, const TrainOptions& options)
    : options_(options), unit_(units_by_label(matrix, options.fold_unit).of_row) {}

// Units numbered as they come.
std::vector<std::size_t> PairMaker::pattern(const std::vector<std::size_t>& rows) const {
  std::unordered_map<std::size_t, std::size_t> number;
  std::vector<std::size_t> out;
  out.reserve(rows.size());
  for (const std::size_t r : rows)
    out.push_back(number.emplace(unit_[r], number.size()).first->second);
  return out;
}

const PairProblem& PairMaker::make(const std::vector<std::size_t>& a,
                                   const std::vector<std::size_t>& b) {
  problem_.rows = a;
  problem_.rows.insert(problem_.rows.end(), b.begin(), b.end());
  problem_.sign.assign(a.size(), 1);
  problem_.sign.resize(problem_.rows.size(), -1);
  if (options_.make_folds) {
    problem_.folds = options_.make_folds(problem_.sign);
    return problem_;
  }
  std::vector<std::size_t> now = pattern(problem_.rows);
  if (now != last_pattern_ || problem_.sign != last_sign_) {
    problem_.folds = stratified_folds(problem_.sign, now, options_.folds, options_.seed);
    last_pattern_ = std::move(now);
    last_sign_ = problem_.sign;
  }
  return problem_;
}

}  // namespace weft::classifier
