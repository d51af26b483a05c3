#include <catch2/catch.hpp>
#include <set>

#include "classifier/evaluate/evaluate.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::evaluate_test {
namespace {

using testing::gaussian_classes;

TEST_CASE("A stratified split trains the fraction of every label and tests the rest") {
  std::vector<std::string> labels(20, "a");
  labels.insert(labels.end(), 5, "b");
  const auto splits = stratified_splits(labels, 0.4, 30, 1);
  REQUIRE(splits);
  std::set<std::vector<std::size_t>> distinct;
  for (const Split& split : *splits) {
    std::size_t a = 0;
    for (const std::size_t r : split.train) a += r < 20 ? 1 : 0;
    CHECK(a == 8);
    CHECK(split.train.size() == 10);
    std::set<std::size_t> all(split.train.begin(), split.train.end());
    all.insert(split.test.begin(), split.test.end());
    CHECK(all.size() == 25);
    distinct.insert(split.train);
  }
  CHECK(distinct.size() > 25);
  CHECK(stratified_splits(labels, 0.4, 1, 1)->front().train == splits->front().train);
}

TEST_CASE("A stratified split refuses odd fractions, no repeats and a label with one trial") {
  const std::vector<std::string> labels = {"a", "a", "a", "b", "b"};
  for (const double fraction : {0.0, 1.0, -1.0, std::nan("")}) {
    CHECK_FALSE(stratified_splits(labels, fraction, 1, 1));
  }
  CHECK_FALSE(stratified_splits(labels, 0.5, 0, 1));
  const auto lonely = stratified_splits(std::vector<std::string>{"a", "a", "b"}, 0.5, 1, 1);
  REQUIRE_FALSE(lonely);
  CHECK(lonely.error().where == "label b");
  const auto two_each = stratified_splits(std::vector<std::string>{"a", "a", "b", "b"}, 0.5, 1, 1);
  REQUIRE_FALSE(two_each);
  CHECK(two_each.error().expected == "at least 3 per label");
  CHECK(stratified_splits(std::vector<std::string>{"a", "a", "b", "b", "b"}, 0.5, 1, 1));
}

TEST_CASE("A stratified split tests every label of three trials or more, whatever the fraction") {
  std::vector<std::string> labels = {"a", "a", "b", "b", "b"};
  labels.insert(labels.end(), 9, "c");
  const auto splits = stratified_splits(labels, 0.99, 5, 1);
  REQUIRE(splits);
  for (const Split& split : *splits) {
    REQUIRE(split.test.size() == 2);
    CHECK(labels[split.test[0]] == "b");
    CHECK(labels[split.test[1]] == "c");
  }
}

TEST_CASE("Labels that no split tests are listed, with their recordings and their group") {
  const std::vector<std::string> labels = {"a", "a", "b", "b", "b", "c", "c", "a"};
  const std::vector<std::string> groups = {"x", "y", "x", "x", "x", "x", "y", "z"};
  const std::vector<std::string> files = {"1", "2", "3#w0", "3#w1", "4", "5", "6", "7"};
  const std::vector<Split> splits = {{{1, 2, 3, 4}, {0}}, {{0, 2, 3, 4}, {1}}};
  const auto never = never_tested(splits, labels, groups, files);
  REQUIRE(never.size() == 2);
  CHECK(never[0].label == "b");
  CHECK(never[0].recordings == 2);
  CHECK(never[0].group == "x");
  CHECK(never[1].label == "c");
  CHECK(never[1].group.empty());
}

TEST_CASE("A grouped split keeps groups whole and leaves the others out") {
  const std::vector<std::string> groups = {"0", "1", "2", "0", "3"};
  const auto split =
      grouped_split(groups, std::vector<std::string>{"0", "3"}, std::vector<std::string>{"2"});
  REQUIRE(split);
  CHECK(split->train == std::vector<std::size_t>{0, 3, 4});
  CHECK(split->test == std::vector<std::size_t>{2});
}

TEST_CASE("A grouped split refuses a group on both sides, an unknown one and empty lists") {
  const std::vector<std::string> groups = {"0", "1"}, zero = {"0"}, one = {"1"}, none,
                                 other = {"7"};
  const auto both = grouped_split(groups, zero, zero);
  REQUIRE_FALSE(both);
  CHECK(both.error().where == "groups");
  CHECK(both.error().got == "0");
  CHECK_FALSE(grouped_split(groups, none, one));
  CHECK_FALSE(grouped_split(groups, zero, none));
  CHECK(grouped_split(groups, zero, other).error().got == "7");
}

TEST_CASE("Recall and accuracy of a confusion matrix worked by hand") {
  Confusion c({"a", "b", "c"});
  c.at(0, 0) = 3;
  c.at(0, 1) = 1;
  c.at(1, 1) = 2;
  CHECK(c.total() == 6);
  CHECK(c.accuracy() == Approx(5.0 / 6.0));
  CHECK(c.recall() == std::vector<double>{0.75, 1.0, 0.0});
  CHECK(c.balanced_accuracy() == 0.875);  // of the two tested labels
  CHECK(c.base_rate() == Approx(4.0 / static_cast<double>(c.total())));
}

TEST_CASE("Wilson's interval has its published values") {
  // Newcombe 1998, Statistics in Medicine 17, table I, method 3: 81/263, 15/148, 0/20, 1/29
  struct Case {
    std::size_t correct, total;
    double low, high;
  };
  for (const Case c : {Case{81, 263, 0.2553, 0.3662}, Case{15, 148, 0.0624, 0.1605},
                       Case{0, 20, 0.0, 0.1611}, Case{1, 29, 0.0061, 0.1718}}) {
    const Interval interval = wilson_interval(c.correct, c.total);
    CHECK(interval.low == Approx(c.low).margin(5e-5));
    CHECK(interval.high == Approx(c.high).margin(5e-5));
  }
  CHECK(wilson_interval(0, 0).high == 1.0);
}

TEST_CASE("The interval over splits has the width of Nadeau and Bengio, worked by hand") {
  const std::vector<double> accuracy = {0.5, 0.6, 0.55};
  CHECK(compute_deviation(accuracy) == Approx(0.05));
  // variance 0.05^2 (1/3 + 8/32) = 0.00145833, t(0.975, 2) = 0.95 / sqrt(2 0.975 0.025) = 4.302653
  const Interval interval = split_interval(accuracy, {32, 8});
  CHECK(interval.low == Approx(0.55 - 0.164310).margin(1e-6));
  CHECK(interval.high == Approx(0.55 + 0.164310).margin(1e-6));
  CHECK(interval.method.find("Nadeau-Bengio") != std::string::npos);
}

TEST_CASE("More splits of the same trials do not narrow the interval to nothing") {
  std::vector<double> accuracy;
  for (int i = 0; i < 10000; ++i) accuracy.push_back(i % 2 == 0 ? 0.8 : 0.9);
  const Interval interval = split_interval(accuracy, {40, 60});
  CHECK(interval.high - interval.low > 2.0 * 1.95 * 0.05 * std::sqrt(1.5));
}

TEST_CASE("Splits that all agree have the interval of one of them, not none") {
  const Interval all_right = split_interval(std::vector<double>{1.0, 1.0, 1.0}, {8, 12});
  CHECK(all_right.high == 1.0);
  CHECK(all_right.low == Approx(wilson_interval(12, 12).low));
  CHECK(all_right.low < 0.8);
  const Interval same = split_interval(std::vector<double>(10, 0.9), {8, 10});  // mean 0.9 + 1e-16
  CHECK(same.low == Approx(wilson_interval(9, 10).low));
}

TEST_CASE("Splits of unlike size weigh by what they asked, worked by hand, in any order") {
  const std::vector<SplitShare> shares = {{1, 2}, {3, 8}, {2, 5}};
  // 6 of 15; (part - 0.4 whole) / 5 is 0.04, -0.04, 0: sd 0.04, 4.302653 * 0.04 sqrt(1/3 + 5/10)
  const Interval interval = split_interval(shares, {10, 5});
  CHECK(interval.low == Approx(0.4 - 0.157110).margin(1e-6));
  CHECK(interval.high == Approx(0.4 + 0.157110).margin(1e-6));
  const std::vector<SplitShare> other = {shares[2], shares[0], shares[1]};
  CHECK(split_interval(other, {10, 5}).low == Approx(interval.low).epsilon(1e-12));
  const std::vector<SplitShare> agree = {{2, 2}, {8, 8}, {5, 5}}, none = {{0, 0}, {0, 0}};
  CHECK(split_interval(agree, {10, 5}).low == Approx(wilson_interval(5, 5).low));
  CHECK(split_interval(none, {10, 5}).low == 0.0);
  CHECK(split_interval(none, {10, 5}).high == 1.0);
  const std::vector<SplitShare> one = {{6, 8}};
  CHECK(split_interval(one, {8, 8}).low == wilson_interval(6, 8).low);
  CHECK(split_interval(one, {8, 8}).method == wilson_interval(6, 8).method);
}

// Groups with one of two accuracies for their trials.
double coverage_of_groups(std::size_t groups, std::size_t trials, std::uint64_t seed) {
  constexpr double good = 0.98, bad = 0.62, share_of_bad = 0.2;
  constexpr int sets = 2000;
  const double truth = good + share_of_bad * (bad - good);
  RandomEngine engine(seed);
  const auto happens = [&](double p) {
    return static_cast<double>(engine() % 1'000'000) < 1e6 * p;
  };
  int covered = 0;
  for (int set = 0; set < sets; ++set) {
    std::vector<SplitShare> shares(groups, {0.0, static_cast<double>(trials)});
    for (SplitShare& one : shares) {
      const double p = happens(share_of_bad) ? bad : good;
      for (std::size_t i = 0; i < trials; ++i) one.part += happens(p) ? 1.0 : 0.0;
    }
    const auto n = static_cast<double>(groups), m = static_cast<double>(trials);
    const Interval interval = split_interval(shares, {(n - 1) * m, m, true});
    covered += interval.low <= truth && truth <= interval.high ? 1 : 0;
  }
  return static_cast<double>(covered) / sets;
}

TEST_CASE("Groups are what is counted: their number is a floor, and few errors move it little") {
  const auto interval = [](double errors) {
    std::vector<SplitShare> shares(100, {3.0, 3.0});
    for (int i = 0; i < errors; ++i) shares[static_cast<std::size_t>(i)].part = 2.0;
    return split_interval(shares, {297, 3, true});
  };
  CHECK(interval(0).low == Approx(wilson_interval(100, 100).low));  // 96.3 %
  CHECK(interval(0).method == "Wilson score of 100 groups, all groups agree");
  for (int errors = 0; errors < 30; ++errors) {
    const Interval here = interval(errors), next = interval(errors + 1);
    CAPTURE(errors, here.low, next.low);
    CHECK(std::abs(here.low - next.low) < 0.02);
    CHECK(std::abs(here.high - next.high) < 0.02);
  }
  for (const auto& [groups, trials] : {std::pair{4U, 40U}, {10U, 10U}, {30U, 5U}}) {
    CAPTURE(groups, trials);
    CHECK(coverage_of_groups(groups, trials, groups) >= 0.95);
  }
  const std::vector<std::string> names{"a", "a", "b", "b", "c", ""}, labels(6, "x");
  const auto left_out = leave_one_group_out(std::span(names).first(5), std::span(labels).first(5));
  REQUIRE(left_out);
  CHECK(mean_sizes(*left_out).whole_groups);
  CHECK(groups_on_both_sides(*left_out, names).empty());
  const std::vector<Split> mixed{{{0, 2, 5}, {1, 3, 4}}, {{0, 1}, {2, 3}}};
  CHECK_FALSE(mean_sizes(mixed).whole_groups);
  CHECK(groups_on_both_sides(mixed, names) == std::vector<std::string>{"a", "b"});
}

TEST_CASE("The interval over groups left out does not depend on which group comes first") {
  const FeatureMatrix matrix = gaussian_classes(3, 20, 4, 1.0, 11);
  std::vector<std::string> groups;
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const std::size_t trial = r % 20;  // groups of 2, 6 and 12 of 20 trials
    groups.emplace_back(trial < 2 ? "small" : trial < 8 ? "mid" : "large");
  }
  auto splits = leave_one_group_out(groups, matrix.labels).value();
  REQUIRE(splits.front().test.size() != splits.back().test.size());
  const auto forward = evaluate(matrix, splits, Learner::lda, {});
  std::ranges::reverse(splits);
  const auto backward = evaluate(matrix, splits, Learner::lda, {});
  REQUIRE((forward && backward));
  CHECK(forward->deviation > 0.0);
  CHECK(forward->ci95.low == Approx(backward->ci95.low).epsilon(1e-12));
  CHECK(forward->ci95.high == Approx(backward->ci95.high).epsilon(1e-12));
}

TEST_CASE(
    "Repetitions with data of their own have Student's interval, or that of one if all agree") {
  const std::vector<double> accuracy = {0.5, 0.6, 0.55};
  // 4.302653 * 0.05 / sqrt(3)
  const Interval interval = repetition_interval(accuracy, 8);
  CHECK(interval.low == Approx(0.55 - 0.124207).margin(1e-6));
  CHECK(interval.high == Approx(0.55 + 0.124207).margin(1e-6));
  const Interval same = repetition_interval(std::vector<double>{0.75, 0.75}, 8);
  CHECK(same.low == Approx(wilson_interval(6, 8).low));
  CHECK(same.high == Approx(wilson_interval(6, 8).high));
  CHECK(same.method == "Wilson score of one repetition, all repetitions agree");
}

TEST_CASE("Permuting the labels brings the accuracy to chance, the true labels do not") {
  const FeatureMatrix matrix = gaussian_classes(4, 20, 20, 3.0, 1);
  const auto splits = stratified_splits(matrix.labels, 0.4, 6, 2).value();
  const auto honest = evaluate(matrix, splits, Learner::pvalue, {});
  REQUIRE(honest);
  CHECK(honest->accuracy > 0.8);
  const auto permuted = evaluate_permuted(matrix, Learner::pvalue, {}, {.permutations = 12});
  REQUIRE(permuted);
  REQUIRE(permuted->accuracy.size() == 12);
  CHECK(permuted->trials == 12 * 48);
  CHECK(permuted->chance == Approx(0.25).epsilon(1e-12));
  CHECK(permuted->mean == Approx(compute_mean(permuted->accuracy)));
  // 576 answers at chance: standard deviation 0.018; four of them are exceeded once in 16 000 seeds
  CHECK(permuted->mean == Approx(0.25).margin(4 * 0.018));
}

TEST_CASE("Permutations repeat with their seed, differ among each other, and none is refused") {
  const FeatureMatrix matrix = gaussian_classes(3, 8, 5, 2.0, 5);
  const PermutationOptions options{.train_fraction = 0.5, .permutations = 6, .splits = 2};
  const auto once = evaluate_permuted(matrix, Learner::pvalue, {.seed = 3}, options);
  const auto again = evaluate_permuted(matrix, Learner::pvalue, {.seed = 3}, options);
  REQUIRE(once);
  CHECK(once->trials == 6 * 2 * 12);
  CHECK(once->accuracy == again->accuracy);
  CHECK(std::set<double>(once->accuracy.begin(), once->accuracy.end()).size() > 1);
  CHECK_FALSE(evaluate_permuted(matrix, Learner::pvalue, {}, {.permutations = 0}));
  CHECK_FALSE(evaluate_permuted(matrix, Learner::pvalue, {}, {.train_fraction = 1.5}));
  CHECK_FALSE(evaluate_permuted(matrix, Learner::pvalue, {}, {.splits = 0}));
}

TEST_CASE("Chance follows the answers where labels are unequally frequent") {
  // the columns are useless; 3 of 4 trials have one label
  FeatureMatrix matrix = gaussian_classes(2, 20, 4, 0.0, 6);
  for (std::size_t r = 20; r < 30; ++r) matrix.labels[r] = "classa";
  const auto permuted = evaluate_permuted(matrix, Learner::pvalue, {}, {.permutations = 4});
  REQUIRE(permuted);
  CHECK(permuted->chance > 0.5);
  CHECK(permuted->chance <= 0.75);
}

TEST_CASE("Evaluation sums the confusion, averages the splits and times with the caller's clock") {
  const FeatureMatrix matrix = gaussian_classes(3, 10, 8, 2.0, 3);
  const auto splits = stratified_splits(matrix.labels, 0.4, 3, 1).value();
  double clock = 0.0;
  const auto e = evaluate(matrix, splits, Learner::pvalue, {}, [&] { return clock += 1.0; });
  REQUIRE(e);
  CHECK(e->confusion.total() == 3 * 18);
  CHECK(e->confusion.accuracy() == Approx(e->accuracy));
  CHECK(e->train_s == 1.0);
  CHECK(e->test_s_per_sample == 1.0);
  CHECK(e->answer_s == 1.0);
  CHECK(e->ci95.low <= e->accuracy);
  CHECK(e->ci95.high >= e->accuracy);
}

TEST_CASE("Evaluation refuses a trial on both sides, an unknown row and a label never trained") {
  const FeatureMatrix matrix = gaussian_classes(3, 4, 3, 2.0, 4);
  const auto refused = [&](Split split) {
    return !evaluate(matrix, std::vector{std::move(split)}, Learner::pvalue, {});
  };
  CHECK(refused({{0, 1, 4, 5}, {1}}));
  CHECK(refused({{0, 1, 4, 5}, {99}}));
  CHECK(refused({{0, 1, 4, 5}, {8}}));
  CHECK(refused({{0, 1, 4, 5}, {}}));
  CHECK_FALSE(evaluate(matrix, {}, Learner::pvalue, {}));
}

TEST_CASE("Leaving one group out tests every trial once, without labels that nothing trains") {
  const std::vector<std::string> groups = {"x", "x", "y", "y", "z", "z"};
  const std::vector<std::string> labels = {"a", "b", "a", "b", "a", "c"};
  const auto splits = leave_one_group_out(groups, labels);
  REQUIRE(splits);
  REQUIRE(splits->size() == 3);
  CHECK((*splits)[0].test == std::vector<std::size_t>{0, 1});
  CHECK((*splits)[0].train == std::vector<std::size_t>{2, 3, 4, 5});
  CHECK((*splits)[2].test == std::vector<std::size_t>{4});
  CHECK_FALSE(
      leave_one_group_out(std::vector<std::string>{"x", "x"}, std::vector<std::string>{"a", "b"}));
  CHECK_FALSE(
      leave_one_group_out(std::vector<std::string>{"x", ""}, std::vector<std::string>{"a", "a"}));
  CHECK_FALSE(
      leave_one_group_out(std::vector<std::string>{"x", "y"}, std::vector<std::string>{"a", "b"}));
}

TEST_CASE("A thinned split trains on whole recordings, as many of each label as asked for") {
  std::vector<std::string> labels, files;
  for (std::size_t r = 0; r < 24; ++r) {  // two labels, four recordings of three windows each
    labels.emplace_back(r < 12 ? "a" : "b");
    files.push_back(std::to_string(r / 3) + "#w" + std::to_string(r % 3));
  }
  Split split;
  for (std::size_t r = 0; r < 24; ++r) (r % 12 < 9 ? split.train : split.test).push_back(r);
  const auto thin = thinned(std::vector{split}, labels, files, 2, 4, 1);
  REQUIRE(thin);
  REQUIRE(thin->size() == 4);
  std::set<std::vector<std::size_t>> distinct;
  for (const Split& s : *thin) {
    CHECK(s.test == split.test);
    REQUIRE(s.train.size() == 12);
    for (std::size_t i = 0; i < 12; i += 3) CHECK(s.train[i] % 3 == 0);
    CHECK(s.train[5] < 12);
    CHECK(s.train[6] >= 12);
    distinct.insert(s.train);
  }
  CHECK(distinct.size() > 1);
  CHECK_FALSE(thinned(std::vector{split}, labels, files, 4, 1, 1));
  CHECK_FALSE(thinned(std::vector{split}, labels, files, 0, 1, 1));
}

}  // namespace
}  // namespace weft::classifier::evaluate_test
