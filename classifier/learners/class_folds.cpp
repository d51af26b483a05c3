#include "classifier/learners/class_folds.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <vector>

#include "classifier/base/random.hpp"
#include "classifier/features/trial.hpp"

namespace weft::classifier {
namespace {

using RowsOfClass = std::map<std::size_t, std::size_t>;  // class -> rows

constexpr std::size_t least_trained = 2;  // rows of a class in every training part
constexpr std::size_t never_held_out = std::numeric_limits<std::size_t>::max();

struct Unit {
  std::vector<std::size_t> rows;
  RowsOfClass held;
};

// Units of the rows of the dealt classes, in order of first appearance.
std::vector<Unit> gather_units(std::span<const std::size_t> of_row,
                               std::span<const std::size_t> unit,
                               const std::vector<bool>& assigned) {
  std::map<std::size_t, std::size_t> place;
  std::vector<Unit> out;
  for (std::size_t r = 0; r < unit.size(); ++r) {
    if (!assigned[of_row[r]]) continue;
    const std::size_t at = place.emplace(unit[r], out.size()).first->second;
    if (at == out.size()) out.emplace_back();
    out[at].rows.push_back(r);
    ++out[at].held[of_row[r]];
  }
  return out;
}

// Order in which a dealing balances classes. Only the first `classes` classes of a unit count.
struct Balance {
  std::vector<std::size_t> rank;  // per class
  std::size_t classes = 1;
};

// The balanced classes of a unit, by rank.
std::vector<std::size_t> balanced_classes(const Unit& unit, const Balance& balance) {
  std::vector<std::size_t> out;
  for (const auto& entry : unit.held) out.push_back(entry.first);
  std::ranges::sort(out, {}, [&](std::size_t c) { return balance.rank[c]; });
  out.resize(std::min(out.size(), balance.classes));
  return out;
}

// Deals the units of one class after the other, so that each class is spread separately. Each unit
// goes to the fold with the fewest rows of its classes, compared in their order, then the fewest in
// all.
std::vector<std::size_t> deal(const std::vector<Unit>& units, std::size_t rows, std::size_t folds,
                              const Balance& balance) {
  std::vector<std::vector<std::size_t>> classes;
  for (const Unit& unit : units) classes.push_back(balanced_classes(unit, balance));
  std::vector<std::size_t> order = numbers_below(units.size());
  std::ranges::stable_sort(order, {},
                           [&](std::size_t u) { return balance.rank[classes[u].front()]; });
  std::vector<RowsOfClass> held(folds);
  std::vector<std::size_t> size(folds), fold_of_row(rows, never_held_out);
  for (const std::size_t u : order) {
    const auto load = [&](std::size_t f) {
      std::vector<std::size_t> out;
      for (const std::size_t c : classes[u]) out.push_back(held[f][c]);
      out.push_back(size[f]);
      return out;
    };
    std::size_t to = 0;
    for (std::size_t f = 1; f < folds; ++f)
      if (load(f) < load(to)) to = f;
    for (const auto& [c, count] : units[u].held) held[to][c] += count;
    size[to] += units[u].rows.size();
    for (const std::size_t r : units[u].rows) fold_of_row[r] = to;
  }
  return fold_of_row;
}

std::vector<Fold> as_folds(const std::vector<std::size_t>& fold_of_row, std::size_t folds) {
  std::vector<Fold> out(folds);
  for (std::size_t r = 0; r < fold_of_row.size(); ++r)
    for (std::size_t f = 0; f < folds; ++f)
      (fold_of_row[r] == f ? out[f].validate : out[f].train).push_back(r);
  std::erase_if(out, [](const Fold& fold) { return fold.validate.empty(); });
  return out;
}

// Classes with too few training rows in some fold.
std::vector<std::size_t> short_classes(const std::vector<Fold>& folds,
                                       std::span<const std::size_t> of_row, std::size_t classes) {
  std::vector<bool> is_short(classes, folds.size() < 2);
  for (const Fold& fold : folds) {
    std::vector<std::size_t> rows(classes);
    for (const std::size_t r : fold.train) ++rows[of_row[r]];
    for (std::size_t c = 0; c < classes; ++c)
      if (rows[c] < least_trained) is_short[c] = true;
  }
  std::vector<std::size_t> out;
  for (std::size_t c = 0; c < classes; ++c)
    if (is_short[c]) out.push_back(c);
  return out;
}

// Number of units of each class; 0 for classes that are not dealt.
std::vector<std::size_t> units_of_each(const std::vector<Unit>& units, std::size_t classes) {
  std::vector<std::size_t> out(classes);
  for (const Unit& unit : units)
    for (const auto& entry : unit.held) ++out[entry.first];
  return out;
}

// Folds of every class, balanced only by the first class of each unit; empty if a class is then
// short.
std::vector<Fold> assigned_by_first_class(std::span<const std::size_t> of_row, std::size_t classes,
                                          std::span<const std::size_t> unit, std::size_t folds,
                                          std::uint64_t seed) {
  std::vector<Unit> units = gather_units(of_row, unit, std::vector<bool>(classes, true));
  const std::size_t k = std::min(folds, std::ranges::min(units_of_each(units, classes)));
  if (k < 2) return {};
  RandomEngine engine(seed);
  shuffle(units, engine);
  const Balance balance{numbers_below(classes)};
  std::vector<Fold> out = as_folds(deal(units, of_row.size(), k, balance), k);
  return short_classes(out, of_row, classes).empty() ? out : std::vector<Fold>{};
}

struct Assigned {
  std::vector<Fold> folds;
  std::vector<std::size_t>
      short_of;  // classes with too few training rows; empty: the folds are usable
};

// Folds of the classes `assigned`, all balanced, the one with the fewest units first. The number of
// folds is that of its units, or more if some class would be short.
Assigned assigned_by_all_classes(std::span<const std::size_t> of_row,
                                 const std::vector<bool>& assigned,
                                 std::span<const std::size_t> unit, std::size_t folds,
                                 std::uint64_t seed) {
  const std::size_t classes = assigned.size();
  std::vector<Unit> units = gather_units(of_row, unit, assigned);
  const std::vector<std::size_t> count = units_of_each(units, classes);
  std::size_t fewest = folds;
  std::vector<std::size_t> order = numbers_below(classes);
  std::ranges::stable_sort(order, {}, [&](std::size_t c) { return count[c]; });
  Balance balance{std::vector<std::size_t>(classes), classes};
  for (std::size_t i = 0; i < classes; ++i) balance.rank[order[i]] = i;
  for (std::size_t c = 0; c < classes; ++c)
    if (assigned[c]) fewest = std::min(fewest, count[c]);
  RandomEngine engine(seed);
  shuffle(units, engine);
  Assigned out;
  for (std::size_t k = fewest; k <= folds; ++k) {
    out.folds = as_folds(deal(units, of_row.size(), k, balance), k);
    out.short_of = short_classes(out.folds, of_row, classes);
    std::erase_if(out.short_of, [&](std::size_t c) { return !assigned[c]; });
    if (out.short_of.empty()) break;
  }
  return out;
}

std::string joined(const std::vector<std::string>& parts) {
  constexpr std::size_t most_named = 5;  // a reader does not need hundreds of labels
  std::string out;
  for (std::size_t i = 0; i < std::min(parts.size(), most_named); ++i)
    out += (i > 0 ? ", " : "") + parts[i];
  if (parts.size() > most_named)
    out += " and " + std::to_string(parts.size() - most_named) + " more";
  return out;
}

}  // namespace

ClassFolds class_folds(std::span<const std::size_t> of_row, const UnitLevels& levels,
                       std::size_t folds, std::uint64_t seed) {
  const auto rows = rows_by_class(of_row);
  const std::size_t classes = rows.size();
  if (classes < 2) return {{}, std::vector<std::size_t>(classes, levels.size())};
  ClassFolds out{assigned_by_first_class(of_row, classes, levels.front(), folds, seed),
                 std::vector<std::size_t>(classes)};
  if (!out.folds.empty()) return out;
  for (std::size_t c = 0; c < classes; ++c)
    out.level[c] = first_level(levels, rows[c], least_trained);
  while (true) {
    std::vector<bool> assigned(classes);
    for (std::size_t c = 0; c < classes; ++c) assigned[c] = out.tests(c, levels);
    if (std::ranges::count(assigned, true) < 2) return out;
    Assigned tried =
        assigned_by_all_classes(of_row, assigned, units_at(levels, of_row, out.level), folds, seed);
    if (tried.short_of.empty()) {
      out.folds = std::move(tried.folds);
      return out;
    }
    for (const std::size_t c : tried.short_of)
      out.level[c] = first_level(levels, rows[c], least_trained, out.level[c] + 1);
  }
}

ClassFolds class_folds(const FeatureMatrix& matrix, const TrainOptions& options) {
  return class_folds(find_classes(matrix).of_row, unit_levels(matrix, options.fold_unit),
                     options.folds, options.seed);
}

FoldReport fold_report(const FeatureMatrix& matrix, Learner learner, const TrainOptions& options) {
  const Classes classes = find_classes(matrix);
  const auto rows = rows_by_class(classes.of_row);
  const std::size_t levels = unit_levels(matrix, options.fold_unit).size();
  FoldReport out;
  out.folds = options.folds;
  for (const std::string& file : matrix.files)
    out.windows = out.windows || recording_of(file) != file;
  std::vector<std::size_t> level;
  if (is_cores(learner)) {
    level = units_by_label(matrix, options.fold_unit).level;
  } else {
    ClassFolds folds = class_folds(matrix, options);
    out.none = folds.folds.empty();
    level = std::move(folds.level);
  }
  for (std::size_t c = 0; c < level.size(); ++c) {
    const std::string& label = classes.labels[c];
    if (level[c] == levels) out.untested[label] = rows[c].size();
    if (level[c] == 0 || level[c] == levels || out.none) continue;
    out.finer[label] = level[c] + 1 == levels ? "window" : "recording";
  }
  return out;
}

std::string format_folds(const FoldReport& report) {
  const std::string unit = report.windows ? " windows" : " trials";
  std::vector<std::string> untested;
  for (const auto& [label, rows] : report.untested)
    untested.push_back(report.none ? "label " + label + " has " + std::to_string(rows) + unit
                                   : label + " (" + std::to_string(rows) + unit + ")");
  if (report.none)
    return "none: " + joined(untested) + ", too few for " + std::to_string(report.folds) +
           " folds that train on 2 of each";
  std::map<std::string, std::vector<std::string>> finer;
  for (const auto& [label, by] : report.finer) finer[by].push_back(label);
  std::string out;
  for (const auto& [by, labels] : finer)
    out += (out.empty() ? "" : ", ") + joined(labels) + " dealt by " + by;
  if (!untested.empty()) out += (out.empty() ? "" : ", ") + ("not tested: " + joined(untested));
  return out;
}

}  // namespace weft::classifier
