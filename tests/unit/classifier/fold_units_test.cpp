// Folds if a label has too few groups, recordings or trials: only that label is split further or
// left out of the test, and the report names it.

#include "classifier/fabric/folds.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>

#include "classifier/learners/class_folds.hpp"
#include "classifier/learners/multi_class_svc.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::fold_units_test {
namespace {

using testing::gaussian_classes;
using testing::normal;

constexpr std::size_t windows = 3;  // in every recording

// Labels with the groups of their recordings.
using Recorded = std::map<std::string, std::vector<std::string>>;

FeatureMatrix windows_of(const Recorded& recorded) {
  FeatureMatrix out;
  out.names = {"x", "y"};
  RandomEngine engine(5);
  std::vector<double> values;
  double mean = 0.0;
  for (const auto& [label, groups] : recorded) {
    for (std::size_t i = 0; i < groups.size() * windows; ++i) {
      out.labels.push_back(label);
      out.groups.push_back(groups[i / windows]);
      out.files.push_back(label + std::to_string(i / windows) + ".csv#w" +
                          std::to_string(i % windows));
      for (int k = 0; k < 2; ++k) values.push_back(mean + normal(engine));
    }
    mean += 2.0;
  }
  out.values = Matrix(out.labels.size(), 2);
  for (std::size_t r = 0; r < out.size(); ++r)
    for (std::size_t k = 0; k < 2; ++k) out.values(r, k) = values[2 * r + k];
  return out;
}

const std::vector<std::string> four_groups = {"g0", "g0", "g1", "g1", "g2", "g2", "g3", "g3"};

TrainOptions by_groups(std::uint64_t seed = 1) {
  TrainOptions out;
  out.fold_unit = FoldUnit::group;
  out.seed = seed;
  return out;
}

// Checks that no unit with rows of these labels is on both sides of a fold.
void check_whole(const FeatureMatrix& data, const std::vector<Fold>& folds,
                 const std::set<std::string>& labels, const std::vector<std::string>& unit) {
  for (const Fold& fold : folds) {
    std::set<std::string> inside, outside;
    for (const std::size_t r : fold.validate)
      if (labels.contains(data.labels[r])) inside.insert(unit[r]);
    for (const std::size_t r : fold.train)
      if (labels.contains(data.labels[r])) outside.insert(unit[r]);
    for (const std::string& one : inside) CHECK_FALSE(outside.contains(one));
  }
}

std::vector<std::string> recordings(const FeatureMatrix& data) {
  std::vector<std::string> out;
  for (const std::string& file : data.files) out.push_back(file.substr(0, file.find('#')));
  return out;
}

void check_trainable(const FeatureMatrix& data, const std::vector<Fold>& folds) {
  const std::set<std::string> labels(data.labels.begin(), data.labels.end());
  for (const Fold& fold : folds) {
    std::map<std::string, std::size_t> rows;
    for (const std::size_t r : fold.train) ++rows[data.labels[r]];
    for (const std::string& label : labels) CHECK(rows[label] >= 2);
    CHECK(fold.train.size() + fold.validate.size() == data.size());
  }
}

std::map<std::string, std::size_t> held_out(const FeatureMatrix& data,
                                            const std::vector<Fold>& folds) {
  std::map<std::string, std::size_t> out;
  for (const Fold& fold : folds)
    for (const std::size_t r : fold.validate) ++out[data.labels[r]];
  return out;
}

TEST_CASE("A label of a single group is dealt by recordings, the others stay in their groups") {
  const FeatureMatrix data =
      windows_of({{"a", four_groups}, {"b", four_groups}, {"c", {"g0", "g0"}}});
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto folds = class_folds(data, by_groups(seed)).folds;
    REQUIRE(folds.size() >= 2);
    check_whole(data, folds, {"a", "b"}, data.groups);
    check_whole(data, folds, {"c"}, recordings(data));
    check_trainable(data, folds);
    CHECK(held_out(data, folds) ==
          std::map<std::string, std::size_t>{{"a", 24}, {"b", 24}, {"c", 6}});
  }
  const FoldReport report = fold_report(data, Learner::best, by_groups());
  CHECK(report.finer == std::map<std::string, std::string>{{"c", "recording"}});
  CHECK(format_folds(report) == "c dealt by recording");
  CHECK(format_folds(fold_report(data, Learner::pvalue, by_groups())) == "c dealt by recording");
}

TEST_CASE("A label of a single recording is dealt by windows, the others by recordings") {
  const FeatureMatrix data = windows_of({{"a", four_groups}, {"b", four_groups}, {"c", {"g0"}}});
  for (const auto& options : {TrainOptions{}, by_groups()}) {
    const auto folds = class_folds(data, options).folds;
    REQUIRE(folds.size() >= 2);
    check_whole(data, folds, {"a", "b"},
                options.fold_unit == FoldUnit::group ? data.groups : recordings(data));
    check_trainable(data, folds);
  }
  CHECK(format_folds(fold_report(data, Learner::svc, {})) == "c dealt by window");
}

TEST_CASE("Labels of some of the groups are dealt by groups whatever the seed") {
  const std::vector<Recorded> cases = {
      {{"a", four_groups}, {"b", four_groups}, {"c", {"g0", "g1"}}},
      {{"a", four_groups}, {"b", four_groups}, {"c", {"g1", "g3"}}, {"d", {"g0", "g3"}}},
      // no division into two folds separates all three
      {{"c", {"g0", "g1"}}, {"d", {"g1", "g2"}}, {"e", {"g0", "g2"}}}};
  for (const Recorded& recorded : cases) {
    const FeatureMatrix data = windows_of(recorded);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const auto folds = class_folds(data, by_groups(seed)).folds;
      REQUIRE(folds.size() >= 2);
      check_whole(data, folds, {"a", "b", "c", "d", "e"}, data.groups);
      check_trainable(data, folds);
    }
    CHECK(fold_report(data, Learner::best, by_groups()).as_requested());
  }
}

TEST_CASE("Folds of a core keep the groups of one label where the other has a single one") {
  const FeatureMatrix data = windows_of({{"a", four_groups}, {"c", {"g0", "g0", "g0"}}});
  const TrainOptions options = by_groups();
  PairMaker pairs(data, options);
  const RowsOfLabel rows = rows_by_label(data);
  const PairProblem problem = pairs.make(rows.at("a"), rows.at("c"));
  REQUIRE(problem.folds.size() == 3);
  check_whole(data, problem.folds, {"a"}, data.groups);  // rows of a come first in both
  check_whole(data, problem.folds, {"c"}, recordings(data));
}

// Three labels of twelve trials, and one with `rare` trials, far from them.
FeatureMatrix with_rare_label(std::size_t rare, std::uint64_t seed) {
  FeatureMatrix data = gaussian_classes(4, 12, 6, 1.5, seed);
  std::vector<std::size_t> rows;
  for (std::size_t r = 0; r < 36 + rare; ++r) rows.push_back(r);
  return select_rows(data, rows);
}

TEST_CASE("A label of two trials is never held out, and the others are tested all the same") {
  const FeatureMatrix data = with_rare_label(2, 3);
  const auto folds = class_folds(data, {}).folds;
  REQUIRE(folds.size() == 5);
  check_trainable(data, folds);
  CHECK(held_out(data, folds) ==
        std::map<std::string, std::size_t>{{"classa", 12}, {"classb", 12}, {"classc", 12}});
  CHECK(format_folds(fold_report(data, Learner::svc, {})) == "not tested: classd (2 trials)");
  CHECK(fold_report(data, Learner::all, {}).as_requested());  // the folds of a pair hold both of
                                                              // them out
  CHECK(fold_report(with_rare_label(3, 3), Learner::best, {}).as_requested());
}

TEST_CASE("Three trials cannot be held out in two folds, and do not stop the others") {
  const FeatureMatrix data = with_rare_label(3, 4);
  TrainOptions options;
  options.folds = 2;
  const auto folds = class_folds(data, options).folds;
  REQUIRE(folds.size() == 2);
  check_trainable(data, folds);
  CHECK_FALSE(held_out(data, folds).contains("classd"));
}

TEST_CASE("With a label of two trials an SVC is tuned, calibrated and refuses strangers") {
  const FeatureMatrix data = with_rare_label(2, 7);
  TrainOptions corner;
  corner.grid.c = {corner.grid.c.front()};
  corner.grid.gamma = {corner.grid.gamma.front()};
  const auto fit = [&](const TrainOptions& options) {
    const Classes classes = find_classes(data);
    return MultiClassSvc::fit(data.values, classes.of_row, 4, class_folds(data, options).folds,
                              options)
        .value();
  };
  CHECK(fit({}).cv_errors() < fit(corner).cv_errors());
  for (const Learner kind : {Learner::svc, Learner::lda, Learner::trees}) {
    CAPTURE(to_string(kind));
    const auto learner = train_recipe(data, {kind}, {});
    REQUIRE(learner);
    const auto postprocessing = fit_postprocessing(*learner, data, {});
    REQUIRE((postprocessing && *postprocessing));
    for (const double threshold : (*postprocessing)->reject.threshold)
      CHECK(std::isfinite(threshold));
    CHECK(predict(*learner, *postprocessing, std::vector<double>(6, 60.0))->none_of_these);
  }
  const auto chosen = train_learner(data, Learner::best, {});
  REQUIRE(chosen);
  CHECK(chosen->scores.front().tested == 5 * 36);
}

TEST_CASE(
    "Where nothing can be held out nothing is claimed, and an SVC is neither stiff nor flat") {
  const FeatureMatrix pairs = gaussian_classes(3, 2, 6, 3.0, 11);
  const FeatureMatrix lone = select_rows(gaussian_classes(2, 12, 6, 3.0, 12),
                                         std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 12, 13});
  for (const FeatureMatrix& data : {pairs, lone}) {
    CHECK(class_folds(data, {}).folds.empty());
    CHECK(fold_report(data, Learner::best, {}).none);
    for (const Learner kind : {Learner::svc, Learner::lda, Learner::trees}) {
      const auto learner = train_recipe(data, {kind}, {});
      REQUIRE(learner);
      const auto postprocessing = fit_postprocessing(*learner, data, {});
      REQUIRE(postprocessing);
      CHECK_FALSE(*postprocessing);
      const auto reply = predict(*learner, *postprocessing, data.values.row(0));
      REQUIRE(reply);
      CHECK(reply->probability.empty());
      CHECK_FALSE(reply->none_of_these);
    }
    const auto svc = train_recipe(data, {Learner::svc}, {});
    const auto* machine = svc->as<MultiClassSvc>();
    REQUIRE(machine != nullptr);
    CHECK(machine->c() == 8.0);
    CHECK(machine->gamma() == 0.125);  // the grid value nearest to 1 / 6
  }
  CHECK(format_folds(fold_report(lone, Learner::svc, {})) ==
        "none: label classb has 2 trials, too few for 5 folds that train on 2 of each");
}

}  // namespace
}  // namespace weft::classifier::fold_units_test
