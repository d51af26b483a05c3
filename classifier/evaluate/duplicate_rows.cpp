#include "classifier/evaluate/duplicate_rows.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "classifier/features/trial.hpp"

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
    copies_.resize(rows_.size());
    find_copies();
  }

  [[nodiscard]] std::size_t alike(std::size_t row) const { return alike_[row]; }
  [[nodiscard]] std::size_t of(std::size_t row) const { return of_[row]; }
  [[nodiscard]] const std::set<std::size_t>& copies(std::size_t recording) const {
    return copies_[recording];
  }

 private:
  // Who has more than half of a recording's rows has one of any half of them: those that fewest
  // recordings have are looked up, so that a window of silence in all is not.
  void find_copies() {
    std::map<std::size_t, std::vector<std::size_t>> holders;
    for (std::size_t a = 0; a < rows_.size(); ++a)
      for (const std::size_t row : rows_[a]) holders[row].push_back(a);
    for (std::size_t a = 0; a < rows_.size(); ++a) {
      std::vector<std::size_t> rarest(rows_[a].begin(), rows_[a].end());
      std::ranges::stable_sort(rarest, {}, [&](std::size_t row) { return holders[row].size(); });
      rarest.resize((rarest.size() + 1) / 2);
      std::set<std::size_t> others;
      for (const std::size_t row : rarest) others.insert(holders[row].begin(), holders[row].end());
      for (const std::size_t b : others)
        if (a != b && have_most_in_common(a, b)) {
          copies_[a].insert(b);
          copies_[b].insert(a);
        }
    }
  }

  [[nodiscard]] bool have_most_in_common(std::size_t a, std::size_t b) const {
    std::vector<std::size_t> common;
    std::ranges::set_intersection(rows_[a], rows_[b], std::back_inserter(common));
    return 2 * common.size() > std::min(rows_[a].size(), rows_[b].size());
  }

  std::vector<std::size_t> alike_, of_;               // per row
  std::vector<std::set<std::size_t>> rows_, copies_;  // per recording: its different rows
};

// A training row for each recording that has one like it, by the first row like them.
using Trained = std::map<std::size_t, std::map<std::size_t, std::size_t>>;

// The twin of a test row: one of another label if there is any.
std::optional<std::size_t> find_duplicate(std::size_t row, const FeatureMatrix& matrix,
                                          const Trained& trained, const Recordings& recordings) {
  const auto like_it = trained.find(recordings.alike(row));
  if (like_it == trained.end()) return std::nullopt;
  std::optional<std::size_t> out;
  for (const std::size_t copy : recordings.copies(recordings.of(row))) {
    const auto at = like_it->second.find(copy);
    if (at == like_it->second.end()) continue;
    const std::size_t duplicate = at->second;
    if (matrix.labels[duplicate] != matrix.labels[row]) return duplicate;
    if (!out) out = duplicate;
  }
  return out;
}

}  // namespace

DuplicateRows find_duplicates(const FeatureMatrix& matrix, std::span<const Split> splits) {
  const Recordings recordings(matrix);
  DuplicateRows out;
  for (const Split& split : splits) {
    Trained trained;
    for (const std::size_t r : split.train)
      trained[recordings.alike(r)].emplace(recordings.of(r), r);
    for (const std::size_t r : split.test) {
      ++out.tested;
      const auto duplicate = find_duplicate(r, matrix, trained, recordings);
      if (!duplicate) continue;
      const bool contradicts = matrix.labels[*duplicate] != matrix.labels[r];
      ++out.found;
      out.contradicting += contradicts ? 1U : 0U;
      if (out.found > 1 && !(contradicts && out.contradicting == 1)) continue;
      out.test = matrix.files[r];
      out.train = matrix.files[*duplicate];
    }
  }
  return out;
}

}  // namespace weft::classifier
