#include "classifier/evaluate/evaluate.hpp"

#include <algorithm>
#include <optional>
#include <set>

namespace weft::classifier {
namespace {

Status check_split(const FeatureMatrix& matrix, const Split& split) {
  if (split.test.empty()) return fail(Errc::invalid_argument, "nothing to test", "split");
  std::set<std::size_t> train_rows;
  std::set<std::string> train_labels;
  for (const auto* rows : {&split.train, &split.test}) {
    for (const std::size_t r : *rows) {
      if (r < matrix.size()) continue;
      return fail(Errc::range, "split names a trial that does not exist", "split",
                  "< " + std::to_string(matrix.size()), std::to_string(r));
    }
  }
  for (const std::size_t r : split.train) {
    train_rows.insert(r);
    train_labels.insert(matrix.labels[r]);
  }
  for (const std::size_t r : split.test) {
    if (train_rows.count(r) != 0) {
      return fail(Errc::invalid_argument, "trial is in both training and test", matrix.files[r]);
    }
    if (train_labels.count(matrix.labels[r]) == 0) {
      return fail(Errc::invalid_argument, "test label was never trained", matrix.files[r], {},
                  matrix.labels[r], "Give every fabric trials on both sides or leave it out");
    }
  }
  return {};
}

std::vector<std::string> sorted_labels(const FeatureMatrix& matrix, const Split& split) {
  std::set<std::string> labels;
  for (const std::size_t r : split.train) labels.insert(matrix.labels[r]);
  return {labels.begin(), labels.end()};
}

std::size_t index_of(const std::vector<std::string>& labels, const std::string& label) {
  return static_cast<std::size_t>(std::lower_bound(labels.begin(), labels.end(), label) -
                                  labels.begin());
}

// One trial at a time on the calling thread, as the paper times it.
Result<Confusion> test_model(const FabricModel& model, const FeatureMatrix& matrix,
                             const std::vector<std::size_t>& rows) {
  Confusion out(model.labels());
  for (const std::size_t r : rows) {
    const auto vote = model.classify(matrix.values.row(r));
    if (!vote) return pass(vote.error(), matrix.files[r]);
    ++out.at(index_of(model.labels(), matrix.labels[r]), vote->winner);
  }
  return out;
}

// Adds counts by label: a later split may have trained fewer classes than the first.
void add(const Confusion& part, Confusion& sum) {
  for (std::size_t t = 0; t < part.classes(); ++t) {
    for (std::size_t p = 0; p < part.classes(); ++p) {
      sum.at(index_of(sum.labels, part.labels[t]), index_of(sum.labels, part.labels[p])) +=
          part.at(t, p);
    }
  }
}

void summarise(std::span<const Split> splits, Evaluation& out) {
  std::vector<double> accuracy, train_s, test_s;
  for (const SplitOutcome& s : out.splits) {
    accuracy.push_back(s.accuracy);
    train_s.push_back(s.train_s);
    test_s.push_back(s.test_s_per_sample);
  }
  out.accuracy = mean_of(accuracy);
  out.deviation = deviation_of(accuracy);
  out.train_s = mean_of(train_s);
  out.test_s_per_sample = mean_of(test_s);
  out.ci95 = accuracy.size() == 1 ? wilson_interval(out.confusion.correct(), out.confusion.total())
                                  : split_interval(accuracy, splits.front().train.size(),
                                                   splits.front().test.size());
}

}  // namespace

Result<Evaluation> evaluate(const FeatureMatrix& matrix, std::span<const Split> splits,
                            const TrainOptions& options, const SecondsNow& seconds_now) {
  const auto now = [&] { return seconds_now ? seconds_now() : 0.0; };
  if (splits.empty()) return fail(Errc::invalid_argument, "no split to evaluate", "evaluate");
  if (auto ok = check(matrix); !ok) return pass(ok.error());
  std::set<std::string> labels;
  for (const Split& split : splits) {
    if (auto ok = check_split(matrix, split); !ok) return pass(ok.error());
    const auto trained = sorted_labels(matrix, split);
    labels.insert(trained.begin(), trained.end());
  }
  Confusion confusion(std::vector<std::string>(labels.begin(), labels.end()));
  std::vector<SplitOutcome> outcomes;
  std::optional<FabricModel> first;
  for (const Split& split : splits) {
    const double start = now();
    auto model = train(take_rows(matrix, split.train), options);
    if (!model) return pass(model.error());
    const double trained = now();
    const auto part = test_model(*model, matrix, split.test);
    if (!part) return pass(part.error());
    const double tested = now();
    add(*part, confusion);
    outcomes.push_back({part->accuracy(), trained - start,
                        (tested - trained) / static_cast<double>(split.test.size())});
    if (!first) first.emplace(std::move(*model));
  }
  Evaluation out{std::move(confusion), std::move(outcomes), 0, 0, {}, 0, 0, std::move(*first)};
  summarise(splits, out);
  return out;
}

}  // namespace weft::classifier
