#pragma once
// Tables of text in columns, for terminals.

#include <string>
#include <vector>

#include "classifier/evaluate/splits.hpp"

namespace weft::daemon::cli {

enum class Align { left, right };

/// Columns as wide as their widest cell, two blanks between them; the first is flush left, the
/// others as `others` says: right for numbers, left for facts. Rows may be of different lengths.
class Table {
 public:
  explicit Table(Align others = Align::right) : others_(others) {}
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  /// Every line starts with `indent`.
  [[nodiscard]] std::string text(const std::string& indent = "  ") const;

 private:
  Align others_;
  std::vector<std::vector<std::string>> rows_;
};

/// Counts of a confusion matrix: a row per true label, a column per answer, recall at the end.
/// Zeros are dots, so that mistakes stand out.
/// A label that no trial tested has no recall: "-".
std::string confusion_text(const classifier::Confusion& confusion);

}  // namespace weft::daemon::cli
