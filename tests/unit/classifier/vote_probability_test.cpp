// Probabilities: compared with closed forms and known posteriors, and at the extremes.

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "classifier/evaluate/calibration_check.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/vote/calibration.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::vote_probability_test {
namespace {

double uniform(RandomEngine& engine) {
  return static_cast<double>(engine() >> 11) * 0x1p-53;
}

double sum_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum;
}

// ---- one core ----

TEST_CASE("a sigmoid recovers the posterior that signs were drawn from") {
  RandomEngine engine(21);
  std::vector<double> f;
  std::vector<int> sign;
  for (int i = 0; i < 20000; ++i) {
    f.push_back(6.0 * uniform(engine) - 3.0);
    sign.push_back(uniform(engine) < 1.0 / (1.0 + std::exp(-1.5 * f.back() + 0.5)) ? 1 : -1);
  }
  const Sigmoid s = fit_sigmoid(f, sign);
  CHECK(s.slope == Approx(-1.5).margin(0.06));
  CHECK(s.offset == Approx(0.5).margin(0.06));
}

// n at each of +-1: the fit is exact, and its values are Platt's targets.
TEST_CASE("a sigmoid of two distinct values reaches Platt's targets exactly") {
  const std::vector<double> f{1, 1, 1, -1, -1, -1};
  const std::vector<int> sign{1, 1, 1, -1, -1, -1};
  const Sigmoid s = fit_sigmoid(f, sign);
  CHECK(s(1.0) == Approx(4.0 / 5.0).epsilon(1e-7));
  CHECK(s(-1.0) == Approx(1.0 / 5.0).epsilon(1e-7));
}

TEST_CASE("the fit does not depend on the unit of the decision values") {
  const std::vector<double> f{0.9, 0.2, -0.1, 0.4, -0.3, -1.2};
  const std::vector<int> sign{1, 1, 1, -1, -1, -1};
  const Sigmoid one = fit_sigmoid(f, sign);
  for (const double unit : {1e-150, 1e150}) {
    std::vector<double> scaled = f;
    for (double& v : scaled) v *= unit;
    const Sigmoid other = fit_sigmoid(scaled, sign);
    for (std::size_t i = 0; i < f.size(); ++i) CHECK(other(scaled[i]) == Approx(one(f[i])));
  }
}

TEST_CASE("reversed decision values give a constant, never a falling sigmoid") {
  const std::vector<double> f{-1, -2, -1, 1, 2, 1};
  const std::vector<int> sign{1, 1, 1, -1, -1, -1};
  const Sigmoid s = fit_sigmoid(f, sign);
  CHECK(s.slope == 0.0);
  CHECK(s(-5.0) == Approx(0.5));
}

TEST_CASE("sigmoids stay in 0 to 1 whatever they are given") {
  const double top = std::numeric_limits<double>::max();
  const double tiny = std::numeric_limits<double>::denorm_min();
  const std::vector<int> sign{1, -1, 1, -1};
  for (const auto& f : std::vector<std::vector<double>>{{top, -top, top, -top},
                                                        {0, 0, 0, 0},
                                                        {tiny, -tiny, tiny, -tiny},
                                                        {top, tiny, 1, -top}}) {
    const Sigmoid s = fit_sigmoid(f, sign);
    for (const double at : {0.0, 1.0, -1.0, top, -top, tiny}) {
      CHECK(s(at) >= 0.0);
      CHECK(s(at) <= 1.0);
    }
  }
  const Sigmoid steep{-top, top};
  for (const double at : {top, -top, 0.0}) CHECK_FALSE(std::isnan(steep(at)));
}

TEST_CASE(
    "a sigmoid without offset takes the side of the decision value, whatever it learnt from") {
  const std::vector<double> f{2.0, 1.5, 0.8, 1.9, 0.4, -0.2};  // all but one are on the side of
                                                               // class a
  const std::vector<int> sign{1, 1, -1, 1, -1, -1};
  CHECK(fit_sigmoid(f, sign)(0.1) < 0.5);
  const Sigmoid s = fit_sigmoid(f, sign, false);
  CHECK(s.offset == 0.0);
  CHECK(s.slope < 0.0);
  CHECK(s(0.1) > 0.5);
  CHECK(s(-0.1) < 0.5);
  const std::vector<int> opposite{-1, -1, -1, -1, 1, 1};
  CHECK(fit_sigmoid(f, opposite, false)(1.0) == 0.5);
}

// ---- coupling ----

TEST_CASE("pairs that agree with each other give back the probabilities they came from") {
  RandomEngine engine(5);
  for (const std::size_t classes : {2U, 3U, 17U, 60U}) {
    std::vector<double> p;
    for (std::size_t k = 0; k < classes; ++k) p.push_back(std::exp(-6.0 * uniform(engine)));
    const double sum = sum_of(p);
    std::vector<double> r;
    for (const auto& [a, b] : all_pairs(classes)) r.push_back(p[a] / (p[a] + p[b]));
    const std::vector<double> back = couple(r, classes);
    for (std::size_t k = 0; k < classes; ++k) CHECK(back[k] == Approx(p[k] / sum).epsilon(1e-9));
  }
}

TEST_CASE("two classes: coupling changes nothing") {
  for (const double r : {0.5, 0.123, 0.999}) {
    const std::vector<double> p = couple(std::array{r}, 2);
    CHECK(p[0] == Approx(r));
    CHECK(p[1] == Approx(1.0 - r));
  }
}

double disagreement(const std::vector<double>& r, const std::vector<double>& p) {
  double sum = 0.0;
  std::size_t i = 0;
  for (const auto& [a, b] : all_pairs(p.size())) {
    const double d = (1.0 - r[i]) * p[a] - r[i] * p[b];
    sum += d * d;
    ++i;
  }
  return sum;
}

TEST_CASE("pairs that contradict each other are coupled at the least disagreement") {
  RandomEngine engine(9);
  for (const std::size_t classes : {3U, 7U, 20U}) {
    std::vector<double> r;
    for (std::size_t i = 0; i < classes * (classes - 1) / 2; ++i) r.push_back(uniform(engine));
    const std::vector<double> p = couple(r, classes);
    CHECK(sum_of(p) == Approx(1.0));
    const double least = disagreement(r, p);
    for (int t = 0; t < 200; ++t) {  // moving probability from one class to another never helps
      std::vector<double> q = p;
      const std::size_t from = random_below(engine, classes), to = random_below(engine, classes);
      const double step = q[from] * 1e-3 * uniform(engine);
      q[from] -= step;
      q[to] += step;
      CHECK(disagreement(r, q) >= least * (1.0 - 1e-12));
    }
  }
}

TEST_CASE("a circle of certain duels leaves all three equally likely, a champion nearly all") {
  const std::vector<double> circle = couple(std::array{1.0, 0.0, 1.0}, 3);
  for (const double p : circle) CHECK(p == Approx(1.0 / 3.0).epsilon(1e-6));
  for (const std::size_t classes : {2U, 17U, 60U, 500U}) {
    const std::vector<double> p =
        couple(std::vector<double>(classes * (classes - 1) / 2, 1.0), classes);
    CHECK(p[0] > 0.99);
    CHECK(sum_of(p) == Approx(1.0));
    for (const double v : p) CHECK(v >= 0.0);
  }
}

// ---- reliability ----

TEST_CASE("reliability of a handful of answers, by hand") {
  Matrix p(4, 2);
  const double first[] = {0.95, 0.95, 0.65, 0.35};
  for (std::size_t r = 0; r < 4; ++r) {
    p(r, 0) = first[r];
    p(r, 1) = 1.0 - first[r];
  }
  const std::vector<std::size_t> answer{0, 0, 0, 1}, truth{0, 1, 0, 1};
  const auto out = reliability(p, answer, truth);
  REQUIRE(out);
  CHECK(out->bins[9].count == 2);
  CHECK(out->bins[9].predicted == Approx(0.95));
  CHECK(out->bins[9].observed == Approx(0.5));
  CHECK(out->bins[6].count == 2);
  CHECK(out->bins[6].observed == Approx(1.0));
  CHECK(out->calibration_error == Approx(0.5 * 0.45 + 0.5 * 0.35));
  CHECK(out->brier == Approx(2.0 * (0.0025 + 0.9025 + 0.1225 + 0.1225) / 4.0));
  CHECK(out->log_loss == Approx(-(std::log(0.95) + std::log(0.05) + 2.0 * std::log(0.65)) / 4.0));
}

TEST_CASE("certain and right scores 0, certain and wrong 2, and both stay finite") {
  Matrix p(1, 3);
  p(0, 0) = 1.0;
  const std::vector<std::size_t> zero{0}, two{2};
  CHECK(reliability(p, zero, zero)->brier == 0.0);
  CHECK(reliability(p, zero, zero)->bins.back().count == 1);
  CHECK(reliability(p, zero, two)->brier == 2.0);
  CHECK(std::isfinite(reliability(p, zero, two)->log_loss));
}

TEST_CASE("reliability refuses what is no probability and sizes that disagree") {
  Matrix p(1, 2, 0.5);
  const std::vector<std::size_t> one{0}, beyond{2}, none;
  CHECK_FALSE(reliability(p, one, beyond));
  CHECK_FALSE(reliability(p, one, none));
  CHECK_FALSE(reliability(p, one, one, 0));
  CHECK_FALSE(reliability(Matrix(), none, none));
  p(0, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK(reliability(p, one, one).error().expected == "0 to 1");
}

// ---- all parts, on trained models ----

// Three classes on a line at 0, d, 2d with unit noise; a second column is noise only. Posterior:
// density of the class over the sum of densities.
constexpr double spacing = 1.5;

std::vector<double> true_posterior(double x) {
  std::vector<double> p;
  for (int c = 0; c < 3; ++c) p.push_back(std::exp(-0.5 * std::pow(x - spacing * c, 2)));
  const double sum = sum_of(p);
  for (double& v : p) v /= sum;
  return p;
}

FeatureMatrix on_a_line(std::size_t per_class, std::uint64_t seed) {
  RandomEngine engine(seed);
  FeatureMatrix out;
  out.names = {"x", "noise"};
  out.values = Matrix(3 * per_class, 2);
  for (std::size_t r = 0; r < out.values.rows(); ++r) {
    out.values(r, 0) = spacing * static_cast<double>(r / per_class) + testing::normal(engine);
    out.values(r, 1) = testing::normal(engine);
    out.labels.push_back(std::string(1, static_cast<char>('a' + r / per_class)));
    out.groups.emplace_back("1");
    out.files.push_back(std::to_string(r));
  }
  return out;
}

TEST_CASE("probabilities of overlapping Gaussian classes come close to their known posterior") {
  const FeatureMatrix train_part = on_a_line(80, 31), test_part = on_a_line(400, 32);
  const auto model = train(train_part, {});
  REQUIRE(model);
  const auto postprocessing = fit_postprocessing(*model, train_part, {});
  REQUIRE(postprocessing);
  Matrix p(test_part.size(), 3);
  std::vector<std::size_t> winner;
  double error = 0.0;
  for (std::size_t r = 0; r < test_part.size(); ++r) {
    const auto reply = predict(*model, *postprocessing, test_part.values.row(r));
    REQUIRE(reply);
    winner.push_back(reply->ballot.winner);
    CHECK(sum_of(reply->probability) == Approx(1.0));
    const std::vector<double> expected = true_posterior(test_part.values(r, 0));
    for (std::size_t k = 0; k < 3; ++k) {
      p(r, k) = reply->probability[k];
      error += std::abs(p(r, k) - expected[k]) / (3.0 * static_cast<double>(test_part.size()));
    }
  }
  const auto out = reliability(p, winner, *class_numbers(test_part, model->labels()));
  REQUIRE(out);
  INFO("mean error " << error << ", calibration error " << out->calibration_error);
  CHECK(error < 0.06);  // for probabilities with a mean of 1/3
  CHECK(out->calibration_error < 0.06);
}

TEST_CASE("held-out decisions are those of a core that never saw the fold") {
  const FeatureMatrix matrix = testing::gaussian_classes(3, 7, 4, 1.5, 8);
  TrainOptions options;
  options.reduction = GENERATE(Reduction::pvalue, Reduction::pca, Reduction::all);
  const auto model = train(matrix, options);
  REQUIRE(model);
  const auto held_out = cross_decisions(*model, matrix, options);
  REQUIRE(held_out);
  const RowsOfLabel rows = rows_by_label(matrix);
  const PairProblem problem = PairMaker(matrix, options).make(rows.at("classa"), rows.at("classc"));
  const CoreInfo& info = model->cores()[1].info();
  TrainOptions fixed = options;
  fixed.grid = {{info.c}, {info.gamma}, {info.threshold}, {info.threshold}};
  fixed.search = Search::libsvm;
  const Fold& fold = problem.folds[1];
  std::vector<int> sign;
  for (const std::size_t i : fold.train) sign.push_back(problem.sign[i]);
  const auto core =
      testing::lone_core(matrix.values.take(problem.rows).take(fold.train), sign, {}, fixed);
  REQUIRE(core);
  for (const std::size_t i : fold.validate) {
    const std::size_t r = problem.rows[i];
    const double f = core->decide(matrix.values.row(r));
    CHECK(held_out->against(r, problem.sign[i] > 0 ? 2 : 0) ==
          Approx(problem.sign[i] * f).margin(5e-3));  // two solvers, to their tolerance
    const std::vector<std::size_t> requested{r};
    CHECK(held_out->of_rows(*model, matrix.values, requested)(0, 1) == Approx(f).margin(5e-3));
  }
}

TEST_CASE("a core's decision on trials of a third class is its own") {
  const FeatureMatrix matrix = testing::gaussian_classes(3, 6, 4, 1.5, 8);
  const auto model = train(matrix, {});
  REQUIRE(model);
  const auto held_out = cross_decisions(*model, matrix, {});
  REQUIRE(held_out);
  const std::vector<std::size_t> requested{7, 0};  // of classes b and a; core 2 separates b from c
  const Matrix f = held_out->of_rows(*model, matrix.values, requested);
  CHECK(f(1, 2) == model->cores()[2].decide(matrix.values.row(0)));
  CHECK(f(0, 2) == held_out->against(7, 2));
  CHECK(f(0, 0) == -held_out->against(7, 0));
}

TEST_CASE("two trials per class and two classes still give probabilities") {
  const FeatureMatrix matrix = testing::gaussian_classes(2, 2, 3, 6.0, 2);
  const auto model = train(matrix, {});
  REQUIRE(model);
  const auto postprocessing = fit_postprocessing(*model, matrix, {});
  REQUIRE(postprocessing);
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const auto reply = predict(*model, *postprocessing, matrix.values.row(r));
    REQUIRE(reply);
    CHECK(sum_of(reply->probability) == Approx(1.0));
    for (const double score : reply->novelty) CHECK_FALSE(std::isnan(score));
  }
}

TEST_CASE(
    "probabilities of a short-list are those of the classes on it; a DAG has none, a list of one "
    "too") {
  const FeatureMatrix matrix = testing::gaussian_classes(6, 6, 4, 2.0, 14);
  const auto model = train(matrix, {});
  REQUIRE(model);
  const auto postprocessing = fit_postprocessing(*model, matrix, {});
  REQUIRE(postprocessing);
  const auto short_list =
      predict(*model, *postprocessing, matrix.values.row(0), {VoteKind::shortlist, 3, nullptr});
  REQUIRE(short_list);
  CHECK(std::count(short_list->probability.begin(), short_list->probability.end(), 0.0) == 3);
  CHECK(sum_of(short_list->probability) == Approx(1.0));
  const auto alone =
      predict(*model, *postprocessing, matrix.values.row(0), {VoteKind::shortlist, 1, nullptr});
  CHECK(alone->ballot.cores == 0);
  CHECK(alone->probability.empty());  // no core was used that could give a certainty
  const auto dag =
      predict(*model, *postprocessing, matrix.values.row(0), {VoteKind::dag, 3, nullptr});
  CHECK(dag->probability.empty());
}

TEST_CASE("aids are the same on any number of threads") {
  const FeatureMatrix matrix = testing::gaussian_classes(4, 6, 4, 1.0, 3);
  TrainOptions one, three;
  one.threads = 1;
  three.threads = 3;
  const auto model = train(matrix, one);
  REQUIRE(model);
  const auto a = fit_postprocessing(*model, matrix, one),
             b = fit_postprocessing(*model, matrix, three);
  REQUIRE(a);
  REQUIRE(b);
  CHECK(a->reject.threshold == b->reject.threshold);
  CHECK(a->calibration.sharpness == b->calibration.sharpness);
  CHECK(a->reject.radius == b->reject.radius);
}

}  // namespace
}  // namespace weft::classifier::vote_probability_test
