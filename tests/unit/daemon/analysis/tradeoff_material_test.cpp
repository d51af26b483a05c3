// `weft trade classifier`: the trials and the amount of data of a choice.

#include "daemon/analysis/tradeoff/material.hpp"

#include <algorithm>

#include "classifier/features/feature_matrix.hpp"
#include "tests/unit/daemon/analysis/tradeoff_fixture.hpp"

namespace trade_material_test {

using namespace weft;
using namespace weft::daemon;
using trade_test::campaign_set;
using trade_test::two_explorations;

TEST_CASE("a shortened trial keeps its other phases whole") {
  const classifier::Trial whole = campaign_set(2).trials.front();
  const classifier::Trial cut = shortened(whole, 5);
  const auto count = [](const classifier::Trial& t, Phase p) {
    return std::count(t.phase.begin(), t.phase.end(), p);
  };
  CHECK(count(cut, Phase::motion) == 5);
  for (const Phase phase : {Phase::rest, Phase::press, Phase::end})
    CHECK(count(cut, phase) == count(whole, phase));
  CHECK(cut.counts.size() == cut.samples() * cut.taxels);
  // the first row of E follows the fifth of M
  const auto end = std::find(cut.phase.begin(), cut.phase.end(), Phase::end) - cut.phase.begin();
  const auto whole_end =
      std::find(whole.phase.begin(), whole.phase.end(), Phase::end) - whole.phase.begin();
  const auto got = cut.row(static_cast<std::size_t>(end));
  const auto expected = whole.row(static_cast<std::size_t>(whole_end));
  CHECK(std::equal(got.begin(), got.end(), expected.begin(), expected.end()));
  CHECK(shortened(whole, 1'000'000).counts == whole.counts);
}

TEST_CASE("the speed of a recording is read from its name, without its direction") {
  CHECK(speed_in_name("Denim_F120_V-10mmps_0.csv") == 10.0);
  CHECK(speed_in_name("A_Value_F1_V2.5mmps_1.csv") == 2.5);
  for (const char* name : {"0000-wool-M1-r01", "x_V.csv", "x_Vmmps_1", "x_Vfastmmps_1",
                           "x_V1e999mmps_1", "x_V0mmps_1", ""})
    CHECK_FALSE(speed_in_name(name).has_value());
}

TEST_CASE("material counts the seconds of sliding that were used") {
  const Dataset set = campaign_set();
  const auto whole = prepare(set, {"M1", 0, {}, 1});
  const auto cut = prepare(set, {"M1", 2, {}, 1});
  const auto beyond = prepare(set, {"M1", 1000, {}, 1});
  REQUIRE((whole && cut && beyond));
  CHECK(whole->features.size() == 18);
  CHECK(whole->slide_s.front() == Approx(10).margin(1.0 / 37));
  CHECK(cut->slide_s.front() == Approx(2).margin(1.0 / 37));
  CHECK(beyond->slide_s == whole->slide_s);
  CHECK_FALSE(prepare(set, {"M9", 0, {}, 1}).has_value());
  Dataset no_rate = set;
  no_rate.info.taxel_rate_hz = 0;
  CHECK_FALSE(prepare(no_rate, {"M1", 0, {}, 1}).has_value());
}

TEST_CASE("joined explorations stand side by side, each row one repetition of one fabric") {
  Dataset set = two_explorations();
  set.records.back().outcome = TrialOutcome::aborted;  // M2 of the last: no row
  const auto joined = prepare(set, {"M1+M2", 0, {}, 1});
  const auto first = prepare(set, {"M1", 0, {}, 1});
  REQUIRE((joined && first));
  CHECK(joined->features.size() == 17);
  REQUIRE(joined->features.names.size() == 2 * first->features.names.size());
  CHECK(joined->features.names.front().rfind("M1:", 0) == 0);
  CHECK(joined->features.names.back().rfind("M2:", 0) == 0);
  CHECK(joined->slide_s.front() == Approx(2 * first->slide_s.front()));
  for (std::size_t r = 0; r < joined->features.size(); ++r) {
    const auto& pair = joined->trials[r];
    REQUIRE(pair.size() == 2);
    CHECK(set.trials[pair[0]].file + "-M2" == set.trials[pair[1]].file);
    const auto alone = classifier::extract(set.trials[pair[0]]);
    REQUIRE(alone.has_value());
    CHECK(std::equal(alone->begin(), alone->end(), joined->features.values.row(r).begin()));
  }
}

}  // namespace trade_material_test
