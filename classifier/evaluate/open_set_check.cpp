#include "classifier/evaluate/open_set_check.hpp"

#include <map>
#include <set>

#include "classifier/vote/postprocessing.hpp"

namespace weft::classifier {
namespace {

class Tally {
 public:
  Tally(const FeatureMatrix& matrix, const TrainOptions& options)
      : matrix_(matrix), options_(options) {}

  // The calls of leave_out() that follow belong to a new split.
  void begin_split() { by_split_.emplace_back(); }

  // Novelty is measured on the learner's own columns, as in a stored model.
  Status leave_out(const std::string& label, const Split& split, Recipe recipe) {
    const FeatureMatrix own =
        recipe.columns.empty() ? matrix_ : select_columns(matrix_, recipe.columns);
    recipe.columns.clear();
    std::vector<std::size_t> rest;
    for (const std::size_t r : split.train)
      if (matrix_.labels[r] != label) rest.push_back(r);
    const FeatureMatrix known = select_rows(own, rest);
    const auto trained = train_recipe(known, recipe, options_);
    if (!trained) return pass(trained.error());
    const auto postprocessing = fit_postprocessing(*trained, known, options_);
    if (!postprocessing) return pass(postprocessing.error());
    if (!*postprocessing) {
      not_measured_.insert(label);
      return {};
    }
    for (const std::size_t r : split.test) {
      const auto predicted = predict(*trained, *postprocessing, own.values.row(r));
      if (!predicted) return pass(predicted.error(), matrix_.files[r]);
      count(r, matrix_.labels[r] == label, predicted->none_of_these);
    }
    return {};
  }

  [[nodiscard]] Result<OpenSetCheck> finish(const SplitSizes& sizes) const {
    if (unknown_labels_.empty() && known_ == 0)
      return fail({.code = Errc::invalid_argument,
                   .where = "open-set check",
                   .what = "too few training trials for the open-set check",
                   .expected = "two labels besides the held-out one with enough trials for folds",
                   .hint = "Train with more trials of each label"});
    OpenSetCheck out;
    out.not_measured.assign(not_measured_.begin(), not_measured_.end());
    std::size_t answers = 0, accepted = 0;
    for (const auto& [label, one] : unknown_labels_) {
      out.unknown_labels.push_back(one);
      out.unknown_labels.back().trials = rows_.at(label).size();
      answers += one.answers;
      accepted += one.accepted;
    }
    const auto share = [](std::size_t part, std::size_t whole) {
      return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
    };
    out.false_accept = share(accepted, answers);
    out.false_accept_ci95 = split_interval(by_split_, sizes);
    out.false_reject = share(refused_, known_);
    return out;
  }

 private:
  void count(std::size_t row, bool unknown_label, bool refused) {
    if (unknown_label) {
      UnknownLabel& one = unknown_labels_[matrix_.labels[row]];
      one.label = matrix_.labels[row];
      rows_[one.label].insert(row);
      ++one.answers;
      one.accepted += refused ? 0 : 1;
      by_split_.back().whole += 1.0;
      by_split_.back().part += refused ? 0.0 : 1.0;
    } else {
      ++known_;
      refused_ += refused ? 1 : 0;
    }
  }

  const FeatureMatrix& matrix_;
  const TrainOptions& options_;
  std::map<std::string, UnknownLabel> unknown_labels_;
  std::map<std::string, std::set<std::size_t>> rows_;  // distinct test rows of each unknown label
  std::vector<SplitShare> by_split_;
  std::set<std::string> not_measured_;
  std::size_t known_ = 0, refused_ = 0;
};

}  // namespace

Status check_labels_can_be_left_out(const FeatureMatrix& matrix, std::span<const Split> splits) {
  for (const Split& split : splits) {
    const std::size_t labels = labels_in(matrix, split.train).size();
    if (labels < 3)
      return fail({.code = Errc::invalid_argument,
                   .where = "open-set check",
                   .what = "too few fabrics for the open-set check",
                   .expected = "at least 3",
                   .got = std::to_string(labels)});
  }
  return {};
}

Result<OpenSetCheck> check_open_set(const FeatureMatrix& matrix, std::span<const Split> splits,
                                    std::span<const Recipe> recipes, const TrainOptions& options) {
  if (splits.empty() || recipes.size() != splits.size())
    return fail({.code = Errc::invalid_argument,
                 .where = "open-set check",
                 .what = "number of recipes differs from the splits",
                 .expected = std::to_string(splits.size()),
                 .got = std::to_string(recipes.size())});
  if (auto ok = check_labels_can_be_left_out(matrix, splits); !ok) return pass(ok.error());
  Tally tally(matrix, options);
  for (std::size_t s = 0; s < splits.size(); ++s) {
    tally.begin_split();
    for (const std::string& label : labels_in(matrix, splits[s].train))
      if (auto ok = tally.leave_out(label, splits[s], recipes[s]); !ok) return pass(ok.error());
  }
  return tally.finish(mean_sizes(splits));
}

}  // namespace weft::classifier
