#include "classifier/vibro/cross_validation.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

namespace weft::classifier::vibro {
namespace {

Interval over_splits(std::span<const double> figure, const SplitSizes& sizes) {
  if (figure.size() > 1) return split_interval(figure, sizes);
  return {0.0, 1.0, "no interval for one split"};
}

// A recording or, with blocks, a part of one.
using Tested = std::pair<std::size_t, std::size_t>;

// Votes of the windows of a split for their recordings.
class RecordingVotes {
 public:
  RecordingVotes(const WindowSet& windows, std::size_t classes)
      : windows_(windows), classes_(classes) {}

  void add(std::size_t row, std::size_t truth, std::size_t answer) {
    Votes& votes = of_[{windows_.recording[row], windows_.places[row].block}];
    votes.truth = truth;
    votes.of_class.resize(classes_);
    ++votes.of_class[answer];
  }
  [[nodiscard]] SplitShare share(std::set<Tested>& tested) const {
    SplitShare out;
    for (const auto& [where, votes] : of_) {
      tested.insert(where);
      out.whole += 1.0;
      out.part += place_of_largest(votes.of_class) == votes.truth ? 1.0 : 0.0;
    }
    return out;
  }

 private:
  struct Votes {
    std::size_t truth = 0;
    std::vector<std::size_t> of_class;
  };
  const WindowSet& windows_;
  std::size_t classes_;
  std::map<Tested, Votes> of_;
};

CrossValidation summary_of(const WindowSet& windows, std::span<const Split> splits,
                           const Evaluation& evaluation) {
  CrossValidation out{evaluation.confusion};
  const std::vector<std::string>& labels = out.confusion.labels;
  std::set<Tested> tested;
  std::vector<SplitShare> voted;
  for (std::size_t s = 0; s < splits.size(); ++s) {
    Confusion own(labels);
    RecordingVotes votes(windows, labels.size());
    for (std::size_t i = 0; i < splits[s].test.size(); ++i) {
      const std::size_t row = splits[s].test[i], answer = evaluation.answers[s][i];
      const std::size_t truth = find_place(labels, windows.matrix.labels[row]);
      ++own.at(truth, answer);
      votes.add(row, truth, answer);
    }
    voted.push_back(votes.share(tested));
    out.voted_answers += static_cast<std::size_t>(voted.back().whole);
    out.voted_accuracy += voted.back().part;
    out.split_accuracy.push_back(evaluation.splits[s].accuracy);
    out.split_f_score.push_back(f_score(own));
  }
  const SplitSizes sizes = mean_sizes(splits);
  out.accuracy = evaluation.accuracy;
  out.f_score = compute_mean(out.split_f_score);
  out.voted = tested.size();
  out.voted_accuracy /= static_cast<double>(out.voted_answers);
  out.voted_ci95 = split_interval(voted, sizes);
  out.accuracy_ci95 = over_splits(out.split_accuracy, sizes);
  out.f_score_ci95 = over_splits(out.split_f_score, sizes);
  out.components = evaluation.components;
  out.explained = evaluation.explained;
  out.outliers = evaluation.outliers;
  out.train_s = evaluation.train_s;
  out.answer_s = evaluation.answer_s;
  return out;
}

}  // namespace

Recipe window_recipe(Learner learner, std::size_t components) {
  const Recipe defaults;
  return {learner, defaults.cap, components > 0 ? View::components : View::standardised,
          components};
}

std::vector<Learner> window_learners() {
  return {Learner::nb,  Learner::knn,      Learner::tree, Learner::forest,
          Learner::svm, Learner::logistic, Learner::nn,   Learner::mlp2,
          Learner::xgb, Learner::xgbrf,    Learner::lda,  Learner::all};
}

Recipe window_recipe(Learner learner, std::size_t components, const std::vector<Channel>& channels,
                     FeatureChoice features) {
  Recipe out = window_recipe(learner, components);
  out.features = to_string(features.family);
  if (features.family == Family::wide) return out;
  std::set<std::string> names;
  for (const Column& column : columns_of(channels, features)) names.insert(column.name);
  const auto all = columns_of(channels, {Family::wide, features.combine});
  for (std::size_t k = 0; k < all.size(); ++k)
    if (names.contains(all[k].name)) out.columns.push_back(k);
  return out;
}

namespace {

constexpr std::array quick_learners = {Learner::lda, Learner::logistic, Learner::svm,
                                       Learner::knn, Learner::nb,       Learner::forest};

}  // namespace

std::vector<Recipe> window_candidates(std::size_t components) {
  std::vector<Recipe> out;
  for (const Learner learner : quick_learners) out.push_back(window_recipe(learner, components));
  return out;
}

std::vector<Recipe> window_candidates(const std::vector<Channel>& channels, Combine combine,
                                      std::size_t components) {
  std::vector<Recipe> out;
  for (const Learner learner : quick_learners)
    for (const Family family : {Family::smmrpfft, Family::all, Family::bands, Family::wide})
      out.push_back(window_recipe(learner, components, channels, {family, combine}));
  return out;
}

double f_score(const Confusion& confusion) {
  double sum = 0.0;
  std::size_t labels = 0;
  for (std::size_t c = 0; c < confusion.classes(); ++c) {
    std::size_t named = 0, own = 0;
    for (std::size_t k = 0; k < confusion.classes(); ++k) {
      named += confusion.at(k, c);
      own += confusion.at(c, k);
    }
    if (named + own == 0) continue;
    sum += 2.0 * static_cast<double>(confusion.at(c, c)) / static_cast<double>(named + own);
    ++labels;
  }
  return labels == 0 ? 0.0 : sum / static_cast<double>(labels);
}

TrainOptions window_training(TrainOptions options, Protocol protocol) {
  options.fold_unit = protocol == Protocol::groups ? FoldUnit::group : FoldUnit::recording;
  return options;
}

Result<CrossValidation> cross_validate(const WindowSet& windows, std::span<const Split> splits,
                                       std::span<const Recipe> candidates,
                                       const TrainOptions& options, const SecondsNow& seconds_now) {
  const auto evaluation = evaluate(windows.matrix, splits, candidates, options, seconds_now);
  if (!evaluation) return pass(evaluation.error());
  CrossValidation out = summary_of(windows, splits, *evaluation);
  if (candidates.size() > 1) {
    out.chosen = evaluation->recipes;
    out.candidates = evaluation->candidates;
  }
  return out;
}

}  // namespace weft::classifier::vibro
