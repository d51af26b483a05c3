// Protocols and their results.

#include <catch2/catch.hpp>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "classifier/vibro/cross_validation.hpp"
#include "tests/unit/classifier/noise_levels.hpp"

namespace weft::classifier::vibro::vibro_assess_test {
namespace {

using namespace noise_levels;

TEST_CASE("Every protocol splits its stated units, and only random windows leak") {
  const auto recordings = levels(3, 2);
  const Cut random = cut(recordings, with(Protocol::random));
  REQUIRE(random.splits.size() == 1);
  CHECK(random.splits[0].test.size() == 3 * 2 * 20);
  CHECK(random.splits[0].train.size() == 3 * 2 * 80);
  CHECK(measure_leak(random.windows, random.splits).median > 0.9);

  // A few windows of a long recording: most touch no training window, but some do.
  ProtocolOptions few = with(Protocol::random);
  few.per_recording = 4;
  few.window_s = 1.0;
  few.test_share = 0.25;
  const Cut sparse = cut(levels(3, 20), few);
  const Leak seen = measure_leak(sparse.windows, sparse.splits);
  CHECK(seen.windows > 0.0);
  CHECK(seen.windows < 1.0);
  CHECK(seen.largest > seen.median);
  CHECK(seen.largest <= 1.0);

  const Cut blocks = cut(recordings, with(Protocol::blocks));
  REQUIRE(blocks.splits.size() == 5);
  CHECK(blocks.splits[0].test.size() == 3 * 2 * 5);
  CHECK(measure_leak(blocks.windows, blocks.splits).largest == 0.0);
  // Windows that touch across a border at a place that is no binary fraction.
  ProtocolOptions touching = with(Protocol::blocks);
  touching.step_s = 0.2;
  const Cut close = cut(levels(3, 1, 24.0), touching);
  CHECK(measure_leak(close.windows, close.splits).largest == 0.0);

  ProtocolOptions options = with(Protocol::groups);
  options.test_groups = {"2"};
  const Cut groups = cut(recordings, options);
  REQUIRE(groups.splits.size() == 1);
  for (const std::size_t r : groups.splits[0].test) CHECK(groups.windows.matrix.groups[r] == "2");
  CHECK(measure_leak(groups.windows, groups.splits).largest == 0.0);

  const Cut each = cut(recordings, with(Protocol::groups));
  REQUIRE(each.splits.size() == 2);
  for (const Split& split : each.splits) {
    std::set<std::string> tested;
    for (const std::size_t r : split.test) tested.insert(each.windows.matrix.groups[r]);
    CHECK(tested.size() == 1);
    CHECK(split.train.size() + split.test.size() == each.windows.places.size());
  }
  CHECK(measure_leak(each.windows, each.splits).largest == 0.0);

  for (const Cut* c : {&random, &blocks, &groups, &each})
    for (const Split& split : c->splits) {
      std::vector<std::size_t> both;
      std::set_intersection(split.train.begin(), split.train.end(), split.test.begin(),
                            split.test.end(), std::back_inserter(both));
      CHECK(both.empty());
    }
}

TEST_CASE("A group tests the labels that it has: one missing recording does not refuse the rest") {
  auto recordings = levels(3, 4);
  std::erase_if(recordings, [](const Recording& r) { return r.file == "c3"; });
  const Cut each = cut(recordings, with(Protocol::groups));
  REQUIRE(each.splits.size() == 4);
  const std::vector lda{window_recipe(Learner::lda)};
  const auto got = cross_validate(each.windows, each.splits, lda, {}).value();
  CHECK(got.voted == 11);
  CHECK(got.accuracy > 0.9);
  CHECK(got.split_f_score[2] == Approx(got.split_accuracy[2]).margin(0.1));

  // A label with only one group cannot be trained without that group.
  std::erase_if(recordings, [](const Recording& r) { return r.file == "c1" || r.file == "c2"; });
  const auto windows = cut_and_extract(recordings, 2.0, places_of(with(Protocol::groups)), {});
  const auto refused = split_windows(*windows, with(Protocol::groups));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().what.find("training") != std::string::npos);
  // A group with only recordings shorter than a window has no test data.
  auto some = levels(2, 2);
  for (Recording& r : some)
    if (r.group == "2") r.samples[0].resize(100);
  ProtocolOptions second = with(Protocol::groups);
  second.test_groups = {"2"};
  const auto rest = cut_and_extract(some, 2.0, places_of(second), {});
  CHECK_FALSE(split_windows(*rest, second));
}

TEST_CASE("Splits that cannot train or test are refused") {
  const auto recordings = levels(2, 2);
  const auto refuses = [&](const ProtocolOptions& options) {
    const auto windows = cut_and_extract(recordings, options.window_s, places_of(options), {});
    return windows && !split_windows(*windows, options);
  };
  ProtocolOptions options = with(Protocol::blocks);
  options.blocks = 1;
  CHECK(refuses(options));
  options.blocks = 10;  // 1.5 s each, windows of 2 s
  CHECK(refuses(options));
  options = with(Protocol::groups);
  options.train_groups = {"1"};
  CHECK(refuses(options));  // no test data
  options.train_groups.clear();
  options.test_groups = {"7"};
  CHECK(refuses(options));
  options.test_groups = {"1", "2"};
  CHECK(refuses(options));  // no training data
  options = with(Protocol::random);
  options.test_share = 0.0;
  CHECK(refuses(options));
  const auto one_group = levels(2, 1);
  const auto windows = cut_and_extract(one_group, 2.0, places_of(with(Protocol::groups)), {});
  CHECK_FALSE(split_windows(*windows, with(Protocol::groups)));
  CHECK_FALSE(protocol_from("loo"));
  for (const Protocol p : {Protocol::random, Protocol::blocks, Protocol::groups})
    CHECK(protocol_from(to_string(p)).value() == p);
}

TEST_CASE("Training windows that cannot be parted give the first candidate, untested") {
  const Cut two = cut(levels(3, 1), with(Protocol::blocks));
  const std::size_t n = two.windows.matrix.size() / 3;  // windows of each label; one of them trains
  const std::vector<Split> halves{{{0, n, 2 * n}, {1, n + 1, 2 * n + 1}}};
  const std::vector tried{window_recipe(Learner::knn), window_recipe(Learner::nb)};
  const auto got = cross_validate(two.windows, halves, tried, {});
  REQUIRE(got);
  REQUIRE(got->chosen.size() == 1);
  CHECK(got->chosen.front() == tried.front());
}

TEST_CASE("The macro F-score is the mean over the labels that were asked about or answered") {
  Confusion c({"a", "b", "c"});
  c.at(0, 0) = 3;
  c.at(0, 1) = 1;
  c.at(1, 1) = 2;
  // a: 2*3/(4+3), b: 2*2/(2+3); c does not count, as if its recording of a group is missing
  CHECK(f_score(c) == Approx((6.0 / 7.0 + 4.0 / 5.0) / 2.0));
  c.at(0, 2) = 1;  // predicted, but never right: 2*3/(5+3), 2*2/(2+3), 0
  CHECK(f_score(c) == Approx((6.0 / 8.0 + 4.0 / 5.0) / 3.0));
  CHECK(f_score(Confusion({"a", "b"})) == 0.0);
}

TEST_CASE("More random splits test the same recordings and add no knowledge of them") {
  auto recordings = levels(3, 2, 12.0);
  for (std::size_t r = 0; r < recordings.size(); ++r)
    recordings[r].label = std::string(1, static_cast<char>('a' + (r + r / 3) % 3));  // some wrong
  ProtocolOptions random = with(Protocol::random);
  random.per_recording = 10;
  const std::vector lda{window_recipe(Learner::lda)};
  const auto width = [&](std::size_t repeats) {
    random.repeats = repeats;
    const Cut c = cut(recordings, random);
    const auto got = cross_validate(c.windows, c.splits, lda, {}).value();
    CHECK(got.voted == 6);
    CHECK(got.voted_answers == 6 * repeats);
    CHECK(got.voted_ci95.low <= got.voted_accuracy);
    CHECK(got.voted_ci95.high >= got.voted_accuracy);
    CHECK(got.voted_ci95.method.find("Nadeau-Bengio") != std::string::npos);
    return got.voted_ci95.high - got.voted_ci95.low;
  };
  CHECK(width(100) > 0.5 * width(10));
}

TEST_CASE(
    "Levels of noise are told apart on blocks and on recordings, not where they mean nothing") {
  auto recordings = levels(3, 3);
  const std::vector lda{window_recipe(Learner::lda)};
  ProtocolOptions groups = with(Protocol::groups);
  groups.test_groups = {"3"};
  for (const ProtocolOptions& protocol : {with(Protocol::blocks), groups}) {
    const Cut c = cut(recordings, protocol);
    const auto got = cross_validate(c.windows, c.splits, lda, {}).value();
    CHECK(got.accuracy > 0.9);
    CHECK(got.f_score == Approx(got.accuracy).margin(0.1));
    CHECK(got.voted_accuracy > 0.9);
    CHECK(got.voted == (protocol.protocol == Protocol::blocks ? 5 * 9 : 3));
    CHECK(got.confusion.total() == (protocol.protocol == Protocol::blocks ? 45 * 5 : 3 * 53));
    CHECK(got.explained == Approx(1.0));
    CHECK(got.train_s == 0.0);
    CHECK(got.voted_ci95.low < got.voted_accuracy);
    CHECK(got.voted_ci95.high >= got.voted_accuracy);
    if (protocol.protocol == Protocol::groups) {  // one split
      CHECK(got.accuracy_ci95.low == 0.0);
      CHECK(got.accuracy_ci95.high == 1.0);
    } else {
      CHECK(got.accuracy_ci95.low > 1.0 / 3.0);
      CHECK(got.accuracy_ci95.low <= got.accuracy);
      CHECK(got.accuracy_ci95.high >= got.accuracy);
    }
  }
  // A level has another label in every group: the trained relation is wrong in the test group.
  for (std::size_t r = 0; r < recordings.size(); ++r)
    recordings[r].label = std::string(1, static_cast<char>('a' + (r + r / 3) % 3));
  const Cut c = cut(recordings, groups);
  CHECK(cross_validate(c.windows, c.splits, lda, {})->accuracy < 0.3);
}

TEST_CASE("The learner is chosen by parts of the training windows alone") {
  const auto recordings = levels(3, 1);
  const Cut c = cut(recordings, with(Protocol::blocks));
  TrainOptions options;
  options.trees = 20;
  const std::vector tried{window_recipe(Learner::knn), window_recipe(Learner::lda)};
  const auto got = cross_validate(c.windows, c.splits, tried, options);
  REQUIRE(got);
  REQUIRE(got->chosen.size() == 5);
  for (const Recipe& one : got->chosen)
    CHECK((one.learner == Learner::knn || one.learner == Learner::lda));
  CHECK(got->accuracy > 0.9);
  CHECK_FALSE(cross_validate(c.windows, c.splits, {}, options));
  CHECK_FALSE(cross_validate(c.windows, {}, tried, options));
  int requested = 0;
  options.stop = [&] { return ++requested > 3; };
  const auto stopped = cross_validate(c.windows, c.splits, tried, options);
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().code == Errc::wrong_state);
}

// Whether units are equal exactly where `part` is equal.
template <class Part>
bool follow(const std::vector<std::size_t>& unit, const Part& part) {
  for (std::size_t i = 0; i < unit.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if ((unit[i] == unit[k]) != (part(i) == part(k))) return false;
  return true;
}

std::vector<std::size_t> units_in(const FeatureMatrix& matrix) {
  return units_by_label(matrix, FoldUnit::recording).of_row;
}

TEST_CASE("Units of folds are recordings, then blocks, then fifths in the order of time") {
  for (const Protocol protocol : {Protocol::random, Protocol::blocks, Protocol::groups}) {
    INFO(to_string(protocol));
    const WindowSet several = cut(levels(2, 3), with(protocol)).windows;
    CHECK(follow(units_in(several.matrix), [&](std::size_t i) { return several.recording[i]; }));
  }
  const WindowSet blocks = cut(levels(2, 1), with(Protocol::blocks)).windows;
  CHECK(follow(units_in(blocks.matrix), [&](std::size_t i) {
    return std::pair(blocks.recording[i], blocks.places[i].block);
  }));

  ProtocolOptions random = with(Protocol::random);
  random.per_recording = 50;
  const WindowSet one = cut(levels(2, 1), random).windows;
  std::map<std::size_t, std::vector<double>> starts_s;
  const auto unit = units_in(one.matrix);
  for (std::size_t i = 0; i < unit.size(); ++i)
    if (one.recording[i] == 0) starts_s[unit[i]].push_back(one.places[i].start_s);
  REQUIRE(starts_s.size() == 5);
  std::vector<std::pair<double, double>> spans;
  for (const auto& [own, starts] : starts_s) {
    CHECK(starts.size() == 10);
    const auto [first, last] = std::minmax_element(starts.begin(), starts.end());
    spans.emplace_back(*first, *last);
  }
  std::sort(spans.begin(), spans.end());
  for (std::size_t k = 1; k < spans.size(); ++k) CHECK(spans[k - 1].second <= spans[k].first);
}

TEST_CASE("Units of folds depend on the rows that train alone") {
  const WindowSet windows = cut(levels(2, 2), with(Protocol::blocks)).windows;
  std::vector<std::size_t> rows;  // both recordings of the first label, one of the second
  for (std::size_t r = 0; r < windows.matrix.size(); ++r)
    if (windows.recording[r] < 3) rows.push_back(r);
  CHECK(follow(units_in(select_rows(windows.matrix, rows)), [&](std::size_t i) {
    const std::size_t recording = windows.recording[rows[i]];
    return std::pair(recording, recording < 2 ? 0 : windows.places[rows[i]].block);
  }));
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_assess_test
