#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <new>
#include <set>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/learners/class_folds.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/learners/multi_class_svc.hpp"
#include "classifier/learners/shrinkage_lda.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::baseline_test {
namespace {

using testing::gaussian_classes;
using testing::normal;

Matrix matrix_of(const std::vector<std::vector<double>>& rows) {
  Matrix out(rows.size(), rows.front().size());
  for (std::size_t r = 0; r < rows.size(); ++r)
    std::copy(rows[r].begin(), rows[r].end(), out.row(r).begin());
  return out;
}

double accuracy_on(const TrainedLearner& trained, const FeatureMatrix& matrix) {
  std::size_t right = 0;
  for (std::size_t r = 0; r < matrix.size(); ++r)
    right += trained.labels()[*trained.classify(matrix.values.row(r))] == matrix.labels[r] ? 1 : 0;
  return static_cast<double>(right) / static_cast<double>(matrix.size());
}

std::vector<Learner> available_learners() {
  std::vector<Learner> out = all_learners();
  std::erase_if(out, [](Learner one) { return !is_available(one); });
  return out;
}

/// The other learners end before they could poll a second time whether to stop.
bool asks_twice(Learner learner) {
  return is_choice(learner) || is_cores(learner) || learner == Learner::svc ||
         learner == Learner::trees || learner == Learner::forest || learner == Learner::nn ||
         learner == Learner::mlp2 || learner == Learner::xgb;
}

TEST_CASE("The shrinkage of a small centred table is the one worked out by hand") {
  // rows (1, 0), (-1, 0), (0, 2), (0, -2): covariance diag(1/2, 2), trace 5/2, mean 5/4;
  // distance ((1/4 + 4) - 25/8) / 2 = 9/16; noise ((1 + 1 + 16 + 16)/4 - 17/4) / (2 x 4) = 17/32
  const Matrix rows = matrix_of({{1, 0}, {-1, 0}, {0, 2}, {0, -2}});
  CHECK(ledoit_wolf_shrinkage(rows) == Approx((17.0 / 32.0) / (9.0 / 16.0)));
}

TEST_CASE("A covariance that is already round, or nothing at all, is not shrunk") {
  CHECK(ledoit_wolf_shrinkage(matrix_of({{1, 0}, {-1, 0}, {0, 1}, {0, -1}})) == 0.0);
  CHECK(ledoit_wolf_shrinkage(matrix_of({{0, 0}, {0, 0}})) == 0.0);
}

TEST_CASE("LDA puts the boundary of two like clouds half way between their means") {
  RandomEngine engine(3);
  Matrix rows(400, 2);
  std::vector<std::size_t> of_row;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    of_row.push_back(r % 2);
    rows(r, 0) = (r % 2 == 0 ? 10.0 : 14.0) + normal(engine);
    rows(r, 1) = 1000.0 * normal(engine);
  }
  const auto lda = ShrinkageLda::fit(rows, of_row, 2);
  REQUIRE(lda);
  CHECK(*lda->classify(std::vector{11.8, 0.0}) == 0);
  CHECK(*lda->classify(std::vector{12.2, 0.0}) == 1);
  CHECK_FALSE(lda->classify(std::vector{1.0}));
  CHECK_FALSE(lda->classify(std::vector{1e308, 1e308}));
}

// A table without pattern, the same in any language.
Matrix formula_rows(std::size_t from, std::size_t count, std::size_t features) {
  Matrix out(count, features);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t r = from + i;
    for (std::size_t k = 0; k < features; ++k)
      out(i, k) = static_cast<double>((7 * r + 3 * k * k + r * k + (r / 3) * k * k) % 11);
  }
  return out;
}

TEST_CASE("LDA answers as scikit-learn's with more rows than features and with fewer") {
  // scikit-learn 1.2.1, StandardScaler and LinearDiscriminantAnalysis(solver='lsqr',
  // shrinkage='auto'), trained on rows 0 to 11 of class r % 3, predictions for rows 100 to 139
  const auto answers = [](std::size_t features) {
    std::vector<std::size_t> of_row;
    for (std::size_t r = 0; r < 12; ++r) of_row.push_back(r % 3);
    const auto lda = ShrinkageLda::fit(formula_rows(0, 12, features), of_row, 3);
    REQUIRE(lda);
    const Matrix requested = formula_rows(100, 40, features);
    std::string out;
    for (std::size_t r = 0; r < requested.rows(); ++r)
      out += std::to_string(*lda->classify(requested.row(r)));
    return out;
  };
  CHECK(answers(4) == "1101201200202002002012020020020121101201");
  CHECK(answers(15) == "1201201201202100112112010120021201201201");
}

TEST_CASE("LDA accepts constant columns, doubled rows, single trials and numbers of any size") {
  const double tiny = 1e-300, huge = 1e300;
  const Matrix rows = matrix_of({{7, 1 * huge, 1 * tiny, 0},
                                 {7, 1 * huge, 1 * tiny, 0},
                                 {7, 2 * huge, 3 * tiny, 0},
                                 {7, 2 * huge, 3 * tiny, 0},
                                 {7, 5 * huge, 2 * tiny, 0}});
  const std::vector<std::size_t> of_row = {0, 0, 1, 1, 2};
  const auto lda = ShrinkageLda::fit(rows, of_row, 3);
  REQUIRE(lda);
  for (std::size_t r = 0; r < rows.rows(); ++r) CHECK(*lda->classify(rows.row(r)) == of_row[r]);
  CHECK_FALSE(ShrinkageLda::fit(rows, of_row, 4));
}

TEST_CASE("Two classes of the same trials are no error and no NaN") {
  const Matrix rows = matrix_of({{1, 2}, {3, 4}, {1, 2}, {3, 4}});
  const std::vector<std::size_t> of_row = {0, 0, 1, 1};
  const auto lda = ShrinkageLda::fit(rows, of_row, 2);
  REQUIRE(lda);
  CHECK(lda->classify(std::vector{1.0, 2.0}));
  const auto svc = MultiClassSvc::fit(rows, of_row, 2, {}, {});
  REQUIRE(svc);
  CHECK(svc->classify(std::vector{1.0, 2.0}));
}

TEST_CASE("The multi-class machine votes as libsvm's own pair machines do") {
  const FeatureMatrix data = gaussian_classes(4, 15, 12, 1.2, 11);
  const Classes classes = find_classes(data);
  TrainOptions options;
  options.grid.c = {2.0};
  options.grid.gamma = {0.05};
  options.search = Search::libsvm;
  const auto libsvm = MultiClassSvc::fit(data.values, classes.of_row, 4, {}, options);
  options.search = Search::fast;
  const auto ours = MultiClassSvc::fit(data.values, classes.of_row, 4, {}, options);
  REQUIRE((libsvm && ours));
  const FeatureMatrix fresh = gaussian_classes(4, 50, 12, 1.2, 12);
  std::set<std::size_t> answers;
  for (std::size_t r = 0; r < fresh.size(); ++r) {
    const std::size_t answer = *ours->classify(fresh.values.row(r));
    CHECK(answer == *libsvm->classify(fresh.values.row(r)));
    answers.insert(answer);
  }
  CHECK(answers.size() == 4);
}

TEST_CASE(
    "The grid of the multi-class machine takes the fewest errors, then the smallest C and gamma") {
  const FeatureMatrix data = gaussian_classes(3, 20, 8, 2.5, 21);
  const Classes classes = find_classes(data);
  const auto folds = class_folds(data, {}).folds;
  TrainOptions options;
  const auto chosen = MultiClassSvc::fit(data.values, classes.of_row, 3, folds, options);
  REQUIRE(chosen);
  std::size_t least = data.size();
  for (const double c : options.grid.c) {
    for (const double gamma : options.grid.gamma) {
      TrainOptions one = options;
      one.grid.c = {c};
      one.grid.gamma = {gamma};
      const auto alone = MultiClassSvc::fit(data.values, classes.of_row, 3, folds, one);
      REQUIRE(alone);
      if (alone->cv_errors() >= least) continue;
      least = alone->cv_errors();
      if (least == chosen->cv_errors()) {
        CHECK(c == chosen->c());
        CHECK(gamma == chosen->gamma());
      }
    }
  }
  CHECK(least == chosen->cv_errors());
}

TEST_CASE("Folds of many classes hold every row once, keep units whole and train on every class") {
  FeatureMatrix data = gaussian_classes(5, 12, 2, 1, 31);
  for (std::size_t r = 0; r < data.size(); ++r)  // windows of four recordings a class
    data.files[r] = data.labels[r] + std::to_string(r % 4) + "#w" + std::to_string(r);
  const Classes classes = find_classes(data);
  const auto unit = row_units(data, FoldUnit::recording);
  const auto folds = class_folds(classes.of_row, {unit}, 5, 7).folds;
  REQUIRE(folds.size() == 4);
  std::multiset<std::size_t> validated;
  for (const Fold& fold : folds) {
    std::set<std::size_t> inside, outside;
    for (const std::size_t r : fold.validate) inside.insert(unit[r]);
    for (const std::size_t r : fold.train) outside.insert(unit[r]);
    for (const std::size_t u : inside) CHECK(outside.count(u) == 0);
    CHECK(fold.validate.size() == 15);  // three windows of each class
    validated.insert(fold.validate.begin(), fold.validate.end());
  }
  CHECK(validated.size() == data.size());
  CHECK(std::set<std::size_t>(validated.begin(), validated.end()).size() == data.size());
  CHECK(class_folds(classes.of_row, {unit}, 5, 7).folds.front().validate == folds.front().validate);
}

TEST_CASE("A single group is dealt by rows, and two rows of a class cannot be folded") {
  const FeatureMatrix data = gaussian_classes(3, 4, 2, 1, 41);
  const Classes classes = find_classes(data);
  const UnitLevels one_unit = {std::vector<std::size_t>(data.size(), 0),
                               unit_levels(data, FoldUnit::recording).back()};
  CHECK(class_folds(classes.of_row, one_unit, 5, 1).folds.size() == 4);
  const std::vector<std::size_t> few = {0, 0, 1, 1};
  CHECK(class_folds(few, {{0, 1, 2, 3}}, 5, 1).folds.empty());
}

TEST_CASE("Every learner tells clear classes apart and knows its name") {
  const FeatureMatrix data = gaussian_classes(4, 10, 4, 6, 51);
  const FeatureMatrix fresh = gaussian_classes(4, 10, 4, 6, 52);
  for (const Learner learner : available_learners()) {
    const auto chosen = train_learner(data, learner, {});
    REQUIRE(chosen);
    CHECK(accuracy_on(chosen->trained, fresh) >= 0.95);
    CHECK(*learner_from(to_string(learner)) == learner);
  }
  CHECK(*learner_from("cores-pca") == Learner::pca);
  for (const char* wrong : {"", "cores-", "cores-lda", "cores-cores-best", "Lda"})
    CHECK_FALSE(learner_from(wrong));
}

TEST_CASE("Few trials are tried in five rounds, each over other folds") {
  const FeatureMatrix data = gaussian_classes(3, 8, 6, 1.0, 5);
  std::size_t sum = 0;
  std::set<std::size_t> of_one_round;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::size_t errors = 0;
    const auto folds = class_folds(data, {.seed = seed}).folds;
    for (const Fold& fold : folds) {
      const auto lda = train_recipe(select_rows(data, fold.train), {Learner::lda}, {}).value();
      for (const std::size_t r : fold.validate)
        errors += lda.labels()[*lda.classify(data.values.row(r))] == data.labels[r] ? 0 : 1;
    }
    sum += errors;
    of_one_round.insert(errors);
  }
  CHECK(of_one_round.size() > 1);
  const auto chosen = train_learner(data, Learner::best, {.seed = 1}).value();
  CHECK(chosen.scores.front().errors == sum);
  CHECK(chosen.scores.front().tested == 5 * data.size());
}

TEST_CASE("A hundred trials are tried in one round") {
  for (const auto& [classes, rows] : {std::pair{3U, 33U}, std::pair{4U, 25U}}) {
    const FeatureMatrix data = gaussian_classes(classes, rows, 4, 3, 7);
    const auto chosen = train_learner(data, Learner::cores_best, {}).value();
    const std::size_t rounds = data.size() < 100 ? 5 : 1;
    CHECK(chosen.scores.front().rounds == rounds);
    CHECK(chosen.scores.front().tested == rounds * data.size());
  }
}

TEST_CASE("The first of the candidates with the fewest errors is taken, tried on every trial") {
  FeatureMatrix data = gaussian_classes(2, 30, 3, 0, 61);  // a ball in a shell: LDA finds no
                                                           // difference
  for (std::size_t r = 0; r < data.size(); ++r)
    for (double& value : data.values.row(r)) value *= data.labels[r] == "classa" ? 1.0 : 4.0;
  const auto chosen = train_learner(data, Learner::best, {});
  REQUIRE(chosen);
  REQUIRE(chosen->scores.size() == 15);
  const std::size_t all = chosen->scores.front().rounds * data.size();
  const auto least = std::ranges::min_element(chosen->scores, {}, &RecipeScore::errors);
  CHECK(least->errors > 0);
  CHECK(least->errors < chosen->scores.front().errors);
  CHECK(least->tested == all);
  CHECK(least->recipe == chosen->recipe);
  // The others were dropped only when they could not win any longer.
  std::size_t before = all;
  for (const RecipeScore& score : chosen->scores) {
    CHECK((score.tested == all || score.errors >= before));
    before = std::min(before, score.errors);
  }
  const auto cores = train_learner(data, Learner::cores_best, {});
  REQUIRE(cores);
  CHECK(cores->trained.cores() != nullptr);
  const auto first = std::ranges::min_element(cores->scores, {}, &RecipeScore::errors);
  CHECK(std::ranges::count(cores->scores, first->errors, &RecipeScore::errors) > 1);
  CHECK(first->recipe == cores->recipe);
}

TEST_CASE("Where nothing can be tried the simplest candidate is taken") {
  const auto chosen = train_learner(gaussian_classes(3, 2, 4, 3, 7), Learner::best, {});
  REQUIRE(chosen);
  for (const RecipeScore& score : chosen->scores) CHECK((score.tested == 0 && score.errors == 0));
  CHECK(chosen->recipe == Recipe{Learner::lda, 20});
}

TEST_CASE("Compression brings a tail that hides everything else back into sight") {
  FeatureMatrix data = gaussian_classes(2, 40, 1, 0, 71);
  for (std::size_t r = 0; r < data.size(); ++r)  // signed numbers from 1e-2 to 1e6
    data.values(r, 0) = (data.labels[r] == "classa" ? 1 : -1) *
                        std::pow(10.0, static_cast<double>(r % 40) / 5.0 - 2.0);
  const auto plain = train_recipe(data, {Learner::lda, 20}, {});
  const auto compressed = train_recipe(data, {Learner::lda, 20, View::compressed}, {});
  REQUIRE((plain && compressed));
  CHECK(accuracy_on(*compressed, data) >= accuracy_on(*plain, data));
  CHECK_FALSE(compressed->classify(std::vector{1.0, 2.0}));
}

TEST_CASE("Every learner refuses unusable training data") {
  FeatureMatrix one = gaussian_classes(1, 5, 3, 1, 81);
  FeatureMatrix bad = gaussian_classes(2, 5, 3, 1, 82);
  bad.values(3, 1) = std::nan("");
  for (const Learner learner : all_learners()) {
    CHECK_FALSE(train_learner(one, learner, {}));
    CHECK_FALSE(train_learner(bad, learner, {}));
  }
}

TEST_CASE("A training that is stopped ends soon with that error, for every learner") {
  const FeatureMatrix data = gaussian_classes(4, 8, 6, 1.5, 83);
  for (const Learner learner : available_learners()) {
    INFO(to_string(learner));
    std::atomic<int> requested{0};
    TrainOptions options;
    options.threads = 2;
    options.stop = [&] { return ++requested > 1; };
    const auto trained = train_learner(data, learner, options);
    if (asks_twice(learner)) {
      REQUIRE_FALSE(trained);
      CHECK(trained.error().code == Errc::wrong_state);
    }
    CHECK(requested <= 64);
    options.stop = [] { return false; };
    CHECK(train_learner(data, learner, options));
  }
}

TEST_CASE("A training that runs out of memory on any thread ends with that, whatever is trained") {
  const FeatureMatrix data = gaussian_classes(4, 8, 6, 1.5, 84);
  for (const Learner learner : available_learners()) {
    CAPTURE(to_string(learner));
    std::atomic<int> requested{0};
    TrainOptions options;
    options.threads = 3;
    options.stop = [&]() -> bool {
      if (++requested > (asks_twice(learner) ? 4 : 0)) throw std::bad_alloc();
      return false;
    };
    const auto trained = train_learner(data, learner, options);
    REQUIRE_FALSE(trained);
    const std::string reply = to_string(trained.error());
    CHECK(reply.find("memory") != std::string::npos);
    CHECK(reply.find("feature vectors") != std::string::npos);
  }
  TrainOptions options;
  const auto lda = train_recipe(data, {Learner::lda}, options);
  REQUIRE(lda);
  options.stop = []() -> bool { throw std::bad_alloc(); };
  CHECK_FALSE(fit_postprocessing(*lda, data, options));
}

TEST_CASE("Cores evaluated as a learner score as cores evaluated by themselves") {
  const FeatureMatrix data = gaussian_classes(4, 12, 10, 1.5, 91);
  const auto splits = stratified_splits(data.labels, 0.5, 3, 1);
  REQUIRE(splits);
  TrainOptions options;
  Confusion plain(find_classes(data).labels);
  for (const Split& split : *splits) {
    const auto model = train(select_rows(data, split.train), options).value();
    for (const std::size_t r : split.test)
      ++plain.at(find_place(plain.labels, data.labels[r]),
                 model.classify(data.values.row(r)).value().winner);
  }
  const auto learner = evaluate(data, *splits, Learner::pvalue, options);
  REQUIRE(learner);
  CHECK(plain.count == learner->confusion.count);
  CHECK(learner->recipes.size() == 3);
  CHECK(learner->accuracy == Approx(plain.accuracy()));
}

}  // namespace
}  // namespace weft::classifier::baseline_test
