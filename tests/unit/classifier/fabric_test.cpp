#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/learn/svm_solver.hpp"
#include "tests/unit/allocations.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::fabric_test {
namespace {

using testing::gaussian_classes;

std::vector<double> decisions(const FabricModel& model, const FeatureMatrix& matrix) {
  std::vector<double> out;
  for (const Vote& vote : testing::votes_on(model, matrix)) {
    out.insert(out.end(), vote.decision.begin(), vote.decision.end());
  }
  return out;
}

std::size_t errors(const FabricModel& model, const FeatureMatrix& matrix) {
  std::size_t out = 0;
  const auto votes = testing::votes_on(model, matrix);
  for (std::size_t r = 0; r < votes.size(); ++r) {
    if (model.labels()[votes[r].winner] != matrix.labels[r]) ++out;
  }
  return out;
}

TEST_CASE("Well separated fabrics are told apart by every kind of reduction") {
  const FeatureMatrix train_set = gaussian_classes(4, 8, 3, 12.0, 1);
  const FeatureMatrix test_set = gaussian_classes(4, 20, 3, 12.0, 2);
  for (const Reduction r : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
    INFO(to_string(r));
    const auto model = train(train_set, {.reduction = r});
    REQUIRE(model);
    CHECK(model->cores().size() == 6);
    CHECK(errors(*model, test_set) <= 1);
  }
}

TEST_CASE("A core selects the features that differ, with their p-values in rising order") {
  const FeatureMatrix matrix = gaussian_classes(2, 10, 40, 6.0, 3);  // only f0 differs
  const auto model = train(matrix);
  REQUIRE(model);
  const CoreInfo& info = model->cores()[0].info();
  REQUIRE(info.selected.size() == info.inputs);
  CHECK(info.selected[0].column == 0);
  CHECK(info.selected[0].p_value < 1e-6);
  CHECK(std::exp(info.selected[0].log_p) == Approx(info.selected[0].p_value).epsilon(1e-12));
  for (std::size_t k = 1; k < info.selected.size(); ++k) {
    CHECK(info.selected[k].p_value >= info.selected[k - 1].p_value);
    CHECK(info.selected[k].p_value < info.threshold);
  }
}

TEST_CASE(
    "The model does not depend on the number of threads, nor on the order of the trials' labels") {
  const FeatureMatrix matrix = gaussian_classes(4, 6, 10, 2.0, 4);
  const auto one = train(matrix, {.threads = 1});
  const auto three = train(matrix, {.threads = 3});
  REQUIRE(one);
  CHECK(decisions(*one, matrix) == decisions(*three, matrix));
  std::vector<std::size_t> by_fold;  // classes interleaved, each class in the same order
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t c = 4; c-- > 0;) by_fold.push_back(6 * c + i);
  }
  CHECK(decisions(train(select_rows(matrix, by_fold)).value(), matrix) == decisions(*one, matrix));
}

TEST_CASE("Solving each subset size once gives the same scores as solving every delta by itself") {
  const FeatureMatrix matrix = gaussian_classes(2, 8, 30, 1.5, 5);
  std::vector<int> sign(8, 1);
  sign.resize(16, -1);
  std::vector<std::size_t> unit(16);
  for (std::size_t i = 0; i < 16; ++i) unit[i] = i;
  const auto folds = stratified_folds(sign, unit, 5, 1);
  TrainOptions options;
  options.search = Search::whole;
  options.grid.c = {2, 512};
  options.grid.gamma = {0.01, 0.5};
  const auto search = [&](const TrainOptions& o) {
    return GridSearch()
        .run(matrix.values, sign, Reducer::fit(matrix.values, sign, o), folds, o)
        .value();
  };
  const GridResult joint = search(options);
  std::size_t fits_alone = 0;
  for (std::size_t d = 0; d < options.grid.delta.size(); ++d) {
    TrainOptions single = options;
    single.grid.delta = {options.grid.delta[d]};
    const GridResult alone = search(single);
    fits_alone += alone.fits;
    for (std::size_t i = 0; i < 4; ++i) {
      CHECK(joint.scores[4 * d + i].errors == alone.scores[i].errors);
      CHECK(joint.scores[4 * d + i].loss == alone.scores[i].loss);
    }
  }
  CHECK(joint.fits <= fits_alone);
}

TEST_CASE("The fast search, the whole one and libsvm's train the same cores, bit for bit") {
  std::size_t fast_fits = 0, plain_fits = 0;
  for (const Reduction reduction : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
    for (const Tie tie : {Tie::loss, Tie::order}) {
      for (const bool nested : {true, false}) {
        const FeatureMatrix matrix = gaussian_classes(4, 8, 30, 0.9, nested ? 21 : 22);
        TrainOptions options{.reduction = reduction, .nested = nested, .tie = tie};
        const auto fast = train(matrix, options).value();
        options.search = Search::whole;
        const auto whole = train(matrix, options).value();
        options.search = Search::libsvm;
        const auto plain = train(matrix, options).value();
        for (std::size_t i = 0; i < fast.cores().size(); ++i) {
          INFO(to_string(reduction)
               << ", tie " << static_cast<int>(tie) << ", nested " << nested << ", core " << i);
          for (const FabricModel* other : {&whole, &plain}) {
            const FabricCore& core = fast.cores()[i];
            const FabricCore& same = other->cores()[i];
            CHECK(core.info().c == same.info().c);
            CHECK(core.info().gamma == same.info().gamma);
            CHECK(core.info().threshold == same.info().threshold);
            CHECK(core.info().cv_errors == same.info().cv_errors);
            CHECK(core.info().cv_loss == same.info().cv_loss);
            CHECK(core.reducer().columns() == same.reducer().columns());
            CHECK(core.coefficient() == same.coefficient());
            CHECK(core.bias() == same.bias());
          }
          fast_fits += fast.cores()[i].info().fits;
          plain_fits += plain.cores()[i].info().fits;
        }
      }
    }
  }
  CHECK(fast_fits < plain_fits / 2);
}

TEST_CASE("Nested selection never sees the held-out trials: noise alone scores at chance") {
  // 400 features of pure noise: chosen outside the folds they look separable, inside they do not.
  std::size_t nested_errors = 0, paper_errors = 0, trials = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const FeatureMatrix noise = gaussian_classes(2, 10, 400, 0.0, 100 + seed);
    TrainOptions options;
    options.grid.c = {8};
    options.grid.gamma = {0x1p-5};
    options.grid.delta = {1e-2};
    nested_errors += train(noise, options).value().cross_validation().errors;
    options.nested = false;
    paper_errors += train(noise, options).value().cross_validation().errors;
    trials += noise.size();
  }
  CHECK(nested_errors > trials * 35 / 100);
  CHECK(paper_errors < trials * 20 / 100);
}

TEST_CASE("Votes: most votes, then the sum of tanh(f), then the lowest class") {
  const auto pairs = all_pairs(3);  // (0,1) (0,2) (1,2)
  CHECK(count_votes(pairs, {1, 1, 1}, 3).winner == 0);
  CHECK(count_votes(pairs, {-1, 0.1, 1}, 3).winner == 1);
  // a cycle, one vote each: 0 beats 1, 1 beats 2, 2 beats 0 by the largest margin
  const Vote cycle = count_votes(pairs, {0.5, -2.0, 0.6}, 3);
  CHECK(cycle.votes == std::vector<int>{1, 1, 1});
  CHECK(cycle.winner == 2);
  CHECK(cycle.support[0] == Approx(std::tanh(0.5) - std::tanh(2.0)));
  CHECK(count_votes(pairs, {1.0, -1.0, 1.0}, 3).winner == 0);          // all equal
  CHECK(count_votes(pairs, {1.0, -1.0, 1.0 + 1e-12}, 3).winner == 0);  // equal to 1e-9
}

// The computation of PackedCore as plain loops.
double plain_decision(const FabricCore& core, std::span<const double> features) {
  std::vector<double> x(core.reducer().directions());
  core.reducer().project(features, x);
  std::vector<double> kernel(core.support().rows());
  for (std::size_t s = 0; s < kernel.size(); ++s)
    for (std::size_t k = 0; k < x.size(); ++k)
      kernel[s] += (x[k] - core.support()(s, k)) * (x[k] - core.support()(s, k));
  exp_of_negative(kernel, core.info().gamma);
  double f = 0.0;
  for (std::size_t s = 0; s < kernel.size(); ++s) f += core.coefficient()[s] * kernel[s];
  return f + core.bias();
}

TEST_CASE("A core's packed decision is that of the plain loops, bit for bit, without allocation") {
  for (const std::size_t columns : {std::size_t{1}, std::size_t{30}, std::size_t{1500}}) {
    const FeatureMatrix matrix = gaussian_classes(3, 9, columns, 0.7, 31);
    for (const Reduction r : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
      INFO(to_string(r) << ", " << columns << " columns");
      const auto model = train(matrix, {.reduction = r}).value();
      for (const FabricCore& core : model.cores()) {
        for (std::size_t row = 0; row < matrix.size(); ++row) {
          const std::size_t before = allocations();
          const double f = core.decide(matrix.values.row(row));
          if (columns < 1000) CHECK(allocations() == before);
          CHECK(f == plain_decision(core, matrix.values.row(row)));
        }
      }
    }
  }
}

void check_finite(const FabricModel& model, const FeatureMatrix& matrix) {
  for (const Vote& vote : testing::votes_on(model, matrix)) {
    for (const double f : vote.decision) CHECK(std::isfinite(f));
    for (const double s : vote.support) CHECK(std::isfinite(s));
    CHECK(std::accumulate(vote.votes.begin(), vote.votes.end(), 0) == 1);
    CHECK(vote.votes[vote.winner] == 1);
  }
}

TEST_CASE("A fabric compared with itself is decided without failing") {
  FeatureMatrix duplicates = gaussian_classes(1, 12, 6, 1.0, 6);
  for (std::size_t r = 6; r < 12; ++r) {
    std::copy(duplicates.values.row(r - 6).begin(), duplicates.values.row(r - 6).end(),
              duplicates.values.row(r).begin());
    duplicates.labels[r] = "twin";
  }
  for (const Reduction r : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
    const auto model = train(duplicates, {.reduction = r});
    REQUIRE(model);
    check_finite(*model, duplicates);
  }
}

TEST_CASE("Constant features only: trained, voted, no NaN") {
  FeatureMatrix flat = gaussian_classes(2, 4, 3, 1.0, 7);
  flat.values = Matrix(8, 3, 5.0);
  for (const Reduction r : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
    const auto model = train(flat, {.reduction = r});
    REQUIRE(model);
    check_finite(*model, flat);
  }
}

TEST_CASE("Training refuses one label, a label with one trial, NaN, and columns without names") {
  FeatureMatrix matrix = gaussian_classes(2, 4, 3, 1.0, 8);
  FeatureMatrix lonely = matrix;
  lonely.labels[0] = "Denim";
  const auto refused = train(lonely);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where == "label Denim");
  FeatureMatrix single = matrix;
  single.labels.assign(8, "Wool");
  CHECK_FALSE(train(single));
  FeatureMatrix nan = matrix;
  nan.values(2, 1) = std::nan("");
  const auto bad = train(nan);
  REQUIRE_FALSE(bad);
  CHECK(bad.error().where == "2.csv: f1");
  matrix.names.pop_back();
  CHECK_FALSE(train(matrix));
}

TEST_CASE("Training refuses unusable options and folds") {
  const FeatureMatrix matrix = gaussian_classes(2, 4, 3, 1.0, 9);
  TrainOptions options;
  options.grid.c = {};
  CHECK_FALSE(train(matrix, options));
  options = {};
  options.grid.gamma = {-1.0};
  CHECK_FALSE(train(matrix, options));
  options = {};
  options.grid.delta = {2.0};
  CHECK_FALSE(train(matrix, options));
  options = {.cap = 0};
  CHECK_FALSE(train(matrix, options));
  options = {.folds = 1};
  CHECK_FALSE(train(matrix, options));
  options = {};
  options.make_folds = [](std::span<const int>) { return std::vector<Fold>{{{0, 1}, {2}}}; };
  CHECK_FALSE(train(matrix, options));
  options.make_folds = [](std::span<const int>) { return std::vector<Fold>{{{0, 99}, {2}}}; };
  CHECK_FALSE(train(matrix, options));
  // one row of each class: no degree of freedom for a selection inside the fold
  options.make_folds = [](std::span<const int>) { return std::vector<Fold>{{{0, 4}, {1, 5}}}; };
  const auto tiny = train(matrix, options);
  REQUIRE_FALSE(tiny);
  CHECK(tiny.error().got == "2");
  CHECK_FALSE(tiny.error().hint.empty());
  options.nested = false;
  CHECK(train(matrix, options));
}

TEST_CASE("Two training trials a fabric: the delta is chosen on evidence, not on column 0") {
  // The first 20 of 60 columns are useless, the others separate the four classes; folds of one row
  // each cannot know that (all t are 0) and give 0.55 here.
  const std::size_t classes = 4, trials = 12;
  double accuracy = 0.0;
  std::size_t inputs = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    FeatureMatrix matrix = gaussian_classes(classes, trials, 60, 0.0, seed);
    for (std::size_t r = 0; r < matrix.size(); ++r)
      for (std::size_t k = 20; k < 60; ++k)
        matrix.values(r, k) += ((r / trials >> (k % 2)) & 1U) != 0 ? 2.0 : 0.0;
    const auto splits = stratified_splits(matrix.labels, 2.0 / 12.0, 4, seed).value();
    const auto result = evaluate(matrix, splits, Learner::pvalue, {});
    REQUIRE(result);
    accuracy += result->accuracy / 12.0;
    for (const FabricCore& core : result->trained.cores()->cores()) {
      CHECK(core.info().folds == 4);
      inputs += core.info().inputs;
    }
  }
  CHECK(accuracy > 0.62);
  CHECK(inputs > 2 * 12 * 6);  // 12 models of 6 cores: more than a column each
}

TEST_CASE("Voting refuses another length and NaN") {
  const FeatureMatrix matrix = gaussian_classes(2, 4, 3, 4.0, 10);
  const auto model = train(matrix);
  REQUIRE(model);
  CHECK_FALSE(model->classify(std::vector<double>{1, 2}));
  CHECK_FALSE(model->classify(std::vector<double>{1, 2, std::nan("")}));
  CHECK(model->classify(std::vector<double>{1e300, -1e300, 0}).has_value());
}

}  // namespace
}  // namespace weft::classifier::fabric_test
