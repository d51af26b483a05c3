#include "classifier/evaluate/evaluate.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "classifier/base/random.hpp"

namespace weft::classifier {
namespace {

Status check_split(const FeatureMatrix& matrix, const Split& split) {
  if (split.test.empty())
    return fail(
        {.code = Errc::invalid_argument, .where = "split", .what = "split has no test trials"});
  for (const auto* rows : {&split.train, &split.test}) {
    for (const std::size_t r : *rows) {
      if (r < matrix.size()) continue;
      return fail({.code = Errc::range,
                   .where = "split",
                   .what = "split names an unknown trial",
                   .expected = "< " + std::to_string(matrix.size()),
                   .got = std::to_string(r)});
    }
  }
  const std::set<std::size_t> train_rows(split.train.begin(), split.train.end());
  const std::set<std::string> train_labels = labels_in(matrix, split.train);
  for (const std::size_t r : split.test) {
    if (train_rows.count(r) != 0) {
      return fail({.code = Errc::invalid_argument,
                   .where = matrix.files[r],
                   .what = "trial in both training and test"});
    }
    if (train_labels.count(matrix.labels[r]) == 0) {
      return fail({.code = Errc::invalid_argument,
                   .where = matrix.files[r],
                   .what = "test label without training trials",
                   .got = matrix.labels[r],
                   .hint = "Give every fabric training and test trials, or remove the fabric"});
    }
  }
  return {};
}

// Predicts one trial at a time on the calling thread, as the paper measures the time. `answer`
// returns the class of a feature vector. The duration of each prediction goes to `seconds`.
template <class Predict, class Now>
Result<std::vector<std::size_t>> collect_predictions(const Predict& answer,
                                                     const FeatureMatrix& matrix,
                                                     const std::vector<std::size_t>& rows,
                                                     const Now& now, std::vector<double>& seconds) {
  std::vector<std::size_t> out;
  double began = now();
  for (const std::size_t r : rows) {
    const Result<std::size_t> winner = answer(matrix.values.row(r));
    if (!winner) return pass(winner.error(), matrix.files[r]);
    out.push_back(*winner);
    const double ended = now();
    seconds.push_back(ended - std::exchange(began, ended));
  }
  return out;
}

// Counts the answers of one split. They are indices into the split's own labels: a later split may
// train fewer classes than the first. Returns the split's accuracy.
double count_answers(const FeatureMatrix& matrix, const Split& split,
                     std::vector<std::size_t> answers, Scores& out) {
  const std::set<std::string> trained = labels_in(matrix, split.train);
  const std::vector<std::string> own(trained.begin(), trained.end());
  std::size_t correct = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const std::string& truth = matrix.labels[split.test[i]];
    correct += own[answers[i]] == truth ? 1 : 0;
    answers[i] = find_place(out.confusion.labels, own[answers[i]]);
    ++out.confusion.at(find_place(out.confusion.labels, truth), answers[i]);
  }
  out.answers.push_back(std::move(answers));
  return static_cast<double>(correct) / static_cast<double>(split.test.size());
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return values.size() % 2 == 1 ? *middle
                                : (*middle + *std::max_element(values.begin(), middle)) / 2.0;
}

void summarise(std::span<const Split> splits, Scores& out) {
  std::vector<double> accuracy, train_s, test_s;
  for (const SplitOutcome& s : out.splits) {
    accuracy.push_back(s.accuracy);
    train_s.push_back(s.train_s);
    test_s.push_back(s.test_s_per_sample);
  }
  out.accuracy = compute_mean(accuracy);
  out.deviation = compute_deviation(accuracy);
  out.train_s = compute_mean(train_s);
  out.test_s_per_sample = compute_mean(test_s);
  out.ci95 = split_interval(accuracy, mean_sizes(splits));
}

Result<Confusion> empty_confusion(const FeatureMatrix& matrix, std::span<const Split> splits) {
  if (splits.empty())
    return fail(
        {.code = Errc::invalid_argument, .where = "evaluate", .what = "no splits to evaluate"});
  if (auto ok = check(matrix); !ok) return pass(ok.error());
  std::set<std::string> labels;
  for (const Split& split : splits) {
    if (auto ok = check_split(matrix, split); !ok) return pass(ok.error());
    labels.merge(labels_in(matrix, split.train));
  }
  return Confusion(std::vector<std::string>(labels.begin(), labels.end()));
}

// Trains and tests on every split. `train_on` trains on a matrix; `answer` predicts the class of a
// feature vector; `sink` then takes the trained object with its split.
template <class TrainOn, class Predict, class Sink>
Result<Scores> over_splits(const FeatureMatrix& matrix, std::span<const Split> splits,
                           const SecondsNow& seconds_now, const TrainOn& train_on,
                           const Predict& answer, const Sink& sink) {
  const auto now = [&] { return seconds_now ? seconds_now() : 0.0; };
  auto confusion = empty_confusion(matrix, splits);
  if (!confusion) return pass(confusion.error());
  Scores out{std::move(*confusion), {}, {}, 0, 0, {}, 0, 0, 0};
  std::vector<double> answers_s;
  for (const Split& split : splits) {
    const double start = now();
    auto trained = train_on(select_rows(matrix, split.train));
    if (!trained) return pass(trained.error());
    const double ready = now();
    auto answers = collect_predictions([&](auto features) { return answer(*trained, features); },
                                       matrix, split.test, now, answers_s);
    if (!answers) return pass(answers.error());
    const double accuracy = count_answers(matrix, split, std::move(*answers), out);
    out.splits.push_back(
        {accuracy, ready - start, compute_mean(std::span(answers_s).last(split.test.size()))});
    if (auto ok = sink(std::move(*trained), split); !ok) return pass(ok.error());
  }
  summarise(splits, out);
  out.answer_s = median_of(std::move(answers_s));
  return out;
}

// Expected number of matches for random answers: sum over labels of (answers x trials) / n.
double blind_matches(const Confusion& confusion) {
  double sum = 0.0;
  for (std::size_t k = 0; k < confusion.classes(); ++k) {
    double answers = 0.0, trials = 0.0;
    for (std::size_t j = 0; j < confusion.classes(); ++j) {
      answers += static_cast<double>(confusion.at(j, k));
      trials += static_cast<double>(confusion.at(k, j));
    }
    sum += answers * trials;
  }
  return sum / static_cast<double>(confusion.total());
}

// `evaluate_on` returns the scores of a matrix over splits.
template <class EvaluateOn>
Result<PermutationResult> permuted(const FeatureMatrix& matrix, std::uint64_t seed,
                                   const PermutationOptions& options,
                                   const EvaluateOn& evaluate_on) {
  if (options.permutations == 0)
    return fail({.code = Errc::range,
                 .where = "permutations",
                 .what = "too few permutations",
                 .expected = "at least 1",
                 .got = "0"});
  RandomEngine engine(seed);
  FeatureMatrix shuffled = matrix;
  PermutationResult out;
  double matches = 0.0;
  for (std::size_t p = 0; p < options.permutations; ++p) {
    shuffled.labels = permuted_labels(matrix.labels, engine());
    const auto splits =
        stratified_splits(shuffled.labels, options.train_fraction, options.splits, engine());
    if (!splits) return pass(splits.error(), "permuted labels");
    const auto evaluation = evaluate_on(shuffled, *splits);
    if (!evaluation) return pass(evaluation.error(), "permuted labels");
    out.accuracy.push_back(evaluation->accuracy);
    out.trials += evaluation->confusion.total();
    matches += blind_matches(evaluation->confusion);
  }
  out.mean = compute_mean(out.accuracy);
  out.chance = matches / static_cast<double>(out.trials);
  return out;
}

}  // namespace

Result<Evaluation> evaluate(const FeatureMatrix& matrix, std::span<const Split> splits,
                            Learner learner, const TrainOptions& options,
                            const SecondsNow& seconds_now, bool calibration) {
  return evaluate(matrix, splits, candidates(learner, options.cap), options, seconds_now,
                  calibration);
}

Result<Evaluation> evaluate(const FeatureMatrix& matrix, std::span<const Split> splits,
                            std::span<const Recipe> tried, const TrainOptions& options,
                            const SecondsNow& seconds_now, bool calibration) {
  const auto confusion = empty_confusion(matrix, splits);
  if (!confusion) return pass(confusion.error());
  CalibrationTally tally(confusion->labels);
  std::optional<TrainedLearner> first;
  std::vector<Recipe> recipes;
  std::vector<std::vector<RecipeScore>> of_candidates;
  std::map<std::string, std::size_t> outliers;
  std::size_t components = 0;
  double explained = static_cast<double>(splits.size());
  auto scores = over_splits(
      matrix, splits, seconds_now,
      [&](const FeatureMatrix& rows) { return train_best(rows, tried, options); },
      [](const ChosenLearner& chosen, std::span<const double> features) {
        return chosen.trained.classify(features);
      },
      [&](ChosenLearner&& chosen, const Split& split) -> Status {
        Status ok = calibration ? tally.add(matrix, split, chosen.trained, options) : Status();
        recipes.push_back(chosen.recipe);
        if (const auto* own = std::get_if<PrincipalComponents>(&chosen.trained.view().table())) {
          components = std::max(components, own->axes.rows());
          explained += own->explained - 1.0;
        }
        for (const auto& [label, rows] : chosen.trained.outliers()) outliers[label] += rows;
        of_candidates.push_back(std::move(chosen.scores));
        if (!first) first.emplace(std::move(chosen.trained));
        return ok;
      });
  if (!scores) return pass(scores.error());
  Evaluation out{
      std::move(*scores), std::move(recipes), std::move(of_candidates),
      std::move(*first),  components,         explained / static_cast<double>(splits.size()),
      std::move(outliers)};
  if (tally.empty()) return out;
  auto check = tally.finish();
  if (!check) return pass(check.error());
  out.calibration = std::move(*check);
  return out;
}

Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix,
                                            std::span<const Recipe> candidates,
                                            const TrainOptions& train,
                                            const PermutationOptions& options) {
  return permuted(matrix, train.seed, options,
                  [&](const FeatureMatrix& shuffled, const std::vector<Split>& splits) {
                    return evaluate(shuffled, splits, candidates, train);
                  });
}

Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix, Learner learner,
                                            const TrainOptions& train,
                                            const PermutationOptions& options) {
  return evaluate_permuted(matrix, candidates(learner, train.cap), train, options);
}

}  // namespace weft::classifier
