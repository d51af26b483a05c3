#include "classifier/evaluate/stranger_check.hpp"

#include <map>
#include <set>

#include "classifier/vote/learner_answer.hpp"

namespace weft::classifier {
namespace {

class Tally {
 public:
  Tally(const FeatureMatrix& matrix, const TrainOptions& options)
      : matrix_(matrix), options_(options) {}

  Status leave_out(const std::string& label, const Split& split, const Recipe& recipe) {
    std::vector<std::size_t> rest;
    for (const std::size_t r : split.train)
      if (matrix_.labels[r] != label) rest.push_back(r);
    const FeatureMatrix known = take_rows(matrix_, rest);
    const auto trained = train_recipe(known, recipe, options_);
    if (!trained) return pass(trained.error());
    const auto aids = learn_aids(*trained, known, options_);
    if (!aids) return pass(aids.error());
    if (!*aids) {
      not_measured_.insert(label);
      return {};
    }
    for (const std::size_t r : split.test) {
      const auto said = answer(*trained, *aids, matrix_.values.row(r));
      if (!said) return pass(said.error(), matrix_.files[r]);
      count(r, matrix_.labels[r] == label, said->none_of_these);
    }
    return {};
  }

  [[nodiscard]] Result<StrangerCheck> finish() const {
    if (strangers_.empty() && known_ == 0)
      return fail(Errc::invalid_argument, "too few training trials to refuse any", "none of these",
                  "enough of two labels, beside the one that is left out, for folds", {},
                  "Train with more trials of each label");
    StrangerCheck out;
    out.not_measured.assign(not_measured_.begin(), not_measured_.end());
    std::size_t trials = 0, accepted = 0;
    for (const auto& [label, one] : strangers_) {
      out.strangers.push_back(one);
      trials += one.trials;
      accepted += one.accepted;
    }
    const auto share = [](std::size_t part, std::size_t whole) {
      return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
    };
    out.false_accept = share(accepted, trials);
    out.false_accept_ci95 = wilson_interval(accepted, trials);
    out.false_reject = share(refused_, known_);
    return out;
  }

 private:
  void count(std::size_t row, bool stranger, bool refused) {
    if (stranger) {
      Stranger& one = strangers_[matrix_.labels[row]];
      one.label = matrix_.labels[row];
      ++one.trials;
      one.accepted += refused ? 0 : 1;
    } else {
      ++known_;
      refused_ += refused ? 1 : 0;
    }
  }

  const FeatureMatrix& matrix_;
  const TrainOptions& options_;
  std::map<std::string, Stranger> strangers_;
  std::set<std::string> not_measured_;
  std::size_t known_ = 0, refused_ = 0;
};

}  // namespace

Result<StrangerCheck> check_strangers(const FeatureMatrix& matrix, std::span<const Split> splits,
                                      std::span<const Recipe> recipes,
                                      const TrainOptions& options) {
  if (splits.empty() || recipes.size() != splits.size())
    return fail(Errc::invalid_argument, "every split needs its recipe", "none of these",
                std::to_string(splits.size()), std::to_string(recipes.size()));
  Tally tally(matrix, options);
  for (std::size_t s = 0; s < splits.size(); ++s) {
    std::set<std::string> labels;
    for (const std::size_t r : splits[s].train) labels.insert(matrix.labels[r]);
    if (labels.size() < 3)
      return fail(Errc::invalid_argument, "too few fabrics to leave one out", "none of these",
                  "at least 3", std::to_string(labels.size()));
    for (const std::string& label : labels)
      if (auto ok = tally.leave_out(label, splits[s], recipes[s]); !ok) return pass(ok.error());
  }
  return tally.finish();
}

}  // namespace weft::classifier
