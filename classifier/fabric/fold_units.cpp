#include "classifier/fabric/fold_units.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <string>

#include "classifier/features/trial.hpp"

namespace weft::classifier {

std::vector<std::size_t> row_units(const FeatureMatrix& matrix, FoldUnit kind) {
  std::map<std::string, std::size_t> number;
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const std::string_view unit =
        kind == FoldUnit::group ? matrix.groups[r] : recording_of(matrix.files[r]);
    // rows without a name are recordings of their own
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

std::vector<std::vector<std::size_t>> rows_by_class(std::span<const std::size_t> of_row) {
  std::vector<std::vector<std::size_t>> out;
  for (std::size_t r = 0; r < of_row.size(); ++r) {
    if (of_row[r] >= out.size()) out.resize(of_row[r] + 1);
    out[of_row[r]].push_back(r);
  }
  return out;
}

UnitLevels unit_levels(const FeatureMatrix& matrix, FoldUnit kind) {
  UnitLevels out{row_units(matrix, kind)};
  if (kind == FoldUnit::group) out.push_back(row_units(matrix, FoldUnit::recording));
  std::vector<std::size_t> single(matrix.size());
  std::iota(single.begin(), single.end(), std::size_t{0});
  out.push_back(std::move(single));
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

}  // namespace weft::classifier
