// Models of recordings as files: equal after reading, and refusals.

#include <catch2/catch.hpp>

#include <algorithm>
#include <iterator>
#include <sstream>
#include <string>

#include "classifier/base/line_io.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vibro/recording_model.hpp"
#include "tests/unit/classifier/damaged_model.hpp"
#include "tests/unit/classifier/features_support.hpp"

namespace weft::classifier::vibro::vibro_model_test {
namespace {

using classifier::testing::noise;

// Noise of three levels, two recordings of each, from a microphone and from one axis.
std::vector<Recording> three_levels(std::uint64_t seed) {
  std::vector<Recording> out;
  for (std::size_t l = 0; l < 3; ++l) {
    for (std::size_t r = 0; r < 2; ++r) {
      Recording own;
      own.label = std::string(1, static_cast<char>('a' + l));
      own.group = std::to_string(r + 1);
      own.file = own.label + own.group;
      own.channels = {{"S", 800.0, "1"}, {"X", 200.0, "count"}};
      own.samples = {noise(8000, seed + 10 * l + r), noise(2000, seed + 100 + 10 * l + r)};
      for (auto& channel : own.samples)
        for (double& v : channel) v *= 1.0 + 2.0 * static_cast<double>(l);
      out.push_back(std::move(own));
    }
  }
  return out;
}

Result<RecordingModel> trained(Learner learner, std::size_t components = 3) {
  RecordingSetup setup;
  setup.features = {Family::smmrpfft, Combine::concat};
  setup.window_s = 1.0;
  setup.step_s = 0.5;
  TrainOptions options;
  options.trees = 5;
  return train_recording_model(three_levels(1), setup, window_recipe(learner, components), options,
                               {"simulated", "abc", "1.2", "made up"});
}

std::string saved(const RecordingModel& model) {
  std::ostringstream out;
  REQUIRE(save_model(model, out));
  return out.str();
}

Result<RecordingModel> loaded(const std::string& text) {
  std::istringstream in(text);
  return load_model<RecordingSetup>(in);
}

TEST_CASE("A model of recordings is read as it was written and answers the same") {
  const auto requested = three_levels(500);
  for (const Learner learner : all_learners()) {
    if (!is_available(learner) || is_choice(learner)) continue;
    for (const std::size_t components : {std::size_t{0}, std::size_t{3}}) {
      INFO(to_string(learner) << ", " << components << " components");
      const auto model = trained(learner, components);
      REQUIRE(model);
      const std::string text = saved(*model);
      const auto again = loaded(text);
      REQUIRE(again);
      CHECK(saved(*again) == text);
      CHECK(again->learner.labels() == std::vector<std::string>{"a", "b", "c"});
      CHECK(again->setup.channels == model->setup.channels);
      CHECK(again->provenance.bench == "simulated");
      const auto want = classify_recordings(*model, requested),
                 got = classify_recordings(*again, requested);
      REQUIRE((want && got));
      std::size_t right = 0;
      for (std::size_t r = 0; r < requested.size(); ++r) {
        CHECK((*got)[r].windows == (*want)[r].windows);
        right += again->learner.labels()[(*got)[r].label] == requested[r].label ? 1 : 0;
      }
      // Weights of three components are too few for the level between the two others.
      const bool is_linear =
          (learner == Learner::least_squares || learner == Learner::ridge) && components == 3;
      CHECK(right >= requested.size() - (is_linear ? 1 : 0));
    }
  }
}

// In the format of version 1: the learner after the labels and without a view, axes or none after
// the scaling, no names of features, no postprocessing.
std::string as_version_1(const RecordingModel& model) {
  const std::string text = classifier::testing::older_body(saved(model));
  const std::size_t names = text.find("\nfeatures ") + 1;
  std::string head = classifier::testing::without_lines(text.substr(0, names), {"learner", "view"});
  std::size_t rest = names;
  while (text.compare(rest, 7, "feature") == 0) rest = text.find('\n', rest) + 1;
  std::string body = classifier::testing::without_lines(text.substr(rest), {"aids"});
  if (body.find("\naxes ") == std::string::npos) {
    const std::size_t after = body.find('\n', body.find("deviation ")) + 1;
    body.insert(after, "axes 0\nexplained 1\n");
  }
  head += "method " + std::string(paper_name(model.learner.kind())) + "\n";
  return with_checksum("weft-recording-model 1", head + body);
}

TEST_CASE("A model of recordings of version 1 is read and answers the same") {
  const auto requested = three_levels(500);
  for (const Learner learner : {Learner::nb, Learner::knn, Learner::forest})
    for (const std::size_t components : {std::size_t{0}, std::size_t{3}}) {
      INFO(to_string(learner) << ", " << components << " components");
      auto model = trained(learner, components);
      REQUIRE(model);
      model->postprocessing.reset();  // version 1 had none
      const auto old = loaded(as_version_1(*model));
      REQUIRE(old);
      const auto same = loaded(
          with_checksum("weft-recording-model 2", classifier::testing::older_body(saved(*model))));
      REQUIRE(same);
      CHECK(saved(*old) == saved(*same));
      const auto want = classify_recordings(*model, requested),
                 got = classify_recordings(*old, requested);
      REQUIRE((want && got));
      for (std::size_t r = 0; r < requested.size(); ++r)
        CHECK(((*got)[r].windows == (*want)[r].windows && (*got)[r].probability.empty()));
    }
}

// Replaces a word and corrects the checksum.
std::string with(const std::string& text, const std::string& from, const std::string& to) {
  const std::size_t begin = model_file_header.size() + 1;
  std::string body = text.substr(begin, text.rfind("crc32 ") - begin);
  const std::size_t at = body.find(from);
  REQUIRE(at != std::string::npos);
  body.replace(at, from.size(), to);
  return with_checksum(model_file_header, body);
}

void check_corrupt(const std::string& text, const std::string& part) {
  const auto model = loaded(text);
  REQUIRE(!model);
  CHECK(model.error().code == Errc::corrupt);
  CHECK(model.error().what.find(part) != std::string::npos);
}

// The words of the first line that begins with `keyword`.
std::vector<std::string> words_after(const std::string& text, const std::string& keyword) {
  const std::size_t at = text.find("\n" + keyword + " ") + 1;
  std::istringstream line(text.substr(at, text.find('\n', at) - at));
  return {std::istream_iterator<std::string>(line), {}};
}

TEST_CASE("Cores are tuned on recordings that they have not seen") {
  // The level belongs to the recording and lies between those of two recordings of the other label:
  // neighbours reveal single windows, but not a recording held out.
  std::vector<Recording> recordings;
  for (std::size_t r = 0; r < 8; ++r) {
    Recording own;
    own.label = r % 2 == 0 ? "a" : "b";
    own.file = std::to_string(r);
    own.channels = {{"X", 200.0, "count"}};
    own.samples = {noise(2000, r)};
    for (double& v : own.samples[0]) v += 100.0 * static_cast<double>(r);
    recordings.push_back(std::move(own));
  }
  RecordingSetup setup;
  setup.features = {Family::smmrp10, Combine::concat};
  setup.window_s = 1.0;
  setup.step_s = 0.25;
  const auto model = train_recording_model(recordings, setup, window_recipe(Learner::all), {}, {});
  REQUIRE(model);
  const auto counts = words_after(saved(*model), "cv_errors,train_rows,fits,folds");
  REQUIRE(counts.size() == 5);
  const std::size_t errors = std::stoul(counts[1]), rows = std::stoul(counts[2]);
  CHECK(rows == 8 * 37);
  CHECK(errors > rows / 4);
}

TEST_CASE("Invalid trees and states of another size are refused despite a correct checksum") {
  const std::string tree = saved(trained(Learner::tree).value());
  CHECK(with(tree, "trees 1", "trees 1") == tree);
  const auto child = words_after(tree, "child");
  REQUIRE(child.size() > 2);  // the root and its children
  check_corrupt(with(tree, "\nchild " + child[1] + " ", "\nchild 0 "), "child");
  check_corrupt(with(tree, "\nchild " + child[1] + " ", "\nchild 99999 "), "child");
  check_corrupt(with(tree, "\nchild " + child[1] + " ", "\nchild 18446744073709551615 "), "child");
  check_corrupt(
      with(tree, "\nfeature " + words_after(tree.substr(tree.find("\ntrees ")), "feature")[1] + " ",
           "\nfeature 4 "),
      "feature");
  check_corrupt(with(tree, "trees 1", "trees 2"), "unexpected");
  const std::string svm = saved(trained(Learner::svm).value());
  const auto vectors = words_after(svm, "vectors");
  check_corrupt(with(svm, "\nvectors " + vectors[1] + " ", "\nvectors 99999999999 "), "vectors");
  check_corrupt(with(svm, "\nvectors " + vectors[1] + " ", "\nvectors 0 "), "unexpected");
  check_corrupt(with(svm, "\ngamma ", "\ngamma -"), "positive");
  if (!is_available(Learner::xgb)) return;
  const std::string booster = saved(trained(Learner::xgb).value());
  check_corrupt(with(booster, "\nbooster {", "\nbooster ["), "not match");
  check_corrupt(
      with(booster, R"("num_feature":"3","num_target")", R"("num_feature":"2","num_target")"),
      "not match");
}

// The library would follow these links anywhere.
TEST_CASE("Stored boosters with invalid trees are refused before XGBoost reads them") {
  if (!is_available(Learner::xgb)) return;
  const std::string booster = saved(trained(Learner::xgb).value());
  REQUIRE(loaded(booster));
  struct Damage {
    std::string from, to, part;
  };
  const std::vector<Damage> damages = {
      {R"("left_children":[1,)", R"("left_children":[99999999,)", "invalid child"},
      {R"("left_children":[1,)", R"("left_children":[0,)", "invalid child"},
      {R"("left_children":[1,)", R"("left_children":[2,)", "invalid child"},
      {R"("left_children":[1,)", R"("left_children":[-1,)", "invalid child"},
      {R"("left_children":[1,)", R"("left_children":[1.5,)", "without nodes"},
      {R"("left_children":[1,)", R"("left_children":[1,-1,)", "invalid list"},
      {R"("parents":[2147483647,0,)", R"("parents":[2147483647,99999999,)", "parent"},
      {R"("parents":[2147483647,0,)", R"("parents":[2147483647,-1,)", "parent"},
      {R"("parents":[2147483647,0,)", R"("parents":[2147483647,2,)", "parent"},
      {R"("split_conditions":[)", R"("split_conditions":[1e308,)", "invalid list"},
      {R"("sum_hessian":[)", R"("sum_hessian":[)" + std::string(39, '9'), "invalid list"},
      {R"("base_score":")", R"("base_score":"1e9)", "base score"},
      {R"("right_children":[2,)", R"("right_children":[true,)", "whole numbers"},
      {R"("split_indices":[)", R"("split_indices":[1)", "feature number"},
      {R"("split_type":[0,)", R"("split_type":[1,)", "categorical"},
      {R"("id":1,)", R"("id":0,)", "order"},
      {R"("categories":[])", R"("categories":[1])", "categorical"},
      {R"("num_nodes":")", R"("num_nodes":"1)", "number of nodes"},
      {R"("tree_info":[0,)", R"("tree_info":[3,)", "class number"},
      {R"("tree_info":[0,)", R"("tree_info":[)", "number of trees"},
      {R"("num_trees":")", R"("num_trees":"1)", "number of trees"},
      {R"("num_parallel_tree":"1")", R"("num_parallel_tree":"0")", "rounds"},
      {R"("name":"gbtree")", R"("name":"gblinear")", "kind"},
      {R"("name":"multi:softprob")", R"("name":"reg:linear")", "kind"},
      {R"("trees":[{)", R"("trees":[[{)", "not match"},  // no JSON
      {R"("attributes":{})", R"("attributes":)" + std::string(100'000, '['), "not match"},
      {"\nbooster {", "\nbooster binf", "not match"},  // the library's older format
  };
  for (const auto& [from, to, part] : damages) {
    INFO(from << " becomes " << to.substr(0, 40));
    REQUIRE(booster.find(from) != std::string::npos);
    check_corrupt(with(booster, from, to), part);
  }
}

TEST_CASE(
    "A model file of recordings that is damaged, truncated or of another version is refused") {
  const std::string text = saved(trained(Learner::lda).value());
  classifier::testing::check_damage_is_refused(text, loaded);
}

TEST_CASE("A model of recordings refuses another sensor and a recording without a window") {
  const auto model = trained(Learner::lda);
  REQUIRE(model);
  auto other = three_levels(2);
  other[3].channels[1].rate_hz = 100.0;
  const auto refused = classify_recordings(*model, other);
  REQUIRE(!refused);
  CHECK(refused.error().where.find("b2") != std::string::npos);
  CHECK(refused.error().got.find("100") != std::string::npos);
  auto next_session = three_levels(2);  // the same sensor, with its clock 150 ppm off
  for (Recording& recording : next_session)
    for (Channel& channel : recording.channels) channel.rate_hz *= 1.00015;
  CHECK(classify_recordings(*model, next_session));
  for (Recording& recording : next_session) recording.channels[1].rate_hz *= 1.0001;
  CHECK_FALSE(classify_recordings(*model, next_session));
  next_session = three_levels(2);
  for (Recording& recording : next_session) recording.channels[0].unit = "Pa";
  CHECK_FALSE(classify_recordings(*model, next_session));
  auto brief = three_levels(2);
  for (auto& channel : brief[2].samples) channel.resize(50);
  const auto no_window = classify_recordings(*model, brief);
  REQUIRE(!no_window);
  CHECK(no_window.error().where.find("b1") != std::string::npos);
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_model_test
