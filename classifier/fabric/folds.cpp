#include "classifier/fabric/folds.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "classifier/base/matrix.hpp"
#include "classifier/base/random.hpp"
#include "classifier/features/trial.hpp"

namespace weft::classifier {

std::vector<std::size_t> row_units(const FeatureMatrix& matrix, FoldUnit kind) {
  std::map<std::string, std::size_t> number;
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const std::string_view unit =
        kind == FoldUnit::group ? matrix.groups[r] : recording_of(matrix.files[r]);
    // A row without a name is a recording of its own.
    const std::string key = unit.empty() ? "#" + std::to_string(r) : std::string(unit);
    out.push_back(number.emplace(key, number.size()).first->second);
  }
  return out;
}

Classes find_classes(const FeatureMatrix& matrix) {
  const std::set<std::string> distinct(matrix.labels.begin(), matrix.labels.end());
  Classes out{{distinct.begin(), distinct.end()}, {}};
  for (const std::string& label : matrix.labels)
    out.of_row.push_back(find_place(out.labels, label));
  return out;
}

std::vector<std::vector<std::size_t>> rows_by_class(std::span<const std::size_t> of_row,
                                                    std::size_t classes) {
  std::vector<std::vector<std::size_t>> out(classes);
  for (std::size_t r = 0; r < of_row.size(); ++r) {
    if (of_row[r] >= out.size()) out.resize(of_row[r] + 1);
    out[of_row[r]].push_back(r);
  }
  return out;
}

namespace {

// A number for each pair of recording and part.
std::vector<std::size_t> part_units(std::span<const std::size_t> recording,
                                    std::span<const std::size_t> part) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> number;
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < part.size(); ++r)
    out.push_back(number.emplace(std::pair(recording[r], part[r]), number.size()).first->second);
  return out;
}

}  // namespace

UnitLevels unit_levels(const FeatureMatrix& matrix, FoldUnit kind) {
  UnitLevels out{row_units(matrix, kind)};
  if (kind == FoldUnit::group) out.push_back(row_units(matrix, FoldUnit::recording));
  if (!matrix.parts.empty()) out.push_back(part_units(out.back(), matrix.parts));
  out.push_back(numbers_below(matrix.size()));
  return out;
}

std::size_t first_level(const UnitLevels& levels, std::span<const std::size_t> rows_of_class,
                        std::size_t least, std::size_t from) {
  for (std::size_t level = from; level < levels.size(); ++level) {
    std::map<std::size_t, std::size_t> held;
    std::size_t most = 0;
    for (const std::size_t r : rows_of_class) most = std::max(most, ++held[levels[level][r]]);
    if (rows_of_class.size() >= most + least) return level;
  }
  return levels.size();
}

std::vector<std::size_t> units_at(const UnitLevels& levels, std::span<const std::size_t> of_row,
                                  std::span<const std::size_t> level_of_class) {
  std::vector<std::size_t> out(of_row.size());
  for (std::size_t r = 0; r < out.size(); ++r) {
    const std::size_t level = std::min(level_of_class[of_row[r]], levels.size() - 1);
    out[r] = level * out.size() + levels[level][r];
  }
  return out;
}

LabelUnits units_by_label(const FeatureMatrix& matrix, FoldUnit kind) {
  const Classes classes = find_classes(matrix);
  const UnitLevels levels = unit_levels(matrix, kind);
  LabelUnits out;
  for (const auto& rows : rows_by_class(classes.of_row))
    out.level.push_back(std::min(first_level(levels, rows, 1), levels.size() - 1));
  out.of_row = units_at(levels, classes.of_row, out.level);
  return out;
}

RowsOfLabel rows_by_label(const FeatureMatrix& matrix) {
  RowsOfLabel out;
  for (std::size_t r = 0; r < matrix.size(); ++r) out[matrix.labels[r]].push_back(r);
  return out;
}

Status check_labels(std::span<const std::string> labels, std::size_t least) {
  std::map<std::string_view, std::size_t> rows;
  for (const std::string& label : labels) ++rows[label];
  if (rows.size() < 2)
    return fail({.code = Errc::invalid_argument,
                 .where = "labels",
                 .what = "too few labels to train on",
                 .expected = "at least 2",
                 .got = std::to_string(rows.size())});
  for (const auto& [label, count] : rows)
    if (count < least)
      return fail({.code = Errc::invalid_argument,
                   .where = "label " + std::string(label),
                   .what = "too few training trials",
                   .expected = "at least " + std::to_string(least),
                   .got = std::to_string(count),
                   .hint = "Record more trials of this label or remove the label"});
  return {};
}

PairMaker::PairMaker(const FeatureMatrix& matrix, const TrainOptions& options)
    : options_(options), unit_(units_by_label(matrix, options.fold_unit).of_row) {}

// The units of the rows, numbered in order of appearance.
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

namespace {

// Units with rows of both classes, of class a only, or of class b only; in order of first
// appearance.
struct Units {
  std::vector<std::size_t> mixed;
  std::vector<std::size_t> positive;
  std::vector<std::size_t> negative;
};

Units units_of(std::span<const int> sign, std::span<const std::size_t> unit) {
  std::map<std::size_t, std::array<bool, 2>> has;
  for (std::size_t i = 0; i < sign.size(); ++i) has[unit[i]][sign[i] > 0 ? 1 : 0] = true;
  Units out;
  for (const std::size_t u : unit) {
    auto& [negative, positive] = has[u];
    if (!negative && !positive) continue;  // already listed
    (negative && positive ? out.mixed : positive ? out.positive : out.negative).push_back(u);
    negative = positive = false;
  }
  return out;
}

// Deals units into k folds. Each goes to the fold with the fewest units of its class or classes,
// then with the fewest units in all. Units of both classes go first and so to different folds. A
// class with at most one of them then finds folds without it. Hence a class of two or more units is
// in two or more folds, and every training part has both classes.
class Assigner {
 public:
  explicit Assigner(std::size_t folds) : held_(folds) {}

  void deal(const std::vector<std::size_t>& units, bool positive, bool negative) {
    for (const std::size_t u : units) {
      const auto load = [&](const Held& h) {
        return std::pair((positive ? h.positive : 0) + (negative ? h.negative : 0), h.units);
      };
      const auto least =
          std::min_element(held_.begin(), held_.end(),
                           [&](const Held& a, const Held& b) { return load(a) < load(b); });
      least->positive += positive ? 1 : 0;
      least->negative += negative ? 1 : 0;
      ++least->units;
      fold_of_.emplace(u, static_cast<std::size_t>(least - held_.begin()));
    }
  }

  [[nodiscard]] std::size_t fold_of(std::size_t unit) const { return fold_of_.at(unit); }

 private:
  struct Held {
    std::size_t positive = 0, negative = 0, units = 0;
  };
  std::vector<Held> held_;
  std::map<std::size_t, std::size_t> fold_of_;
};

std::vector<Fold> gather(const std::vector<std::size_t>& fold_of_row, std::size_t folds) {
  std::vector<Fold> out(folds);
  for (std::size_t i = 0; i < fold_of_row.size(); ++i) {
    for (std::size_t f = 0; f < folds; ++f) {
      (fold_of_row[i] == f ? out[f].validate : out[f].train).push_back(i);
    }
  }
  return out;
}

std::vector<Fold> leave_one_out(std::span<const std::size_t> unit) {
  std::map<std::size_t, std::size_t> number;
  std::vector<std::size_t> fold_of_row;
  for (const std::size_t u : unit)
    fold_of_row.push_back(number.emplace(u, number.size()).first->second);
  return gather(fold_of_row, number.size());
}

// A pooled t-test inside the fold needs three rows; with two it has no degree of freedom.
bool large_enough(const std::vector<Fold>& folds) {
  return std::all_of(folds.begin(), folds.end(),
                     [](const Fold& fold) { return fold.train.size() >= least_fold_rows; });
}

}  // namespace

std::vector<Fold> stratified_folds(std::span<const int> sign, std::span<const std::size_t> unit,
                                   std::size_t folds, std::uint64_t seed) {
  Units units = units_of(sign, unit);
  const std::size_t k = std::min({folds, units.mixed.size() + units.positive.size(),
                                  units.mixed.size() + units.negative.size()});
  if (k < 2) return stratified_folds(sign, numbers_below(sign.size()), folds, seed);
  RandomEngine engine(seed);
  for (auto* list : {&units.positive, &units.negative, &units.mixed}) shuffle(*list, engine);
  Assigner assigner(k);
  assigner.deal(units.mixed, true, true);
  assigner.deal(units.positive, true, false);
  assigner.deal(units.negative, false, true);
  std::vector<std::size_t> fold_of_row;
  for (const std::size_t u : unit) fold_of_row.push_back(assigner.fold_of(u));
  std::vector<Fold> out = gather(fold_of_row, k);
  if (!large_enough(out)) out = leave_one_out(unit);
  if (!large_enough(out)) out = leave_one_out(numbers_below(sign.size()));
  return out;
}

}  // namespace weft::classifier
