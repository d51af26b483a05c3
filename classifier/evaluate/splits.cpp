#include "classifier/evaluate/splits.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <vector>

#include "classifier/base/random.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/features/trial.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t least_train = 2;  // fewest training trials of a label

Split one_split(const RowsOfLabel& rows, double fraction, RandomEngine& engine) {
  Split out;
  for (const auto& entry : rows) {
    std::vector<std::size_t> members = entry.second;
    shuffle(members, engine);
    const auto most = std::max(least_train, members.size() - 1);
    const double share = std::nearbyint(fraction * static_cast<double>(members.size()));
    const auto train = static_cast<std::ptrdiff_t>(
        std::clamp(share, static_cast<double>(least_train), static_cast<double>(most)));
    out.train.insert(out.train.end(), members.begin(), members.begin() + train);
    out.test.insert(out.test.end(), members.begin() + train, members.end());
  }
  std::sort(out.train.begin(), out.train.end());
  std::sort(out.test.begin(), out.test.end());
  return out;
}

bool contains(std::span<const std::string> list, const std::string& item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

Status check_groups(std::span<const std::string> groups, std::span<const std::string> wanted,
                    const char* side) {
  if (wanted.empty()) {
    return fail({.code = Errc::invalid_argument,
                 .where = side,
                 .what = "no groups given",
                 .expected = "at least one group"});
  }
  for (const std::string& group : wanted) {
    if (contains(groups, group)) continue;
    return fail({.code = Errc::not_found,
                 .where = side,
                 .what = "group without trials",
                 .got = group,
                 .hint = "Use names of the manifest's group column; quote a name with a comma: "
                         "\"g0, left\""});
  }
  return {};
}

// Draws `recordings` recordings of every label; returns their rows, ascending.
Result<std::vector<std::size_t>> draw(
    const std::map<std::string, std::map<std::string, std::vector<std::size_t>>>& rows,
    std::size_t recordings, RandomEngine& engine) {
  std::vector<std::size_t> out;
  for (const auto& [label, of_label] : rows) {
    if (of_label.size() < recordings)
      return fail({.code = Errc::range,
                   .where = "label " + label,
                   .what = "number of training recordings too high",
                   .expected = "at most " + std::to_string(of_label.size()),
                   .got = std::to_string(recordings)});
    std::vector<std::string> names;
    for (const auto& entry : of_label) names.push_back(entry.first);
    shuffle(names, engine);
    for (std::size_t i = 0; i < recordings; ++i)
      out.insert(out.end(), of_label.at(names[i]).begin(), of_label.at(names[i]).end());
  }
  std::sort(out.begin(), out.end());
  return out;
}

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

// For every row, the first row with the same features.
std::vector<std::size_t> first_alike(const FeatureMatrix& matrix) {
  const auto before = [&matrix](std::size_t a, std::size_t b) {
    return std::ranges::lexicographical_compare(matrix.values.row(a), matrix.values.row(b));
  };
  std::map<std::size_t, std::size_t, decltype(before)> first(before);
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < matrix.size(); ++r) out.push_back(first.emplace(r, r).first->second);
  return out;
}

/// Finds the recordings that are copies of each other, by the rows that they share.
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
  // A copy has more than half of a recording's rows, so it has at least one of any half of them.
  // Only the rarer half of the rows is looked up; a window of silence in all recordings is skipped.
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

  std::vector<std::size_t> alike_, of_;  // per row
  std::vector<std::set<std::size_t>> rows_,
      copies_;  // per recording: its distinct rows, its copies
};

// First row of equal features -> recording -> one of its training rows with these features.
using Trained = std::map<std::size_t, std::map<std::size_t, std::size_t>>;

// The duplicate of a test row; one with another label if there is any.
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

std::set<std::string> labels_in(const FeatureMatrix& matrix, std::span<const std::size_t> rows) {
  std::set<std::string> out;
  for (const std::size_t r : rows) out.insert(matrix.labels[r]);
  return out;
}

SplitSizes size_of(const Split& split) {
  return {static_cast<double>(split.train.size()), static_cast<double>(split.test.size()),
          split.whole_group};
}

SplitSizes mean_sizes(std::span<const Split> splits) {
  std::vector<SplitSizes> sizes;
  for (const Split& split : splits) sizes.push_back(size_of(split));
  return mean_sizes(sizes);
}

Result<std::vector<Split>> stratified_splits(std::span<const std::string> labels, double fraction,
                                             std::size_t repeats, std::uint64_t seed) {
  if (!(fraction > 0.0 && fraction < 1.0)) {
    return fail({.code = Errc::range,
                 .where = "train fraction",
                 .what = "training fraction out of range",
                 .expected = "above 0 and below 1",
                 .got = std::to_string(fraction)});
  }
  if (repeats == 0)
    return fail({.code = Errc::range,
                 .where = "repeats",
                 .what = "too few repeats",
                 .expected = "at least 1",
                 .got = "0"});
  RowsOfLabel rows;
  for (std::size_t r = 0; r < labels.size(); ++r) rows[labels[r]].push_back(r);
  for (const auto& [label, members] : rows) {
    if (members.size() >= least_train) continue;
    return fail({.code = Errc::invalid_argument,
                 .where = "label " + label,
                 .what = "too few trials for a split",
                 .expected = "at least 2",
                 .got = "1",
                 .hint = "Record more trials of this label or remove the label"});
  }
  RandomEngine engine(seed);
  std::vector<Split> out;
  for (std::size_t i = 0; i < repeats; ++i) out.push_back(one_split(rows, fraction, engine));
  if (out.front().test.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "labels",
                 .what = "too few trials to leave some for the test",
                 .expected = "at least 3 per label",
                 .got = "2",
                 .hint = "Record more trials"});
  return out;
}

std::vector<std::string> groups_on_both_sides(std::span<const Split> splits,
                                              std::span<const std::string> groups) {
  std::set<std::string> out;
  for (const Split& split : splits) {
    std::set<std::string> trained;
    for (const std::size_t r : split.train) trained.insert(groups[r]);
    for (const std::size_t r : split.test)
      if (!groups[r].empty() && trained.contains(groups[r])) out.insert(groups[r]);
  }
  return {out.begin(), out.end()};
}

Result<Split> grouped_split(std::span<const std::string> groups,
                            std::span<const std::string> train_groups,
                            std::span<const std::string> test_groups) {
  if (auto ok = check_groups(groups, train_groups, "train groups"); !ok) return pass(ok.error());
  if (auto ok = check_groups(groups, test_groups, "test groups"); !ok) return pass(ok.error());
  for (const std::string& group : train_groups) {
    if (!contains(test_groups, group)) continue;
    return fail({.code = Errc::invalid_argument,
                 .where = "groups",
                 .what = "group in both training and test",
                 .expected = "disjoint lists",
                 .got = group});
  }
  Split out;
  for (std::size_t r = 0; r < groups.size(); ++r) {
    if (contains(train_groups, groups[r])) out.train.push_back(r);
    if (contains(test_groups, groups[r])) out.test.push_back(r);
  }
  return out;
}

Result<std::vector<Split>> leave_one_group_out(std::span<const std::string> groups,
                                               std::span<const std::string> labels) {
  std::map<std::string, std::set<std::string>> groups_of_label;
  const std::set<std::string> distinct(groups.begin(), groups.end());
  for (std::size_t r = 0; r < groups.size(); ++r) groups_of_label[labels[r]].insert(groups[r]);
  if (distinct.size() < 2 || distinct.count("") != 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "leave one group out",
                 .what = "too few groups, or trials without group",
                 .expected = "at least 2, and a group for every trial",
                 .got = std::to_string(distinct.size())});
  std::vector<Split> out;
  for (const std::string& left_out : distinct) {
    Split split;
    split.whole_group = true;
    for (std::size_t r = 0; r < groups.size(); ++r) {
      if (groups[r] != left_out)
        split.train.push_back(r);
      else if (groups_of_label[labels[r]].size() > 1)
        split.test.push_back(r);
    }
    if (split.test.empty())
      return fail({.code = Errc::invalid_argument,
                   .where = "group " + left_out,
                   .what = "labels occur in no other group",
                   .expected = "a label that other groups have too",
                   .hint = "Record each label in at least two groups"});
    out.push_back(std::move(split));
  }
  return out;
}

std::vector<NeverTested> never_tested(std::span<const Split> splits,
                                      std::span<const std::string> labels,
                                      std::span<const std::string> groups,
                                      std::span<const std::string> files) {
  std::set<std::string> tested;
  for (const Split& split : splits)
    for (const std::size_t r : split.test) tested.insert(labels[r]);
  std::map<std::string, std::set<std::string>> extract_recordings, groups_of;
  for (std::size_t r = 0; r < labels.size(); ++r) {
    if (tested.contains(labels[r])) continue;
    extract_recordings[labels[r]].insert(recording_of(files[r], r));
    groups_of[labels[r]].insert(groups[r]);
  }
  std::vector<NeverTested> out;
  for (const auto& [label, own] : extract_recordings) {
    const std::set<std::string>& in = groups_of[label];
    out.push_back({label, own.size(), in.size() == 1 ? *in.begin() : std::string()});
  }
  return out;
}

Result<std::vector<Split>> thinned(std::span<const Split> splits,
                                   std::span<const std::string> labels,
                                   std::span<const std::string> files, std::size_t recordings,
                                   std::size_t draws, std::uint64_t seed) {
  if (recordings == 0 || draws == 0)
    return fail({.code = Errc::range,
                 .where = "learning curve",
                 .what = "too few recordings or draws",
                 .expected = "at least 1",
                 .got = "0"});
  RandomEngine engine(seed);
  std::vector<Split> out;
  for (const Split& split : splits) {
    std::map<std::string, std::map<std::string, std::vector<std::size_t>>> rows;
    for (const std::size_t r : split.train) rows[labels[r]][recording_of(files[r], r)].push_back(r);
    for (std::size_t d = 0; d < draws; ++d) {
      auto drawn = draw(rows, recordings, engine);
      if (!drawn) return pass(drawn.error());
      out.push_back({std::move(*drawn), split.test, split.whole_group});
    }
  }
  return out;
}

std::vector<std::string> permuted_labels(std::span<const std::string> labels, std::uint64_t seed) {
  std::vector<std::string> out(labels.begin(), labels.end());
  RandomEngine engine(seed);
  shuffle(out, engine);
  return out;
}

std::size_t Confusion::total() const {
  return std::accumulate(count.begin(), count.end(), std::size_t{0});
}

std::size_t Confusion::correct() const {
  std::size_t sum = 0;
  for (std::size_t k = 0; k < classes(); ++k) sum += at(k, k);
  return sum;
}

double Confusion::accuracy() const {
  return share(correct(), total());
}

std::size_t Confusion::tested(std::size_t truth) const {
  std::size_t trials = 0;
  for (std::size_t p = 0; p < classes(); ++p) trials += at(truth, p);
  return trials;
}

std::vector<double> Confusion::recall() const {
  std::vector<double> out;
  for (std::size_t t = 0; t < classes(); ++t) out.push_back(share(at(t, t), tested(t)));
  return out;
}

double Confusion::balanced_accuracy() const {
  double sum = 0.0;
  std::size_t number = 0;
  for (std::size_t t = 0; t < classes(); ++t) {
    if (tested(t) == 0) continue;
    sum += share(at(t, t), tested(t));
    ++number;
  }
  return number == 0 ? 0.0 : sum / static_cast<double>(number);
}

double Confusion::base_rate() const {
  std::size_t most = 0;
  for (std::size_t t = 0; t < classes(); ++t) most = std::max(most, tested(t));
  return share(most, total());
}

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
