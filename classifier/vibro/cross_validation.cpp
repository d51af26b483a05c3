#include "classifier/vibro/cross_validation.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "classifier/fabric/folds.hpp"
#include "classifier/vibro/level_features.hpp"

namespace weft::classifier::vibro {
namespace {

// Gathers over the splits what an Assessment tells.
class CrossValidator {
 public:
  CrossValidator(const WindowSet& windows, const SecondsNow& seconds_now)
      : windows_(windows),
        now_(seconds_now),
        classes_(find_classes(windows.matrix)),
        out_{Confusion(classes_.labels)} {}

  [[nodiscard]] double seconds() const { return now_ ? now_() : 0.0; }
  [[nodiscard]] Result<Pipeline> train(std::span<const std::size_t> rows,
                                       const PipelineOptions& options) const {
    const Matrix values = windows_.matrix.values.take(rows);
    std::vector<std::size_t> of_row;
    for (const std::size_t r : rows) of_row.push_back(classes_.of_row[r]);
    const std::vector<std::size_t> unit = fold_units(windows_, rows);
    return Pipeline::train({&values, of_row, classes_.labels.size(), unit}, options);
  }

  // Share of right answers alone.
  [[nodiscard]] Result<double> tried(const Split& split, const PipelineOptions& options) const {
    const auto trained = train(split.train, options);
    if (!trained) return pass(trained.error());
    std::size_t right = 0;
    for (const std::size_t r : split.test) {
      const auto predicted = trained->classify(windows_.matrix.values.row(r));
      if (!predicted) return pass(predicted.error(), windows_.matrix.files[r]);
      right += *predicted == classes_.of_row[r] ? 1 : 0;
    }
    return static_cast<double>(right) / static_cast<double>(split.test.size());
  }

  Status add(const Split& split, const PipelineOptions& options) {
    const double begun = seconds();
    const auto trained = train(split.train, options);
    if (!trained) return pass(trained.error());
    out_.train_s += seconds() - begun;
    out_.components = std::max(out_.components, trained->components());
    out_.explained += trained->explained();
    Confusion own(classes_.labels);
    std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> votes;
    for (const std::size_t r : split.test) {
      const double started = seconds();
      const auto predicted = trained->classify(windows_.matrix.values.row(r));
      answers_s_.push_back(seconds() - started);
      if (!predicted) return pass(predicted.error(), windows_.matrix.files[r]);
      ++own.at(classes_.of_row[r], *predicted);
      auto& vote = votes[{windows_.recording[r], windows_.places[r].block}];
      vote.resize(classes_.labels.size());
      ++vote[*predicted];
    }
    SplitShare& voted = voted_of_split_.emplace_back();
    for (const auto& [where, vote] : votes) {
      voted_.insert(where);
      voted.whole += 1.0;
      voted.part += classes_.labels[place_of_largest(vote)] == label_of(where.first) ? 1.0 : 0.0;
    }
    for (std::size_t i = 0; i < own.count.size(); ++i) out_.confusion.count[i] += own.count[i];
    out_.split_accuracy.push_back(own.accuracy());
    out_.split_f_score.push_back(vibro::f_score(own));
    return {};
  }

  CrossValidation finished(std::span<const Split> splits) {
    const SplitSizes sizes = mean_sizes(splits);
    const auto n = static_cast<double>(out_.split_accuracy.size());
    out_.accuracy = compute_mean(out_.split_accuracy);
    out_.f_score = compute_mean(out_.split_f_score);
    out_.train_s /= n;
    out_.explained = (out_.explained - 1.0) / n;  // it began with 1
    double right = 0.0, answers = 0.0;
    for (const SplitShare& one : voted_of_split_) {
      right += one.part;
      answers += one.whole;
    }
    out_.voted = voted_.size();
    out_.voted_answers = static_cast<std::size_t>(answers);
    out_.voted_accuracy = right / answers;
    out_.voted_ci95 = split_interval(voted_of_split_, sizes);
    out_.accuracy_ci95 = over_splits(out_.split_accuracy, sizes);
    out_.f_score_ci95 = over_splits(out_.split_f_score, sizes);
    out_.answer_s = MedianFinder().median(answers_s_);
    return std::move(out_);
  }

  void note_choice(Method method) { out_.chosen.push_back(method); }

 private:
  static Interval over_splits(std::span<const double> figure, const SplitSizes& sizes) {
    if (figure.size() > 1) return split_interval(figure, sizes);
    return {0.0, 1.0, "one split alone tells no spread"};
  }
  [[nodiscard]] const std::string& label_of(std::size_t recording) const {
    const auto at = std::find(windows_.recording.begin(), windows_.recording.end(), recording);
    return windows_.matrix.labels[static_cast<std::size_t>(at - windows_.recording.begin())];
  }

  const WindowSet& windows_;
  const SecondsNow& now_;
  Classes classes_;
  std::vector<double> answers_s_;
  std::set<std::pair<std::size_t, std::size_t>> voted_;  // recording and block
  std::vector<SplitShare> voted_of_split_;
  CrossValidation out_;
};

Result<Method> choose(const CrossValidator& assessor, const WindowSet& windows, const Split& outer,
                      Protocol protocol, std::span<const Method> candidates,
                      PipelineOptions options) {
  const std::vector<Split> inner = inner_splits(windows, outer, protocol);
  std::optional<Method> best;
  double most = -1.0;
  for (const Method method : candidates) {
    if (!available(method)) continue;
    options.method = method;
    double sum = 0.0;
    for (const Split& split : inner) {
      const auto share = assessor.tried(split, options);
      if (!share) return pass(share.error());
      sum += *share;
    }
    if (sum > most) {
      most = sum;
      best = method;
    }
  }
  if (!best) return fail({.code = Errc::invalid_argument, .what = "no learner to choose from"});
  return *best;
}

}  // namespace

std::vector<Split> inner_splits(const WindowSet& windows, const Split& outer, Protocol protocol) {
  constexpr std::size_t fifths = 5;
  std::map<std::string, std::vector<std::size_t>> parts;
  for (std::size_t i = 0; i < outer.train.size(); ++i) {
    const std::size_t r = outer.train[i];
    const std::string part = protocol == Protocol::groups ? windows.matrix.groups[r]
                             : protocol == Protocol::blocks
                                 ? std::to_string(windows.places[r].block)
                                 : std::to_string(i % fifths);
    parts[part].push_back(r);
  }
  const std::set<std::string> labels = labels_in(windows.matrix, outer.train);
  std::vector<Split> out;
  for (const auto& [part, tests] : parts) {
    Split split;
    split.test = tests;
    std::set_difference(outer.train.begin(), outer.train.end(), tests.begin(), tests.end(),
                        std::back_inserter(split.train));
    // A class that only this part has cannot be learnt without it.
    if (labels_in(windows.matrix, split.train) == labels) out.push_back(std::move(split));
  }
  return out;
}

Status check_choice(const WindowSet& windows, std::span<const Split> splits, Protocol protocol) {
  for (const Split& split : splits)
    if (inner_splits(windows, split, protocol).empty())
      return fail({.code = Errc::invalid_argument,
                   .what = "the training windows cannot be parted to choose a learner",
                   .expected = "two blocks or groups that each train every class",
                   .hint = "Take more blocks or groups, or name one learner"});
  return {};
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

Result<CrossValidation> cross_validate(const WindowSet& windows, std::span<const Split> splits,
                                       const PipelineOptions& options,
                                       const SecondsNow& seconds_now) {
  if (splits.empty())
    return fail({.code = Errc::invalid_argument, .what = "no split to assess on"});
  CrossValidator assessor(windows, seconds_now);
  for (const Split& split : splits)
    if (auto ok = assessor.add(split, options); !ok) return pass(ok.error());
  return assessor.finished(splits);
}

Result<CrossValidation> cross_validate_chosen(const WindowSet& windows,
                                              std::span<const Split> splits, Protocol protocol,
                                              std::span<const Method> candidates,
                                              const PipelineOptions& options,
                                              const SecondsNow& seconds_now) {
  if (splits.empty())
    return fail({.code = Errc::invalid_argument, .what = "no split to assess on"});
  if (auto ok = check_choice(windows, splits, protocol); !ok) return pass(ok.error());
  CrossValidator assessor(windows, seconds_now);
  for (const Split& split : splits) {
    const auto method = choose(assessor, windows, split, protocol, candidates, options);
    if (!method) return pass(method.error());
    PipelineOptions own = options;
    own.method = *method;
    assessor.note_choice(*method);
    if (auto ok = assessor.add(split, own); !ok) return pass(ok.error());
  }
  return assessor.finished(splits);
}

}  // namespace weft::classifier::vibro
