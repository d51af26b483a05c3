#include "classifier/fabric/pair_problem.hpp"

namespace weft::classifier {
std::vector<std::size_t> fold_units(const FeatureMatrix& matrix,
                                    const std::vector<std::size_t>& rows, FoldUnit kind) {
  std::map<std::string, std::size_t> number;
  std::vector<std::size_t> out;
  for (const std::size_t r : rows) {
    const std::string& file = matrix.files[r];
    const std::string unit =
        kind == FoldUnit::group ? matrix.groups[r] : file.substr(0, file.find('#'));
    // rows without a name are recordings of their own
    const std::string key = unit.empty() ? "#" + std::to_string(r) : unit;
    out.push_back(number.emplace(key, number.size()).first->second);
  }
  return out;
}

RowsOfLabel rows_by_label(const FeatureMatrix& matrix) {
  RowsOfLabel out;
  for (std::size_t r = 0; r < matrix.size(); ++r) out[matrix.labels[r]].push_back(r);
  return out;
}

PairProblem pair_problem(const FeatureMatrix& matrix, const std::vector<std::size_t>& a,
                         const std::vector<std::size_t>& b, const TrainOptions& options) {
  PairProblem out{a, std::vector<int>(a.size(), 1), {}};
  out.rows.insert(out.rows.end(), b.begin(), b.end());
  out.sign.resize(out.rows.size(), -1);
  out.folds = options.make_folds
                  ? options.make_folds(out.sign)
                  : stratified_folds(out.sign, fold_units(matrix, out.rows, options.fold_unit),
                                     options.folds, options.seed);
  return out;
}

}  // namespace weft::classifier
