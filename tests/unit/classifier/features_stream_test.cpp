#include <catch2/catch.hpp>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/features/feature_stream.hpp"
#include "classifier/live/staged_model.hpp"
#include "tests/unit/allocations.hpp"
#include "tests/unit/classifier/features_support.hpp"

namespace weft::classifier::features_stream_test {
namespace {

using testing::slide;

TEST_CASE("A stream gives at every moment what the trial so far gives") {
  const Trial whole = slide(17, 60, 5);
  FeatureStream stream(17);
  CHECK_FALSE(stream.features());
  for (int round = 0; round < 2; ++round) {
    Trial so_far;
    so_far.file = "so far";
    so_far.taxels = 17;
    for (std::size_t i = 0; i < whole.samples(); ++i) {
      REQUIRE(stream.add(whole.phase[i], whole.row(i)));
      so_far.phase.push_back(whole.phase[i]);
      so_far.counts.insert(so_far.counts.end(), whole.row(i).begin(), whole.row(i).end());
      const auto batch = extract(so_far);
      const auto now = stream.features();
      REQUIRE(now.has_value() == batch.has_value());
      if (!now) continue;
      CHECK(stream.phases() == phases_of(so_far));
      CHECK(std::equal(now->begin(), now->end(), batch->begin(), batch->end()));
    }
    CHECK(stream.motion_frames() == 60);
    stream.restart();
    CHECK(stream.motion_frames() == 0);
    CHECK_FALSE(stream.features());
  }
}

TEST_CASE("A stream refuses incomplete and infinite frames and goes on as if they had not come") {
  FeatureStream stream(2);
  REQUIRE(stream.add(Phase::motion, std::vector<double>{1, 2, 3, 4}));
  CHECK_FALSE(stream.add(Phase::motion, std::vector<double>{1, 2, 3}));
  const auto bad = stream.add(Phase::motion, std::vector<double>{1, 2, 3, std::nan("")});
  REQUIRE_FALSE(bad);
  CHECK(bad.error().where == "frame 1, taxel 2");
  CHECK(stream.motion_frames() == 2);
  CHECK_FALSE(FeatureStream(1, {.mode_bin_counts = -1.0}).features());
}

TEST_CASE("Trials of lengths that it knows cost an extractor no allocation") {
  FeatureExtractor extractor;
  const std::vector<Trial> trials = {slide(19, 90, 1), slide(19, 131, 2), slide(19, 89, 3)};
  for (const Trial& trial : trials) REQUIRE(extractor.extract(trial));
  const std::size_t before = allocations();
  bool fine = true;
  for (const Trial& trial : trials) fine = fine && extractor.extract(trial).has_value();
  const std::size_t after = allocations();
  CHECK(fine);
  CHECK(after == before);
}

TEST_CASE("Looks at every stage of a second slide cost a stream no allocation") {
  const std::vector<double> seconds = stage_seconds(60);  // twelve lengths
  const Trial whole = slide(16, 60 * 37 + 1, 7);
  FeatureStream stream(16);
  const auto inspections = [&] {
    stream.restart();
    std::size_t seen = 0;
    for (std::size_t i = 0; i < whole.samples(); ++i) {
      const bool added = stream.add(whole.phase[i], whole.row(i)).has_value();
      const bool due =
          seen < seconds.size() && whole.phase[i] == Phase::motion &&
          static_cast<double>(stream.motion_frames()) >= std::ceil(seconds[seen] * 37.0);
      if (added && due && stream.features()) ++seen;
    }
    return seen;
  };
  CHECK(inspections() == seconds.size());
  CHECK(seconds.size() == 12);
  const std::size_t before = allocations();
  const std::size_t seen = inspections();
  const std::size_t after = allocations();
  CHECK(seen == seconds.size());
  CHECK(after == before);
}

TEST_CASE("An extractor gives the same for a trial whatever it has seen before") {
  FeatureExtractor extractor;
  const Trial one = slide(16, 90, 1), other = slide(16, 131, 2), narrow = slide(3, 20, 3);
  const auto want = extract(one);
  REQUIRE(want);
  for (const Trial* before : {&other, &narrow, &one}) {
    REQUIRE(extractor.extract(*before));
    const auto got = extractor.extract(one);
    REQUIRE(got);
    CHECK(std::equal(got->begin(), got->end(), want->begin(), want->end()));
  }
}

}  // namespace
}  // namespace weft::classifier::features_stream_test
