#include "classifier/evaluate/twins.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "classifier/features/windows.hpp"

namespace weft::classifier {
namespace {

// The first of the rows with the same features, for every row.
std::vector<std::size_t> first_alike(const FeatureMatrix& matrix) {
  const auto before = [&matrix](std::size_t a, std::size_t b) {
    return std::ranges::lexicographical_compare(matrix.values.row(a), matrix.values.row(b));
  };
  std::map<std::size_t, std::size_t, decltype(before)> first(before);
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < matrix.size(); ++r) out.push_back(first.emplace(r, r).first->second);
  return out;
}

/// Which recordings are copies of each other, by the rows that they have in common.
class Recordings {
 public:
  explicit Recordings(const FeatureMatrix& matrix) : alike_(first_alike(matrix)) {
    std::map<std::string, std::size_t> number;
    for (std::size_t r = 0; r < matrix.size(); ++r) {
      of_.push_back(number.emplace(recording_of(matrix.files[r], r), number.size()).first->second);
      rows_.resize(number.size());
      rows_[of_[r]].insert(alike_[r]);
    }
  }

  [[nodiscard]] std::size_t alike(std::size_t row) const { return alike_[row]; }
  [[nodiscard]] std::size_t of(std::size_t row) const { return of_[row]; }

  bool are_copies(std::size_t a, std::size_t b) {
    if (a == b) return false;
    const auto [at, is_new] = copies_.emplace(std::minmax(a, b), false);
    if (!is_new) return at->second;
    std::vector<std::size_t> common;
    std::ranges::set_intersection(rows_[a], rows_[b], std::back_inserter(common));
    at->second = 2 * common.size() > std::min(rows_[a].size(), rows_[b].size());
    return at->second;
  }

 private:
  std::vector<std::size_t> alike_, of_;      // per row
  std::vector<std::set<std::size_t>> rows_;  // per recording: its different rows
  std::map<std::pair<std::size_t, std::size_t>, bool> copies_;
};

// A training row for each recording that has one like it, by the first row like them.
using Trained = std::map<std::size_t, std::map<std::size_t, std::size_t>>;

// The twin of a test row: one of another label if there is any.
std::optional<std::size_t> twin_of(std::size_t row, const FeatureMatrix& matrix,
                                   const Trained& trained, Recordings& recordings) {
  const auto like_it = trained.find(recordings.alike(row));
  if (like_it == trained.end()) return std::nullopt;
  std::optional<std::size_t> out;
  for (const auto& [recording, twin] : like_it->second) {
    if (!recordings.are_copies(recordings.of(row), recording)) continue;
    if (matrix.labels[twin] != matrix.labels[row]) return twin;
    if (!out) out = twin;
  }
  return out;
}

}  // namespace

Twins twins_of(const FeatureMatrix& matrix, std::span<const Split> splits) {
  Recordings recordings(matrix);
  Twins out;
  for (const Split& split : splits) {
    Trained trained;
    for (const std::size_t r : split.train)
      trained[recordings.alike(r)].emplace(recordings.of(r), r);
    for (const std::size_t r : split.test) {
      ++out.tested;
      const auto twin = twin_of(r, matrix, trained, recordings);
      if (!twin) continue;
      const bool contradicts = matrix.labels[*twin] != matrix.labels[r];
      ++out.found;
      out.contradicting += contradicts ? 1U : 0U;
      if (out.found > 1 && !(contradicts && out.contradicting == 1)) continue;
      out.test = matrix.files[r];
      out.train = matrix.files[*twin];
    }
  }
  return out;
}

}  // namespace weft::classifier
