#include "classifier/evaluate/splits.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "classifier/learn/random.hpp"

namespace weft::classifier {
namespace {

using RowsOfLabel = std::map<std::string, std::vector<std::size_t>>;

Split one_split(RowsOfLabel rows, double fraction, RandomEngine& engine) {
  Split out;
  for (auto& [label, members] : rows) {
    shuffle(members, engine);
    const double share = std::nearbyint(fraction * static_cast<double>(members.size()));
    const auto train = static_cast<std::ptrdiff_t>(std::max(2.0, share));
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
    return fail(Errc::invalid_argument, "no groups given", side, "at least one group");
  }
  for (const std::string& group : wanted) {
    if (contains(groups, group)) continue;
    return fail(Errc::not_found, "no trial has this group", side, {}, group,
                "The manifest's column group lists them");
  }
  return {};
}

}  // namespace

Result<std::vector<Split>> stratified_splits(std::span<const std::string> labels, double fraction,
                                             std::size_t repeats, std::uint64_t seed) {
  if (!(fraction > 0.0 && fraction < 1.0)) {
    return fail(Errc::range, "training fraction out of range", "train fraction", "between 0 and 1",
                std::to_string(fraction));
  }
  if (repeats == 0) return fail(Errc::range, "no repeats", "repeats", "at least 1", "0");
  RowsOfLabel rows;
  for (std::size_t r = 0; r < labels.size(); ++r) rows[labels[r]].push_back(r);
  for (const auto& [label, members] : rows) {
    if (members.size() >= 2) continue;
    return fail(Errc::invalid_argument, "too few trials to split", "label " + label, "at least 2",
                "1", "Record more trials of it or leave it out");
  }
  RandomEngine engine(seed);
  std::vector<Split> out;
  for (std::size_t i = 0; i < repeats; ++i) out.push_back(one_split(rows, fraction, engine));
  if (out.front().test.empty()) {
    return fail(Errc::range, "no trial is left to test", "train fraction", "a smaller fraction",
                std::to_string(fraction));
  }
  return out;
}

Result<Split> grouped_split(std::span<const std::string> groups,
                            std::span<const std::string> train_groups,
                            std::span<const std::string> test_groups) {
  if (auto ok = check_groups(groups, train_groups, "train groups"); !ok) return pass(ok.error());
  if (auto ok = check_groups(groups, test_groups, "test groups"); !ok) return pass(ok.error());
  for (const std::string& group : train_groups) {
    if (!contains(test_groups, group)) continue;
    return fail(Errc::invalid_argument, "group is in both training and test", "groups",
                "disjoint lists", group);
  }
  Split out;
  for (std::size_t r = 0; r < groups.size(); ++r) {
    if (contains(train_groups, groups[r])) out.train.push_back(r);
    if (contains(test_groups, groups[r])) out.test.push_back(r);
  }
  return out;
}

std::vector<std::string> permuted_labels(std::span<const std::string> labels, std::uint64_t seed) {
  std::vector<std::string> out(labels.begin(), labels.end());
  RandomEngine engine(seed);
  shuffle(out, engine);
  return out;
}

}  // namespace weft::classifier
