// Comparison of cells: separability without leaks, intervals of correlated answers, the rule that
// chooses a cell and its certainty.

#include <catch2/catch.hpp>
#include <cmath>

#include "classifier/design/cells.hpp"
#include "classifier/design/resample.hpp"
#include "tests/unit/classifier/design_data.hpp"

namespace design_cells_test {

using namespace weft;
using namespace weft::classifier;
using namespace weft::classifier::design;
using test::clouds;
using test::share_of;

namespace {

/// Trial k of each fabric belongs to replicate k; the first replicates have the wrong answers.
WeighedCell cell(std::size_t fabrics, std::size_t trials, std::size_t wrong, double seconds,
                 double snr_db) {
  WeighedCell out{std::vector<std::vector<CellTrial>>(fabrics)};
  for (std::size_t f = 0; f < fabrics; ++f)
    for (std::size_t k = 0; k < trials; ++k)
      out.fabrics[f].push_back({k, k * fabrics + f >= wrong, seconds, snr_db});
  return out;
}

}  // namespace

TEST_CASE("The quickest cell within a standard error of the best is chosen") {
  // one wrong answer in each replicate: they are not correlated. 60 answers: 0.95 +- 0.03
  const auto spread = [](std::size_t wrong, double seconds, double snr_db) {
    WeighedCell out = cell(6, 10, 0, seconds, snr_db);
    for (std::size_t i = 0; i < wrong; ++i) out.fabrics[i % 6][i % 10].right = false;
    return out;
  };
  WeighedCell half = cell(6, 10, 0, 5, 20);
  for (auto& fabric : half.fabrics)
    for (CellTrial& trial : fabric) trial.right = trial.replicate % 2 == 0;
  for (std::size_t f = 0; f < 3; ++f)
    for (CellTrial& trial : half.fabrics[f]) trial.right = !trial.right;
  const std::vector<WeighedCell> cells{spread(3, 40, 10), spread(4, 10, 12), spread(4, 10, 15),
                                       half};
  const CellChoice choice = choose_cell(cells, 500, 1);
  CHECK(choice.design_effect == 1);
  CHECK(choice.most_separable == 0);
  CHECK(choice.chosen == 2);  // as quick as cell 1, with the larger signal
  CHECK(choice.quickest == 1);
  CHECK(choice.equal_time == 2);
  CHECK(choice.cells[3].figures.accuracy == 0.5);
  CHECK(choice.cells[3].chosen_share == 0);
  CHECK(choice.within == Approx(std::sqrt(57.5 / 61 * 3.5 / 61 / 60)));
  double sum = 0;
  for (const CellSummary& one : choice.cells) sum += one.chosen_share;
  CHECK(sum == Approx(1));
  CHECK(choice.overlapping == 2);
  CHECK(choice.quicker_overlapping == 0);  // cell 1 takes as long, cell 0 longer
}

TEST_CASE("Seconds that hardly differ are equal, and the signal over noise decides") {
  const std::vector<CellStatistics> near{
      {0.9, 10.00, 0, 1}, {0.9, 10.49, 0, 12}, {0.9, 10.51, 0, 30}};
  CHECK(take(near, 60) == 1);  // 5 % of 10 s
  CHECK_FALSE(is_cheaper(near[0], near[1]));
  CHECK(is_cheaper(near[0], near[2]));
  // medians with this uncertainty are equal too
  std::vector<CellStatistics> loose = near;
  for (CellStatistics& one : loose) one.seconds_error = 0.2;  // of a difference: 1.96 x 0.28
  CHECK(take(loose, 60) == 2);
  // separability comes first: 0.9 against 0.5 of 60 answers is a clear difference
  const std::vector<CellStatistics> worse{{0.9, 10, 0, 1}, {0.5, 10, 0, 30}};
  CHECK(take(worse, 60) == 0);
  // a chain of small differences must not lead to a slow cell
  std::vector<CellStatistics> chain;
  for (int i = 0; i < 10; ++i) chain.push_back({0.9, 10 + 0.3 * i, 0, double(i)});
  CHECK(take(chain, 60) == 1);
}

TEST_CASE("A repeated pilot with equal times chooses the cell with the larger signal as well") {
  const std::vector<WeighedCell> cells{cell(6, 10, 0, 10.0, 1), cell(6, 10, 0, 10.2, 12)};
  const CellChoice choice = choose_cell(cells, 300, 1);
  CHECK(choice.chosen == 1);
  CHECK(choice.share == Approx(1));
  CHECK(choice.quicker_overlapping == 0);
  CHECK(choice.supported);
}

TEST_CASE("The front has what no cell beats in accuracy and time") {
  const std::vector<CellStatistics> cells{
      {0.9, 20, 0, 0}, {0.8, 10, 0, 0}, {0.9, 20.5, 0, 0}, {0.8, 12, 0, 0}, {0.85, 19.5, 0, 0}};
  CHECK(find_front(cells) == std::vector<std::size_t>{1, 0, 2});  // 3 is slow, 4 is not quicker
                                                                  // than 0
  const std::vector<CellStatistics> plain{{0.5, 1, 0, 0}, {0.7, 2, 0, 0}, {0.6, 3, 0, 0}};
  CHECK(find_front(plain) == std::vector<std::size_t>{0, 1});
}

TEST_CASE("Answers that hang together in a replicate count for fewer") {
  const double some = 4.0 / 6;
  const ClusteredShare together{{{1, 6}, {1, 6}, {0, 6}}};
  const ClusteredShare apart{{{some, 6}, {some, 6}, {some, 6}}};
  const std::vector<ClusteredShare> all{together}, none{apart}, both{together, apart};
  CHECK(design_effect(all) == 6);   // all or none: 3 independent answers, not 18
  CHECK(design_effect(none) == 1);  // less than by chance
  // between: 6 x 1/3 + 0; if independent: 2/9 x 18/17 of each
  CHECK(design_effect(both) == Approx(2 / (2 * 2.0 / 9 * 18 / 17)));
  const Interval wide = clustered_interval(together, 6), plain = wilson_interval(12, 18);
  CHECK(wide.low == Approx(wilson_interval(2, 3).low));
  CHECK(wide.high == Approx(wilson_interval(2, 3).high));
  CHECK(clustered_interval(apart, 1).low == Approx(plain.low));
  const std::vector<ClusteredShare> sure{{{{1, 6}, {1, 6}, {1, 6}}}};
  CHECK(design_effect(sure) == 1);
  CHECK(clustered_interval(sure[0], 1).low == Approx(wilson_interval(18, 18).low));
  CHECK(clustered_interval(sure[0], 1).high == 1);
}

TEST_CASE("A share and its interval are of all answers where replicates are of several sizes") {
  const ClusteredShare uneven{{{1, 9}, {1, 6}, {0, 3}}};
  CHECK(uneven.share() == Approx(15.0 / 18));
  const std::vector<ClusteredShare> all{uneven};
  // (9 x 1/6)^2 + (6 x 1/6)^2 + (3 x 5/6)^2 = 9.5, by 3/2 and 18; if independent 15/18 x 3/18 x
  // 18/17
  const double effect = 9.5 * 1.5 / 18 / (15.0 / 18 * 3 / 18 * 18 / 17);
  CHECK(design_effect(all) == Approx(effect));
  CHECK(clustered_interval(uneven, effect).low ==
        Approx(wilson_of_share(15.0 / 18, 18 / effect).low));
  CHECK(clustered_interval(uneven, effect).low < 15.0 / 18);
}

TEST_CASE("A choice knows of replicates that are right or wrong as a whole") {
  // the same accuracies, once spread over the replicates, once a replicate at a time
  const auto cells = [](bool together) {
    std::vector<WeighedCell> out;
    for (std::size_t i = 0; i < 4; ++i) {
      WeighedCell& one = out.emplace_back(cell(6, 6, together ? 6 : 0, 10 + double(i), 0));
      for (std::size_t f = 0; f < 6 && !together; ++f) one.fabrics[f][f].right = false;
    }
    return out;
  };
  const CellChoice apart = choose_cell(cells(false), 200, 1);
  const CellChoice together = choose_cell(cells(true), 200, 1);
  CHECK(apart.cells[0].figures.accuracy == together.cells[0].figures.accuracy);
  CHECK(apart.design_effect == 1);
  CHECK(together.design_effect == Approx(6).epsilon(0.01));
  const auto width = [](const CellChoice& c) { return c.cells[0].ci95.high - c.cells[0].ci95.low; };
  CHECK(width(together) > 1.8 * width(apart));
  CHECK(together.within > 1.8 * apart.within);
  CHECK(together.cells[0].ci95.low == Approx(wilson_interval(5, 6).low).margin(0.01));
}

TEST_CASE("A choice that chance made is not called supported") {
  std::vector<WeighedCell> alike, clear;
  for (std::size_t i = 0; i < 12; ++i) {
    const double seconds = 10 + static_cast<double>(i);
    alike.push_back(cell(6, 3, 6 + i % 2, seconds, 0));
    clear.push_back(cell(6, 30, i == 4 ? 0 : 90, seconds, 0));
  }
  const CellChoice chance = choose_cell(alike, 500, 1);
  CHECK_FALSE(chance.supported);
  CHECK(chance.overlapping == 11);
  const CellChoice sure = choose_cell(clear, 500, 1);
  CHECK(sure.chosen == 4);
  CHECK(sure.share == Approx(1));
  CHECK(sure.supported);
  CHECK(sure.overlapping == 0);
}

TEST_CASE("Separability leaves each replicate out: what only a replicate shares is no help") {
  const auto apart = separability(clouds(3, 5, 8, 1), Learner::lda, 1);
  REQUIRE(apart);
  CHECK(apart->size() == 15);
  CHECK(share_of(*apart) == 1);
  CHECK_FALSE(separability(clouds(3, 2, 8, 1), Learner::lda, 1));
  CHECK_FALSE(separability(clouds(1, 5, 8, 1), Learner::lda, 1));
  // every replicate has five copies of each trial, and only the copies reveal a label
  const FeatureMatrix once = clouds(3, 6, 0, 2, 60);
  FeatureMatrix copies = once;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < once.size(); ++i) rows.insert(rows.end(), 5, i);
  copies = select_rows(once, rows);
  const auto blind = separability(copies, Learner::lda, 1);
  REQUIRE(blind);
  CHECK(share_of(*blind) < 0.6);
  // the test detects the leak: left out singly, the copies reveal the answer
  FeatureMatrix leaking = copies;
  for (std::size_t i = 0; i < leaking.size(); ++i) leaking.groups[i] = "r" + std::to_string(i % 5);
  const auto seen = separability(leaking, Learner::lda, 1);
  REQUIRE(seen);
  CHECK(share_of(*seen) > 0.95);
}

TEST_CASE("A fabric in only one replicate cannot be cross-validated") {
  FeatureMatrix lacking = clouds(3, 4, 8, 1);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < lacking.size(); ++i)
    if (lacking.labels[i] != "l2" || lacking.groups[i] == "r100") rows.push_back(i);
  rows.push_back(2);  // twice, so that a learner accepts it
  const auto refused = separability(select_rows(lacking, rows), Learner::lda, 1);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_argument);
  CHECK_THAT(refused.error().expected, Catch::Contains("two replicates"));
}

}  // namespace design_cells_test
