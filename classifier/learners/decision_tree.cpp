#include "classifier/learners/decision_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace weft::classifier {

RankedRows::RankedRows(const Matrix& rows, std::span<const std::size_t> of_row, std::size_t classes)
    : rows_(rows.rows()),
      features_(rows.cols()),
      classes_(classes),
      class_(of_row.begin(), of_row.end()),
      rank_(rows_ * features_),
      value_(rows_ * features_) {
  std::vector<std::uint32_t> order(rows_);
  for (std::size_t f = 0; f < features_; ++f) {
    std::iota(order.begin(), order.end(), 0U);
    const auto of = [&](std::uint32_t r) { return rows(r, f); };
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return of(a) < of(b); });
    std::uint32_t rank = 0;
    for (std::size_t i = 0; i < rows_; ++i) {
      if (i > 0 && of(order[i]) > of(order[i - 1])) ++rank;
      rank_[f * rows_ + order[i]] = rank;
      value_[f * rows_ + rank] = of(order[i]) + 0.0;  // -0 and 0 are one value
    }
  }
}

std::uint32_t RankedRows::last_at_most(std::size_t feature, std::uint32_t low, std::uint32_t high,
                                       double threshold) const {
  const auto first = value_.begin() + static_cast<std::ptrdiff_t>(feature * rows_);
  const auto above = std::upper_bound(first + low, first + high + 1, threshold);
  return static_cast<std::uint32_t>(above - first) - 1;
}

namespace {

struct NodeSplit {
  bool found = false;
  std::size_t feature = 0;
  std::uint32_t last_left = 0;  // rank
  double threshold = 0.0;
  double purity = 0.0;  // sum over both sides of squared class counts divided by the rows
};

constexpr std::size_t most_nodes = 1'000'000'000;  // with its children the number fits into 32 bits

double squared_over(double squares, std::size_t rows) {
  return squares / static_cast<double>(rows);
}

}  // namespace

/// Grows one tree; reuses its lists from node to node.
class TreeGrower {
 public:
  TreeGrower(const RankedRows& rows, std::vector<std::uint32_t> chosen, const SplitRule& rule,
             RandomEngine& engine)
      : rows_(rows),
        chosen_(std::move(chosen)),
        rule_(rule),
        engine_(engine),
        order_(rows.features()),
        total_(rows.classes()),
        left_(rows.classes()),
        gain_(rows.features(), 0.0) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    tree_.classes_ = rows.classes();
  }

  DecisionTree grow(std::span<double> importance) {
    tree_.nodes_.emplace_back();
    std::vector<Part> waiting = {{0, 0, chosen_.size()}};
    while (!waiting.empty()) {
      const Part part = waiting.back();
      waiting.pop_back();
      count(part);
      const NodeSplit split = pure(part) ? NodeSplit{} : best_split(part);
      if (!split.found) {
        make_leaf(part);
        continue;
      }
      const std::size_t middle = divide(part, split);
      gain_[split.feature] += split.purity - squared_over(squares_of_total(), part.size());
      const auto child = static_cast<std::uint32_t>(tree_.nodes_.size());
      tree_.nodes_[part.node] = {split.threshold, static_cast<std::int32_t>(split.feature), child};
      tree_.nodes_.resize(tree_.nodes_.size() + 2);
      waiting.push_back({child + 1, middle, part.to});
      waiting.push_back({child, part.from, middle});
    }
    add_importance(importance);
    return std::move(tree_);
  }

 private:
  struct Part {
    std::size_t node, from, to;  // from, to: range in chosen_
    [[nodiscard]] std::size_t size() const { return to - from; }
  };

  void count(const Part& part) {
    std::fill(total_.begin(), total_.end(), 0U);
    for (std::size_t i = part.from; i < part.to; ++i) ++total_[rows_.class_of(chosen_[i])];
  }
  [[nodiscard]] bool pure(const Part& part) const {
    return *std::max_element(total_.begin(), total_.end()) == part.size();
  }
  [[nodiscard]] double squares_of_total() const {
    double sum = 0.0;
    for (const std::uint32_t n : total_) sum += static_cast<double>(n) * static_cast<double>(n);
    return sum;
  }

  // Tests features in random order, until enough were tested and one of them differed.
  NodeSplit best_split(const Part& part) {
    NodeSplit best;
    for (std::size_t k = 0; k < order_.size() && (k < rule_.tried || !best.found); ++k) {
      std::swap(order_[k], order_[k + random_below(engine_, order_.size() - k)]);
      if (rule_.random_threshold)
        draw_at(order_[k], part, best);
      else
        check_feature(order_[k], part, best);
    }
    return best;
  }

  // The smallest impurity has the largest sum over both sides of squared class counts divided by
  // rows.
  void check_feature(std::size_t feature, const Part& part, NodeSplit& best) {
    keys_.clear();
    for (std::size_t i = part.from; i < part.to; ++i)
      keys_.push_back(std::uint64_t{rows_.rank(feature, chosen_[i])} << 32U |
                      rows_.class_of(chosen_[i]));
    std::sort(keys_.begin(), keys_.end());
    if (keys_.front() >> 32U == keys_.back() >> 32U) return;
    std::fill(left_.begin(), left_.end(), 0U);
    double left = 0.0, right = squares_of_total();
    for (std::size_t i = 0; i + 1 < keys_.size(); ++i) {
      const auto c = static_cast<std::uint32_t>(keys_[i]);
      left += 2.0 * left_[c] + 1.0;
      right -= 2.0 * (total_[c] - left_[c]) - 1.0;
      ++left_[c];
      const auto here = static_cast<std::uint32_t>(keys_[i] >> 32U),
                 next = static_cast<std::uint32_t>(keys_[i + 1] >> 32U);
      if (here == next) continue;
      const double purity = squared_over(left, i + 1) + squared_over(right, keys_.size() - i - 1);
      if (!best.found || purity > best.purity)
        best = {true, feature, here, middle(feature, here, next), purity};
    }
  }

  [[nodiscard]] double middle(std::size_t feature, std::uint32_t here, std::uint32_t next) const {
    const double low = rows_.value(feature, here), high = rows_.value(feature, next);
    const double between = 0.5 * low + 0.5 * high;
    return between < high ? between : low;
  }

  // One random threshold between the least and the largest value.
  void draw_at(std::size_t feature, const Part& part, NodeSplit& best) {
    std::uint32_t low = rows_.rank(feature, chosen_[part.from]), high = low;
    for (std::size_t i = part.from + 1; i < part.to; ++i) {
      const std::uint32_t rank = rows_.rank(feature, chosen_[i]);
      low = std::min(low, rank);
      high = std::max(high, rank);
    }
    if (low == high) return;
    const double least = rows_.value(feature, low), largest = rows_.value(feature, high);
    const double drawn = least + random_unit(engine_) * (largest - least);
    const double threshold = drawn < largest ? drawn : least;  // rounding may reach the end
    const std::uint32_t last = rows_.last_at_most(feature, low, high, threshold);
    const double purity = purity_of(feature, part, last);
    if (!best.found || purity > best.purity) best = {true, feature, last, threshold, purity};
  }

  double purity_of(std::size_t feature, const Part& part, std::uint32_t last_left) {
    std::fill(left_.begin(), left_.end(), 0U);
    std::size_t on_left = 0;
    for (std::size_t i = part.from; i < part.to; ++i) {
      if (rows_.rank(feature, chosen_[i]) > last_left) continue;
      ++left_[rows_.class_of(chosen_[i])];
      ++on_left;
    }
    double left = 0.0, right = 0.0;
    for (std::size_t c = 0; c < left_.size(); ++c) {
      left += static_cast<double>(left_[c]) * left_[c];
      right += static_cast<double>(total_[c] - left_[c]) * (total_[c] - left_[c]);
    }
    return squared_over(left, on_left) + squared_over(right, part.size() - on_left);
  }

  std::size_t divide(const Part& part, const NodeSplit& split) {
    const auto begin = chosen_.begin();
    const auto middle = std::partition(
        begin + static_cast<std::ptrdiff_t>(part.from),
        begin + static_cast<std::ptrdiff_t>(part.to),
        [&](std::uint32_t row) { return rows_.rank(split.feature, row) <= split.last_left; });
    return static_cast<std::size_t>(middle - begin);
  }

  void make_leaf(const Part& part) {
    DecisionTree::Node& leaf = tree_.nodes_[part.node];
    if (pure(part)) {
      leaf.child = rows_.class_of(chosen_[part.from]);
      return;
    }
    leaf.child = static_cast<std::uint32_t>(total_.size() + tree_.shares_.size() / total_.size());
    for (const std::uint32_t n : total_)
      tree_.shares_.push_back(static_cast<double>(n) / static_cast<double>(part.size()));
  }

  void add_importance(std::span<double> importance) const {
    const double sum = std::accumulate(gain_.begin(), gain_.end(), 0.0);
    if (importance.empty() || sum <= 0.0) return;
    for (std::size_t f = 0; f < gain_.size(); ++f) importance[f] += gain_[f] / sum;
  }

  const RankedRows& rows_;
  std::vector<std::uint32_t> chosen_;
  SplitRule rule_;
  RandomEngine& engine_;
  std::vector<std::size_t> order_;
  std::vector<std::uint32_t> total_, left_;
  std::vector<std::uint64_t> keys_;
  std::vector<double> gain_;
  DecisionTree tree_;
};

DecisionTree DecisionTree::grow(const RankedRows& rows, std::vector<std::uint32_t> chosen,
                                const SplitRule& rule, RandomEngine& engine,
                                std::span<double> importance) {
  return TreeGrower(rows, std::move(chosen), rule, engine).grow(importance);
}

void DecisionTree::add_shares(std::span<const double> features, std::span<double> shares) const {
  const Node* node = nodes_.data();
  while (node->feature >= 0)
    node = nodes_.data() + node->child +
           (features[static_cast<std::size_t>(node->feature)] <= node->threshold ? 0 : 1);
  if (node->child < classes_) {
    shares[node->child] += 1.0;
    return;
  }
  const double* const own = shares_.data() + (node->child - classes_) * classes_;
  for (std::size_t c = 0; c < classes_; ++c) shares[c] += own[c];
}

void DecisionTree::add_features(std::set<std::size_t>& features) const {
  for (const Node& node : nodes_)
    if (node.feature >= 0) features.insert(static_cast<std::size_t>(node.feature));
}

void DecisionTree::write(LineWriter& out) const {
  std::vector<std::size_t> feature, child;
  std::vector<double> threshold;
  for (const Node& node : nodes_) {
    feature.push_back(static_cast<std::size_t>(node.feature + 1));  // 0: a leaf
    child.push_back(node.child);
    if (node.feature >= 0) threshold.push_back(node.threshold);
  }
  out.count("nodes", nodes_.size());
  out.counts("feature", feature);
  out.counts("child", child);
  out.numbers("threshold", threshold);
  out.count("mixed_leaves", shares_.size() / classes_);
  out.numbers("shares", shares_);
}

namespace {

std::string short_text(double value) {
  std::array<char, 32> out{};
  std::snprintf(out.data(), out.size(), "%.3g", value);
  return out.data();
}

// Checks the shares of each impure leaf: none below 0, sum 1 up to rounding.
void check_shares(LineReader& in, std::span<const double> shares, std::size_t classes) {
  constexpr double rounding = 1e-9;
  for (std::size_t from = 0; from < shares.size(); from += classes) {
    const auto own = shares.subspan(from, classes);
    const double least = *std::min_element(own.begin(), own.end());
    const double off = std::accumulate(own.begin(), own.end(), -1.0);
    if (least < 0.0 || !(std::abs(off) <= rounding))
      return in.refuse("shares of a leaf are not a distribution", "at least 0, sum 1",
                       "least " + short_text(least) + ", sum 1 and " + short_text(off));
  }
}

// Children come after their parents, so every path ends.
void check_branches(LineReader& in, std::span<const std::size_t> feature,
                    std::span<const std::size_t> child) {
  for (std::size_t i = 0; i < child.size(); ++i)
    if (feature[i] != 0 && (child[i] <= i || child[i] >= child.size() - 1))
      return in.refuse("invalid child of node " + std::to_string(i),
                       "two later nodes of " + std::to_string(child.size()),
                       std::to_string(child[i]));
}

// A leaf refers to its class, or to its shares after the classes.
void check_leaves(LineReader& in, std::span<const std::size_t> feature,
                  std::span<const std::size_t> child, std::size_t most) {
  for (std::size_t i = 0; i < child.size(); ++i)
    if (feature[i] == 0 && child[i] >= most)
      return in.refuse("class of leaf " + std::to_string(i) + " out of range",
                       "less than " + std::to_string(most), std::to_string(child[i]));
}

}  // namespace

DecisionTree DecisionTree::read(LineReader& in, std::size_t features, std::size_t classes) {
  DecisionTree out;
  out.classes_ = classes;
  const std::size_t nodes = in.count("nodes", 1, most_nodes);
  const auto feature = in.counts("feature", nodes);
  in.within(feature, features + 1, "feature");
  const auto child = in.counts("child", nodes);
  if (in.ok()) check_branches(in, feature, child);
  const auto leaves = static_cast<std::size_t>(std::ranges::count(feature, std::size_t{0}));
  const auto threshold = in.numbers("threshold", nodes - std::min(leaves, nodes));
  const std::size_t mixed = in.count("mixed_leaves", 0, leaves);
  if (in.ok()) check_leaves(in, feature, child, classes + mixed);
  out.shares_ = in.numbers("shares", mixed * classes);
  if (!in.ok()) return out;
  check_shares(in, out.shares_, classes);
  std::size_t split = 0;
  for (std::size_t i = 0; i < nodes; ++i) {
    const bool leaf = feature[i] == 0;
    out.nodes_.push_back({leaf ? 0.0 : threshold[split], static_cast<std::int32_t>(feature[i]) - 1,
                          static_cast<std::uint32_t>(child[i])});
    split += leaf ? 0 : 1;
  }
  return out;
}

std::size_t features_of_a_split(std::size_t features) {
  return static_cast<std::size_t>(
      std::max(1.0, std::floor(std::sqrt(static_cast<double>(features)))));
}

RandomEngine engine_of_tree(std::uint64_t seed, std::size_t tree) {
  std::seed_seq seeds{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                      static_cast<std::uint32_t>(tree)};
  return RandomEngine(seeds);
}

}  // namespace weft::classifier
