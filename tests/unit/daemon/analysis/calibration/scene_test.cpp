// Strokes that the plant simulates again, and their selection.

#include <catch2/catch.hpp>
#include <set>

#include "daemon/analysis/calibration/scene.hpp"
#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::scene_test {

using namespace test;

TEST_CASE("A scene has the level that was recorded without a wrench") {
  const RecordingView like = empty_strokes({"denim", "felt"}, 2);
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  auto scene = Scene::make(like, *model);
  REQUIRE(scene);
  CHECK(model->scale() == 1);
  const auto made = scene->simulate(model->start(), 7, 1);
  REQUIRE(made);
  REQUIRE(made->strokes.size() == like.strokes.size());
  for (const Stroke& stroke : made->strokes) {
    CHECK(mean_of(stroke.level) == Approx(recorded_level).epsilon(0.15));
    CHECK(std::isnan(stroke.force_n));
  }
}

TEST_CASE("A scene has the level above a load at rest, whatever the gain of the wrench") {
  for (const double gain : {1.0, 10.0}) {
    RecordingView like = empty_strokes({"denim"}, 1);
    for (Stroke& stroke : like.strokes) {
      stroke.force_n = 4 * gain;
      stroke.rest_force_n = 0.5 * gain;
    }
    const auto model = ClothModel::make(like, table());
    REQUIRE(model);
    auto scene = Scene::make(like, *model);
    REQUIRE(scene);
    const auto made = scene->simulate(model->start(), 7, 1);
    REQUIRE(made);
    CHECK(mean_of(made->strokes[0].level) == Approx(recorded_level).epsilon(0.15));
    CHECK(made->strokes[0].force_n > 0);
  }
}

TEST_CASE("Threads and earlier calls change nothing in a scene") {
  const RecordingView like = empty_strokes({"denim", "felt", "silk"}, 1);
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  auto one = Scene::make(like, *model), two = Scene::make(like, *model);
  REQUIRE(one);
  REQUIRE(two);
  std::vector<double> rougher = model->start();
  rougher[model->find("height_um", "felt")] *= 1.3;
  const auto first = one->simulate(model->start(), 7, 1);
  REQUIRE(two->simulate(rougher, 7, 2));
  const auto again = two->simulate(model->start(), 7, 2);
  const auto other = two->simulate(rougher, 7, 2);
  REQUIRE(first);
  REQUIRE(again);
  REQUIRE(other);
  for (std::size_t i = 0; i < like.strokes.size(); ++i) {
    CHECK(first->strokes[i].counts == again->strokes[i].counts);
    const bool is_rougher = like.strokes[i].cloth == "felt";
    CHECK((first->strokes[i].counts != other->strokes[i].counts) == is_rougher);
  }
}

TEST_CASE("Tiles of texture are kept while another parameter moves, and change nothing") {
  const RecordingView like = empty_strokes({"denim", "felt"}, 2, 2);
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  auto warm = Scene::make(like, *model), cold = Scene::make(like, *model);
  REQUIRE(warm);
  REQUIRE(cold);
  std::vector<double> moved = model->start();
  moved[model->find("grip_N_mm")] *= 10;
  moved[model->find("path_mm")] *= 3;
  moved[model->find("waviness_um", "felt")] *= 2;
  moved[model->find("tilt_mrad")] *= 2;
  const auto before = warm->simulate(model->start(), 7, 1);
  const auto with = warm->simulate(moved, 7, 1), without = cold->simulate(moved, 7, 1);
  REQUIRE(before);
  REQUIRE(with);
  REQUIRE(without);
  for (std::size_t i = 0; i < like.strokes.size(); ++i) {
    CHECK(with->strokes[i].counts == without->strokes[i].counts);
    CHECK(with->strokes[i].counts != before->strokes[i].counts);
  }
}

TEST_CASE("A louder sensor has its counts scaled") {
  RecordingView like = empty_strokes({"denim"}, 1);
  for (Stroke& stroke : like.strokes)
    for (double& level : stroke.level) level = 20 * recorded_level;
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  auto scene = Scene::make(like, *model);
  REQUIRE(scene);
  CHECK(model->scale() > 1);
  const auto made = scene->simulate(model->start(), 7, 1);
  REQUIRE(made);
  CHECK(mean_of(made->strokes[0].level) == Approx(20 * recorded_level).epsilon(0.15));
}

TEST_CASE("A scene of weaker strokes has the scale of the model") {
  RecordingView like = empty_strokes({"denim"}, 2);
  for (double& level : like.strokes[0].level) level = 20 * recorded_level;
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  auto whole = Scene::make(like, *model), part = Scene::make(subset(like, {1}), *model);
  REQUIRE(whole);
  REQUIRE(part);
  const auto all = whole->simulate(model->start(), 7, 1),
             one = part->simulate(model->start(), 7, 1);
  REQUIRE(all);
  REQUIRE(one);
  CHECK(one->strokes[0].counts == all->strokes[1].counts);
}

TEST_CASE("More channels than the simulated array has are refused") {
  RecordingView like = empty_strokes({"denim"}, 1);
  like.recorded.back() = sim::pad_count;
  const auto model = ClothModel::make(like, table());
  REQUIRE(model);
  const auto scene = Scene::make(like, *model);
  REQUIRE_FALSE(scene);
  CHECK(scene.error().code == Errc::unsupported);
}

TEST_CASE("A choice has every fabric and pairs, and at most the allowed windows") {
  const RecordingView view = empty_strokes({"denim", "felt", "silk"}, 3, 4);
  const RecordingView chosen = choose_strokes(view, 8);
  CHECK(chosen.strokes.size() == 8);
  std::set<std::string> cloths;
  std::multiset<std::string> cells;
  for (const Stroke& stroke : chosen.strokes) {
    cloths.insert(stroke.cloth);
    cells.insert(stroke.cell);
  }
  CHECK(cloths.size() == 3);
  CHECK(cells.count(chosen.strokes.front().cell) == 2);
  CHECK(choose_strokes(view, 1).strokes.size() == 3);  // one of each, regardless of the limit
}

TEST_CASE("The last third of the repetitions is held out, of pairs every third cell") {
  const SplitView many = split_held_out(empty_strokes({"denim"}, 2, 4));
  REQUIRE(many.held_out);
  CHECK(many.fitted.strokes.size() == 6);
  for (const Stroke& stroke : many.held_out->strokes) CHECK(stroke.repetition == 3);
  const SplitView pairs = split_held_out(empty_strokes({"denim"}, 6, 2));
  REQUIRE(pairs.held_out);
  CHECK(pairs.held_out->strokes.size() == 4);
  CHECK(pairs.fitted.strokes.size() == 8);
  CHECK_FALSE(split_held_out(empty_strokes({"denim"}, 1, 1)).held_out);
}

}  // namespace weft::daemon::calibration::scene_test
