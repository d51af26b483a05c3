// The probability of each label for a recording.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <sstream>

#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vibro/recording_model.hpp"
#include "classifier/vibro/recording_probability.hpp"
#include "tests/unit/classifier/features_support.hpp"

namespace weft::classifier::vibro::vibro_probability_test {
namespace {

using classifier::testing::noise;

// Noise with a level that differs little between the labels, and between recordings of one.
std::vector<Recording> levels(std::size_t labels, std::size_t each, std::uint64_t seed) {
  std::vector<Recording> out;
  for (std::size_t l = 0; l < labels; ++l) {
    for (std::size_t r = 0; r < each; ++r) {
      Recording own;
      own.label = std::string(1, static_cast<char>('a' + l));
      own.group = std::to_string(r + 1);
      own.file = own.label + own.group;
      own.channels = {{"X", 200.0, "count"}};
      own.samples = {noise(1000, seed + 100 * l + r)};
      const double off = noise(1, 7 * seed + 100 * l + r).front();
      for (double& v : own.samples.front()) v *= 1.0 + 0.3 * static_cast<double>(l) + 0.1 * off;
      out.push_back(std::move(own));
    }
  }
  return out;
}

RecordingSetup setup() {
  RecordingSetup out;
  out.features = {Family::smmrpfft, Combine::concat};
  out.window_s = 1.0;
  out.step_s = 0.5;
  return out;
}

TrainOptions options() {
  TrainOptions out;
  out.trees = 20;
  out.threads = 1;
  return out;
}

RecordingModel trained(Learner learner, const std::vector<Recording>& recordings) {
  auto out = train_recording_model(recordings, setup(), window_recipe(learner), options(), {});
  REQUIRE(out);
  return std::move(*out);
}

std::string saved(const RecordingModel& model) {
  std::ostringstream out;
  REQUIRE(save_model(model, out));
  return out.str();
}

TEST_CASE("probabilities of a recording sum to one and are the same after the file") {
  const auto requested = levels(3, 4, 900);
  for (const Learner learner : {Learner::lda, Learner::forest, Learner::knn, Learner::all}) {
    CAPTURE(to_string(learner));
    const RecordingModel model = trained(learner, levels(3, 5, 1));
    REQUIRE(model.postprocessing);
    const std::string text = saved(model);
    std::istringstream in(text);
    const auto again = load_model<RecordingSetup>(in);
    REQUIRE(again);
    CHECK(saved(*again) == text);
    const auto a = classify_recordings(model, requested),
               b = classify_recordings(*again, requested);
    REQUIRE((a && b));
    for (std::size_t i = 0; i < a->size(); ++i) {
      const std::vector<double>& p = (*a)[i].probability;
      REQUIRE(p.size() == 3);
      CHECK(std::accumulate(p.begin(), p.end(), 0.0) == Approx(1.0));
      CHECK(std::ranges::min(p) >= 0.0);
      CHECK(p == (*b)[i].probability);
      CHECK(place_of_largest(p) == (*a)[i].label);
    }
  }
}

TEST_CASE("the answer is the most frequent label whether a probability is known or not") {
  const auto requested = levels(3, 4, 900);
  RecordingModel model = trained(Learner::lda, levels(3, 5, 1));
  const auto with = classify_recordings(model, requested);
  model.postprocessing.reset();
  const auto without = classify_recordings(model, requested);
  REQUIRE((with && without));
  for (std::size_t i = 0; i < with->size(); ++i) {
    CHECK((*with)[i].label == (*without)[i].label);
    CHECK((*with)[i].windows == (*without)[i].windows);
    CHECK((*without)[i].probability.empty());
  }
}

TEST_CASE("few recordings, all of them right, claim little") {
  const auto stated = [](std::size_t recordings) {
    std::vector<std::vector<double>> shares;
    std::vector<std::size_t> truth;
    for (std::size_t i = 0; i < recordings; ++i) {
      shares.push_back(share_of_windows(std::vector<std::size_t>{10, 1}));
      truth.push_back(0);
    }
    std::vector<double> p = shares.front();
    CHECK(fit_sharpness(shares, truth) > 7.9);
    sharpen(p, cautious_sharpness(shares, truth));
    return p[0];
  };
  CHECK(stated(4) == Approx(std::exp(-1.92 / 4)).epsilon(1e-3));
  CHECK(stated(40) == Approx(std::exp(-1.92 / 40)).epsilon(1e-3));
  // If some are wrong, a large number of them leaves no uncertainty, and the two powers meet.
  std::vector<std::vector<double>> shares(3000, share_of_windows(std::vector<std::size_t>{7, 4}));
  std::vector<std::size_t> truth(3000, 0);
  std::fill_n(truth.begin(), 600, std::size_t{1});
  CHECK(cautious_sharpness(shares, truth) < fit_sharpness(shares, truth));
  CHECK(cautious_sharpness(shares, truth) == Approx(fit_sharpness(shares, truth)).epsilon(0.1));
}

TEST_CASE("shares of windows are positive, and sharpness keeps their order") {
  const std::vector<std::size_t> windows{5, 0, 2, 0};
  const std::vector<double> plain = share_of_windows(windows), sharp = share_of_windows(windows, 3);
  CHECK(plain[0] == Approx(5.25 / 8));
  CHECK(plain[1] == Approx(0.25 / 8));
  CHECK(sharp[0] / sharp[2] == Approx(std::pow(5.25 / 2.25, 3)));
  for (const auto& p : {plain, sharp}) {
    CHECK(std::accumulate(p.begin(), p.end(), 0.0) == Approx(1.0));
    CHECK((p[0] > p[2] && p[2] > p[1] && p[1] == p[3] && p[1] > 0.0));
  }
}

TEST_CASE("labels of one recording alone get no probability, and the reason is given") {
  const auto reason = [](const std::vector<Recording>& recordings, Learner learner) {
    return reason_without_probability(recordings, setup(), window_recipe(learner), options());
  };
  // only one label has two recordings: the accuracy cannot be estimated from it alone
  std::vector<Recording> one_label = levels(3, 1, 1);
  one_label.push_back(levels(1, 2, 5).back());
  for (const Learner learner : {Learner::lda, Learner::all}) {
    for (const auto& few : {levels(3, 1, 1), one_label}) {
      CHECK_FALSE(reason(few, learner).empty());
      const RecordingModel model = trained(learner, few);
      CHECK_FALSE(model.postprocessing);
      const auto answers = classify_recordings(model, few);
      REQUIRE(answers);
      for (const RecordingAnswer& answer : *answers) CHECK(answer.probability.empty());
    }
    CHECK(reason(levels(2, 2, 1), learner).empty());
    CHECK(trained(learner, levels(2, 2, 1)).postprocessing);
  }
}

TEST_CASE("sharpness is of held-out recordings: labels without signal are called near chance") {
  std::vector<Recording> blind = levels(1, 24, 3);
  for (std::size_t i = 0; i < blind.size(); ++i) blind[i].label = i % 2 == 0 ? "a" : "b";
  // deep trees fit every training window; they have no information about another recording
  const RecordingModel model = trained(Learner::forest, blind);
  const auto answers = classify_recordings(model, levels(1, 24, 77));
  REQUIRE((model.postprocessing && answers));
  double mean = 0.0;
  for (const RecordingAnswer& answer : *answers) mean += std::ranges::max(answer.probability) / 24;
  CHECK(mean < 0.75);
}

TEST_CASE("a choice on recordings is kept within its budget") {
  TrainOptions tight = options();
  tight.budget = 1e-9;
  const auto recordings = levels(3, 4, 1);
  const auto chosen = choose_recipe(recordings, setup(), false, 0, tight);
  REQUIRE(chosen);
  CHECK(chosen->recipe.learner == Learner::lda);
  CHECK(chosen->features.family == Family::smmrpfft);
  CHECK(std::ranges::all_of(chosen->scores, &RecipeScore::skipped));
  const auto free = choose_recipe(recordings, setup(), false, 0, options());
  REQUIRE(free);
  CHECK(std::ranges::none_of(free->scores, &RecipeScore::skipped));
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_probability_test
