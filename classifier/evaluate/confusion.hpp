#pragma once
// Confusion matrices and what is read from them.

#include <cstddef>
#include <string>
#include <vector>

namespace weft::classifier {

/// count[t x classes + p]: trials of class t that were taken for class p.
struct Confusion {
  std::vector<std::string> labels;
  std::vector<std::size_t> count;

  explicit Confusion(std::vector<std::string> names)
      : labels(std::move(names)), count(labels.size() * labels.size()) {}

  [[nodiscard]] std::size_t classes() const { return labels.size(); }
  std::size_t& at(std::size_t truth, std::size_t predicted) {
    return count[truth * classes() + predicted];
  }
  [[nodiscard]] std::size_t at(std::size_t truth, std::size_t predicted) const {
    return count[truth * classes() + predicted];
  }
  [[nodiscard]] std::size_t total() const;
  [[nodiscard]] std::size_t correct() const;
  /// Share of correct trials; 0 without trials.
  [[nodiscard]] double accuracy() const;
  /// Share of each class's trials that were recognised; 0 for a class without trials.
  [[nodiscard]] std::vector<double> recall() const;
};

}  // namespace weft::classifier
