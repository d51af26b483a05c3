#include <catch2/catch.hpp>

#include "classifier/features/trial.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::features_windows_test {
namespace {

using testing::motion_trial;

TEST_CASE("Windows cut the motion into equal parts that inherit label and group") {
  Trial trial = motion_trial(std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7});
  trial.label = "Denim";
  trial.group = "rep0";
  trial.phase[0] = Phase::press;
  const auto windows = cut_windows(trial, {.window_s = 0.084, .sample_period_s = 0.028});
  REQUIRE(windows);
  REQUIRE(windows->size() == 2);
  CHECK((*windows)[1].counts == std::vector<double>{4, 5, 6});
  CHECK((*windows)[1].group == "rep0");
  CHECK((*windows)[1].label == "Denim");
  CHECK((*windows)[1].file == "trial.csv#w1");
  const auto dense =
      cut_windows(trial, {.window_s = 0.084, .step_s = 0.028, .sample_period_s = 0.028});
  CHECK(dense->size() == 5);
}

TEST_CASE("no window lies across another phase or a pause, and each run has windows of its own") {
  Trial trial = motion_trial(std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  const WindowOptions three{.window_s = 0.3, .sample_period_s = 0.1};
  const auto firsts = [&](std::span<const std::size_t> after_pause) {
    std::vector<double> out;
    const auto windows = cut_windows(trial, three, after_pause);
    REQUIRE(windows);
    for (const Trial& window : *windows) {
      REQUIRE(window.counts.size() == 3);
      CHECK(window.counts[2] == window.counts[0] + 2);
      out.push_back(window.counts[0]);
    }
    return out;
  };
  CHECK(firsts({}) == std::vector<double>{0, 3, 6, 9});
  const std::vector<std::size_t> after_pause{5, 7};
  CHECK(firsts(after_pause) == std::vector<double>{0, 7});
  trial.phase[4] = Phase::none;
  CHECK(firsts({}) == std::vector<double>{0, 5, 8});
  for (const std::size_t i : {2U, 7U, 10U}) trial.phase[i] = Phase::press;
  const auto refused = cut_windows(trial, three);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::range);
}

TEST_CASE(
    "a recording's name is that of its windows without their number, and nothing else of it") {
  for (const auto& [file, recording] : {std::pair{"a.csv", "a.csv"},
                                        {"a.csv#w0", "a.csv"},
                                        {"a.csv#w12", "a.csv"},
                                        {"fab #3.csv", "fab #3.csv"},
                                        {"fab #3.csv#w4", "fab #3.csv"},
                                        {"press#3", "press#3"},
                                        {"a#", "a#"},
                                        {"a#w", "a#w"},
                                        {"", ""}})
    CHECK(recording_of(file) == recording);
  CHECK(recording_of(std::string("a.csv#w0"), 7) == "a.csv");
  CHECK(recording_of(std::string(), 7) == "#7");
}

TEST_CASE("Windows of no duration, or longer than the motion, are refused") {
  const Trial trial = motion_trial(std::vector<double>{0, 1, 2});
  CHECK_FALSE(cut_windows(trial, {.window_s = 1.0, .sample_period_s = 0.0}));
  CHECK_FALSE(cut_windows(trial, {.window_s = -1.0, .sample_period_s = 0.1}));
  CHECK_FALSE(cut_windows(trial, {.window_s = std::nan(""), .sample_period_s = 0.1}));
  CHECK_FALSE(cut_windows(trial, {.window_s = 0.4, .sample_period_s = 0.1}));
}

TEST_CASE("the level of a taxel is that of the phase asked for, whole where counts are") {
  Trial trial;
  trial.taxels = 2;
  trial.phase = {Phase::rest, Phase::motion, Phase::motion};
  trial.counts = {10, 5, 20, 8, 21, 10};
  Trial rest = trial;
  REQUIRE(without_level(rest, Phase::rest));
  CHECK(rest.counts == std::vector<double>{0, 0, 10, 3, 11, 5});
  REQUIRE(without_level(trial, Phase::motion));
  CHECK(trial.counts == std::vector<double>{-10, -4, 0, -1, 1, 1});
  CHECK_FALSE(without_level(trial, Phase::press));
  Trial fractions;
  fractions.taxels = 1;
  fractions.phase = {Phase::motion, Phase::motion};
  fractions.counts = {0.25, 0.5};
  REQUIRE(without_level(fractions, Phase::motion));
  CHECK(fractions.counts == std::vector<double>{-0.125, 0.125});
}

}  // namespace
}  // namespace weft::classifier::features_windows_test
