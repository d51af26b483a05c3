#include "classifier/evaluate/splits.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "classifier/base/random.hpp"
#include "classifier/features/trial.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t least_train = 2;  // trials of a label

using RowsOfLabel = std::map<std::string, std::vector<std::size_t>>;

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
                 .what = "no trial has this group",
                 .got = group,
                 .hint = "The manifest's column group lists them"});
  }
  return {};
}

// Rows of `recordings` recordings of every label, ascending.
Result<std::vector<std::size_t>> draw(
    const std::map<std::string, std::map<std::string, std::vector<std::size_t>>>& rows,
    std::size_t recordings, RandomEngine& engine) {
  std::vector<std::size_t> out;
  for (const auto& [label, of_label] : rows) {
    if (of_label.size() < recordings)
      return fail({.code = Errc::range,
                   .where = "label " + label,
                   .what = "not so many training recordings",
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

}  // namespace

SplitSizes size_of(const Split& split) {
  return {static_cast<double>(split.train.size()), static_cast<double>(split.test.size())};
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
                 .expected = "between 0 and 1",
                 .got = std::to_string(fraction)});
  }
  if (repeats == 0)
    return fail({.code = Errc::range,
                 .where = "repeats",
                 .what = "no repeats",
                 .expected = "at least 1",
                 .got = "0"});
  RowsOfLabel rows;
  for (std::size_t r = 0; r < labels.size(); ++r) rows[labels[r]].push_back(r);
  for (const auto& [label, members] : rows) {
    if (members.size() >= least_train) continue;
    return fail({.code = Errc::invalid_argument,
                 .where = "label " + label,
                 .what = "too few trials to split",
                 .expected = "at least 2",
                 .got = "1",
                 .hint = "Record more trials of it or leave it out"});
  }
  RandomEngine engine(seed);
  std::vector<Split> out;
  for (std::size_t i = 0; i < repeats; ++i) out.push_back(one_split(rows, fraction, engine));
  if (out.front().test.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "labels",
                 .what = "no trial is left to test: two of each label train",
                 .expected = "at least 3 trials of each",
                 .got = "2",
                 .hint = "Record more trials"});
  return out;
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
                 .what = "group is in both training and test",
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
                 .what = "the trials are not in groups",
                 .expected = "a group for every trial, at least two groups",
                 .got = std::to_string(distinct.size())});
  std::vector<Split> out;
  for (const std::string& left_out : distinct) {
    Split split;
    for (std::size_t r = 0; r < groups.size(); ++r) {
      if (groups[r] != left_out)
        split.train.push_back(r);
      else if (groups_of_label[labels[r]].size() > 1)
        split.test.push_back(r);
    }
    if (split.test.empty())
      return fail({.code = Errc::invalid_argument,
                   .where = "group " + left_out,
                   .what = "no other group has its labels"});
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
                 .what = "nothing to draw",
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
      out.push_back({std::move(*drawn), split.test});
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

}  // namespace weft::classifier
