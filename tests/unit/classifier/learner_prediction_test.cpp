// Learners trained in parts, stored and used.

#include <catch2/catch.hpp>
#include <limits>
#include <numeric>
#include <set>

#include "classifier/evaluate/calibration_check.hpp"
#include "classifier/evaluate/evaluate.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::learner_answer_test {
namespace {

using testing::gaussian_classes;

// Two shares of every task, joined as two processes would.
TaskTrainer in_two_shares(const FeatureMatrix& matrix, const TrainOptions& options,
                          std::size_t& tasks) {
  return [&](const CoreTask& task) -> Result<std::vector<FabricCore>> {
    ++tasks;
    auto even = train_task(matrix, task, options, 0, 2);
    auto odd = train_task(matrix, task, options, 1, 2);
    if (!even) return even;
    if (!odd) return odd;
    std::vector<FabricCore> out;
    for (std::size_t i = 0; i < even->size() + odd->size(); ++i)
      out.push_back(i % 2 == 0 ? (*even)[i / 2] : (*odd)[i / 2]);
    return out;
  };
}

TEST_CASE("A learner with cores trained in shares equals the one trained in one piece") {
  const FeatureMatrix data = gaussian_classes(4, 8, 6, 1.2, 5);
  const FeatureMatrix fresh = gaussian_classes(4, 8, 6, 1.2, 6);
  const TrainOptions options;
  for (const Learner learner :
       {Learner::pvalue, Learner::all, Learner::cores_best, Learner::best, Learner::lda}) {
    CAPTURE(to_string(learner));
    std::size_t tasks = 0;
    const auto whole = train_learner(data, learner, options);
    const auto shared = train_learner(data, learner, options, in_two_shares(data, options, tasks));
    REQUIRE((whole && shared));
    CHECK((tasks > 0) == (learner != Learner::lda));
    CHECK(whole->recipe == shared->recipe);
    for (std::size_t r = 0; r < fresh.size(); ++r)
      CHECK(*whole->trained.classify(fresh.values.row(r)) ==
            *shared->trained.classify(fresh.values.row(r)));
  }
}

TEST_CASE("Cores trained in shares decide bit for bit as in one piece, whatever they see") {
  const View view = GENERATE(View::compressed, View::ranked, View::normal_scores);
  const FeatureMatrix data = gaussian_classes(3, 8, 5, 1.0, 7);
  const TrainOptions options;
  const auto whole = train_recipe(data, {Learner::all, 20, view}, options);
  const auto cores = train_task(data, {Reduction::all, view, {}}, options);
  REQUIRE((whole && cores));
  for (std::size_t r = 0; r < data.size(); ++r) {
    const auto own = whole->prepared(data.values.row(r));
    REQUIRE(own);
    for (std::size_t i = 0; i < cores->size(); ++i)
      CHECK((*cores)[i].decide(*own) == whole->cores()->cores()[i].decide(*own));
  }
  CHECK_FALSE(train_task(data, {Reduction::all, View::plain, 99}, options));
}

// Compares all but the decisions, which predict_all() omits for many rows.
void check_same(const Result<Prediction>& many, const Result<Prediction>& one) {
  REQUIRE(many.has_value() == one.has_value());
  if (!one) {
    CHECK(to_string(many.error()) == to_string(one.error()));
    return;
  }
  CHECK(many->ballot.winner == one->ballot.winner);
  CHECK(many->ballot.votes == one->ballot.votes);
  CHECK(many->ballot.support == one->ballot.support);
  CHECK(many->ballot.cores == one->ballot.cores);
  CHECK(many->ballot.classes == one->ballot.classes);
  CHECK(many->ballot.decision.capacity() == 0);
  CHECK(many->probability == one->probability);
  CHECK(many->novelty == one->novelty);
  CHECK(many->none_of_these == one->none_of_these);
}

TEST_CASE("Many rows are answered as each row is, whatever is asked, however many threads ask") {
  const FeatureMatrix data = gaussian_classes(4, 10, 6, 1.2, 21);
  Matrix rows = gaussian_classes(4, 7, 6, 1.2, 22).values;
  rows(5, 2) = std::nan("");
  rows(9, 0) = std::numeric_limits<double>::infinity();
  const auto learner = GENERATE(Learner::pvalue, Learner::pca, Learner::lda, Learner::svc);
  const bool postprocess = GENERATE(true, false);
  const auto trained = train_recipe(data, {learner, 20, View::ranked}, {});
  REQUIRE(trained);
  std::optional<VotePostprocessing> postprocessing;
  if (postprocess) postprocessing = *fit_postprocessing(*trained, data, {});
  for (const VoteKind kind :
       {VoteKind::majority, VoteKind::soft, VoteKind::dag, VoteKind::shortlist}) {
    const VoteOptions options{.kind = kind, .shortlist = 3};
    for (const std::size_t threads : {1U, 3U}) {
      const auto reply = predict_all(*trained, postprocessing, rows, options, threads);
      REQUIRE(reply.size() == rows.rows());
      CHECK_FALSE(reply[5]);
      for (std::size_t r = 0; r < reply.size(); ++r) {
        CAPTURE(to_string(learner), postprocess, to_string(kind), r);
        check_same(reply[r], predict(*trained, postprocessing, rows.row(r), options));
      }
    }
  }
  const Matrix narrow(2, 5);
  for (const auto& reply : predict_all(*trained, postprocessing, narrow)) CHECK_FALSE(reply);
  CHECK(predict_all(*trained, postprocessing, Matrix()).empty());
}

TEST_CASE("More rows than are asked at a time are all answered") {
  const FeatureMatrix data = gaussian_classes(40, 3, 6, 3.0, 23);
  const auto trained = train_recipe(data, {Learner::all}, {});
  REQUIRE(trained);
  const Matrix rows = gaussian_classes(40, 130, 6, 3.0, 24).values;  // 780 cores: 5128 at a time
  const auto reply = predict_all(*trained, {}, rows);
  REQUIRE(reply.size() == 5200);
  for (std::size_t r = 0; r < reply.size(); r += 3) {
    REQUIRE(reply[r]);
    CHECK(reply[r]->ballot.winner == *trained->classify(rows.row(r)));
  }
}

TEST_CASE("Probabilities of every learner are distributions, higher for nearer classes") {
  const FeatureMatrix data = gaussian_classes(4, 15, 6, 2.0, 11);
  const FeatureMatrix fresh = gaussian_classes(4, 40, 6, 2.0, 12);
  for (const Learner kind : {Learner::lda, Learner::svc, Learner::trees, Learner::all}) {
    CAPTURE(to_string(kind));
    const TrainOptions options;
    const auto learner = train_recipe(
        data, {kind, 20, kind == Learner::all ? View::compressed : View::plain}, options);
    REQUIRE(learner);
    auto postprocessing = fit_postprocessing(*learner, data, options);
    REQUIRE(postprocessing);
    const std::optional<VotePostprocessing> some = std::move(*postprocessing);
    double of_truth = 0.0;
    for (std::size_t r = 0; r < fresh.size(); ++r) {
      const auto reply = predict(*learner, some, fresh.values.row(r));
      REQUIRE(reply);
      CHECK(reply->ballot.winner == *learner->classify(fresh.values.row(r)));
      CHECK(std::accumulate(reply->probability.begin(), reply->probability.end(), 0.0) ==
            Approx(1.0));
      of_truth += reply->probability[r / 40];
    }
    // Chance: 0.25. Two of six columns are useful, and a tree considers two of them at a time.
    CHECK(of_truth / 160.0 > (kind == Learner::trees ? 0.4 : 0.5));
  }
}

TEST_CASE("A trial far from every class is an unknown fabric for every learner") {
  const FeatureMatrix data = gaussian_classes(3, 15, 6, 3.0, 21);
  for (const Learner kind : {Learner::lda, Learner::svc, Learner::trees, Learner::pvalue}) {
    const auto learner = train_recipe(data, {kind, 20, View::plain}, {});
    REQUIRE(learner);
    auto postprocessing = fit_postprocessing(*learner, data, {});
    REQUIRE(postprocessing);
    const std::optional<VotePostprocessing> some = std::move(*postprocessing);
    CHECK(predict(*learner, some, std::vector<double>(6, 60.0))->none_of_these);
    std::size_t refused = 0;
    for (std::size_t r = 0; r < data.size(); ++r)
      refused += predict(*learner, some, data.values.row(r))->none_of_these ? 1 : 0;
    CHECK(refused <= 4);  // requested: 5 % of 45
  }
}

TEST_CASE("A label with a single trial is refused by name where two are needed") {
  FeatureMatrix data = gaussian_classes(3, 4, 3, 1, 31);
  data.labels.back() = "lonely";
  for (const Learner learner : {Learner::nb, Learner::knn, Learner::perceptron})
    CHECK(train_learner(data, learner, {}));
  for (const Learner learner : {Learner::pvalue, Learner::pca, Learner::all, Learner::lda,
                                Learner::svc, Learner::trees, Learner::cores_best, Learner::best}) {
    const auto trained = train_learner(data, learner, {});
    REQUIRE_FALSE(trained);
    CHECK(to_string(trained.error()).find("label lonely") != std::string::npos);
  }
}

TEST_CASE("The calibration error of predictions that are all right at 0.9 is 0.1") {
  const std::vector<double> reply(200, 0.9), right(200, 1.0);
  std::vector<std::string> recording;
  for (std::size_t i = 0; i < 200; ++i) recording.push_back(std::to_string(i));
  const Interval sure = calibration_error_interval(reply, right, recording, 10).value();
  CHECK(sure.low == Approx(0.1));
  CHECK(sure.high == Approx(0.1));
}

TEST_CASE("The interval of a calibration error widens when answers come from few recordings") {
  std::vector<double> reply, right;
  std::vector<std::string> own, few;
  for (std::size_t i = 0; i < 480; ++i) {
    reply.push_back(0.75);
    right.push_back((i / 40) % 4 == 0 ? 0.0 : 1.0);  // whole recordings of 40 are wrong
    own.push_back(std::to_string(i));
    few.push_back(std::to_string(i / 40));
  }
  const Interval narrow = calibration_error_interval(reply, right, own, 10).value();
  const Interval wide = calibration_error_interval(reply, right, few, 10).value();
  CHECK(wide.high > 2.0 * narrow.high);
  CHECK(narrow.high < 0.06);  // 1.96 sqrt(0.75 0.25 / 480) = 0.039
}

TEST_CASE("A calibration error of nothing, of no bins or of no probabilities is refused") {
  const std::vector<double> reply{0.9, 0.8}, right{1.0, 0.0};
  const std::vector<std::string> recording{"a", "b"};
  REQUIRE(calibration_error_interval(reply, right, recording, 10));
  CHECK_FALSE(calibration_error_interval(reply, right, recording, 0));
  CHECK_FALSE(calibration_error_interval({}, {}, {}, 10));
  CHECK_FALSE(calibration_error_interval(reply, std::vector{1.0}, recording, 10));
  CHECK_FALSE(calibration_error_interval(reply, right, std::vector<std::string>{"a"}, 10));
  for (const double wrong : {std::nan(""), -0.1, 1.1})
    CHECK_FALSE(calibration_error_interval(std::vector{0.9, wrong}, right, recording, 10));
}

TEST_CASE("Trials without a name are recordings of their own, windows of one file are one") {
  const FeatureMatrix named = gaussian_classes(3, 20, 4, 2.0, 41);
  const auto splits = stratified_splits(named.labels, 0.5, 2, 1);
  REQUIRE(splits);
  std::set<std::size_t> tested;
  for (const Split& split : *splits) tested.insert(split.test.begin(), split.test.end());
  FeatureMatrix unnamed = named, windows = named;
  unnamed.files.assign(named.size(), "");
  for (std::size_t r = 0; r < named.size(); ++r)
    windows.files[r] = named.labels[r] + "#w" + std::to_string(r);
  for (const auto& [data, recordings] :
       {std::pair{&named, tested.size()}, {&unnamed, tested.size()}, {&windows, std::size_t{3}}}) {
    const auto checked = evaluate(*data, *splits, Learner::lda, {}, {}, true);
    REQUIRE(checked);
    REQUIRE(checked->calibration);
    CHECK(checked->calibration->recordings == recordings);
  }
}

TEST_CASE("Calibration is checked on test answers alone, each once") {
  const FeatureMatrix data = gaussian_classes(3, 20, 4, 2.0, 41);
  const auto splits = stratified_splits(data.labels, 0.5, 2, 1);
  REQUIRE(splits);
  const auto plain = evaluate(data, *splits, Learner::lda, {});
  const auto checked = evaluate(data, *splits, Learner::lda, {}, {}, true);
  REQUIRE((plain && checked));
  CHECK_FALSE(plain->calibration);
  REQUIRE(checked->calibration);
  const Reliability& figures = checked->calibration->reliability;
  CHECK(figures.trials == 60);
  std::size_t count = 0;
  double right = 0.0;
  for (const ReliabilityBin& bin : figures.bins) {
    count += bin.count;
    right += bin.observed * static_cast<double>(bin.count);
  }
  CHECK(count == 60);
  CHECK(right / 60.0 == Approx(checked->confusion.accuracy()));
  CHECK(checked->confusion.count == plain->confusion.count);
  CHECK(checked->calibration->calibration_error_ci95.low <= figures.calibration_error + 0.05);
}

TEST_CASE("Bins of a reliability count a trial once, however many splits ask it") {
  const FeatureMatrix data = gaussian_classes(3, 20, 4, 1.5, 41);
  const auto few = stratified_splits(data.labels, 0.5, 5, 1);
  const auto many = stratified_splits(data.labels, 0.5, 60, 1);
  REQUIRE((few && many));
  const auto once = evaluate(data, std::span(*few).first(1), Learner::lda, {}, {}, true);
  const auto often = evaluate(data, *many, Learner::lda, {}, {}, true);
  REQUIRE((once && often));
  const CalibrationCheck& single = *once->calibration;
  REQUIRE(single.bins.size() == single.reliability.bins.size());
  for (std::size_t b = 0; b < single.bins.size(); ++b) {
    const ReliabilityBin& bin = single.reliability.bins[b];
    CHECK(single.bins[b].recordings == bin.count);
    if (bin.count > 0) CHECK(single.bins[b].observed_ci95.method == "Wilson score, one split");
  }
  const CalibrationCheck& check = *often->calibration;
  for (std::size_t b = 0; b < check.bins.size(); ++b) {
    const ReliabilityBin& bin = check.reliability.bins[b];
    if (bin.count < 300) continue;
    INFO("bin " << b << ", " << bin.count << " answers");
    CHECK(check.bins[b].recordings <= data.size());
    const Interval& sure = check.bins[b].observed_ci95;
    CHECK(sure.method.find("Nadeau-Bengio") != std::string::npos);
    CHECK(sure.low <= bin.observed);
    CHECK(sure.high >= bin.observed);
    const Interval independent = wilson_of_share(bin.observed, static_cast<double>(bin.count));
    CHECK(sure.high - sure.low > 2.0 * (independent.high - independent.low));
  }
}

}  // namespace
}  // namespace weft::classifier::learner_answer_test
