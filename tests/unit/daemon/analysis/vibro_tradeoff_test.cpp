// The trade-off of sound and vibration on made-up recordings.

#include <catch2/catch.hpp>

#include <set>

#include "daemon/analysis/tradeoff/measure_vibro.hpp"

namespace weft::daemon::vibro_trade_test {
namespace {

namespace vibro = classifier::vibro;

// Three materials with noise of different levels, on a slow sound and three axes.
RecordingSet three_materials() {
  RecordingSet out{"made up", "recordings", BenchKind::simulated, {}};
  std::uint64_t state = 1;
  const auto noise = [&] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 33U) / 2147483648.0 - 0.5;
  };
  for (int m = 0; m < 3; ++m) {
    vibro::Recording r{"m" + std::to_string(m), "material" + std::to_string(m), "1", {}, {}};
    for (const char* name : {"S", "X", "Y", "Z"}) {
      const double rate = name == std::string("S") ? 1000.0 : 200.0;
      r.channels.push_back({name, rate, "1"});
      r.samples.emplace_back();
      for (int i = 0; i < static_cast<int>(rate * 12); ++i)
        r.samples.back().push_back((1.0 + m) * noise());
    }
    out.recordings.push_back(std::move(r));
  }
  return out;
}

VibroTradeoffOptions few() {
  VibroTradeoffOptions out;
  out.learners = {classifier::Learner::nb, classifier::Learner::knn};
  out.protocol.blocks = 3;
  out.protocol.per_recording = 30;
  out.protocol.repeats = 2;
  out.timings = 5;
  return out;
}

double ticks() {
  static double now = 0.0;
  return now += 1e-6;
}

TEST_CASE("Sources are sound, the other channels, and both") {
  RecordingSet set = three_materials();
  CHECK(list_sources(set) == std::vector<std::string>{"S", "XYZ", "SXYZ"});
  CHECK(of_source(set, "S").front().channels.size() == 1);
  CHECK(of_source(set, "XYZ").front().channels.front().name == "X");
  CHECK(of_source(set, "SXYZ").front().samples == set.recordings.front().samples);
  for (auto& r : set.recordings) {
    r.channels.erase(r.channels.begin());
    r.samples.erase(r.samples.begin());
  }
  CHECK(list_sources(set) == std::vector<std::string>{"XYZ"});
  CHECK(of_source(set, "XYZ").front().samples == set.recordings.front().samples);
}

TEST_CASE("Every choice is measured under both protocols, and only one of them leaks") {
  const RecordingSet set = three_materials();
  const auto tradeoff = measure_vibro_tradeoff(set, few(), ticks);
  REQUIRE(tradeoff);
  // learners x features x windows x sources x protocols
  CHECK(tradeoff->points.size() == 2 * 3 * 2 * 3 * 2);
  CHECK(tradeoff->random_leak.median > 0.8);
  CHECK(tradeoff->honest_leak.largest == 0.0);
  std::set<std::string> names;
  for (const vibro::Protocol protocol : {vibro::Protocol::random, vibro::Protocol::blocks}) {
    const TradeoffSet own = vibro_tradeoff_set(*tradeoff, set, "made-up.h5", protocol);
    CHECK(own.points.size() == tradeoff->points.size() / 2);
    CHECK(own.bench == BenchKind::simulated);
    for (const TradeoffPoint& p : own.points) {
      CHECK(p.answer_s > 0.0);
      CHECK(p.ci95.low <= p.accuracy);
      CHECK(p.accuracy <= p.ci95.high);
      names.insert(p.name);
    }
    for (const TradeoffCost& cost : classifier_costs()) CHECK(find_front(own, cost));
    const bool random = protocol == vibro::Protocol::random;
    CHECK((own.dataset.find("random") != std::string::npos) == random);
    CHECK((format_text(own.facts.back()).find("no samples") == std::string::npos) == random);
  }
  CHECK(names.size() == tradeoff->points.size() / 2);

  const std::string tables = render(vibro_tables(*tradeoff, "<b>SIMULATED</b>"));
  for (const char* words :
       {"Table 1", "Figure 4", "Table 2", "average", "material2", "<b>SIMULATED</b>"})
    CHECK(tables.find(words) != std::string::npos);
  CHECK_FALSE(tradeoff->papers_recipe);  // 30 windows of a texture, not 100
  CHECK(tables.find("0.984") == std::string::npos);
}

TEST_CASE("Recordings too short for a window are named, of each window and protocol once") {
  RecordingSet set = three_materials();
  vibro::Recording brief = set.recordings.front();
  brief.file = "brief";
  for (std::size_t c = 0; c < brief.channels.size(); ++c)
    brief.samples[c].resize(static_cast<std::size_t>(1.5 * brief.channels[c].rate_hz));
  set.recordings.push_back(brief);
  VibroTradeoffOptions options = few();
  options.learners = {classifier::Learner::nb};
  const auto tradeoff = measure_vibro_tradeoff(set, options, ticks).value();
  const auto random = vibro_tradeoff_set(tradeoff, set, "d", vibro::Protocol::random).left_out;
  REQUIRE(random.size() == 1);  // for windows of 2 s; those of 1 s fit
  CHECK(random[0].first == "recordings for windows of 2 s");
  CHECK(random[0].second.find(": brief (material0)") != std::string::npos);
  const auto blocks = vibro_tradeoff_set(tradeoff, set, "d", vibro::Protocol::blocks).left_out;
  REQUIRE(blocks.size() == 2);
  CHECK(blocks[0].second.find("3 blocks") != std::string::npos);
}

TEST_CASE("The time of a window's features is that of one extraction, of a set of any size") {
  const RecordingSet set = three_materials();
  const vibro::FeatureChoice choice;
  for (const double step_s : {0.5, 2.0}) {
    vibro::ProtocolOptions protocol;
    protocol.window_s = 1.0;
    protocol.step_s = step_s;
    const auto windows =
        vibro::cut_and_extract(set.recordings, 1.0, vibro::places_of(protocol), choice);
    REQUIRE(windows);
    CHECK(vibro_features_time(set.recordings, *windows, choice, 7, ticks).value() == Approx(1e-6));
  }
}

TEST_CASE("Too few timings and recordings too short for their blocks are refused") {
  VibroTradeoffOptions options = few();
  options.timings = 4;
  CHECK_FALSE(measure_vibro_tradeoff(three_materials(), options, ticks));
  options = few();
  options.protocol.blocks = 20;
  CHECK_FALSE(measure_vibro_tradeoff(three_materials(), options, ticks));
  CHECK_FALSE(measure_vibro_tradeoff(RecordingSet{}, few(), ticks));
}

TEST_CASE("A window that does not fit is refused before anything is trained, by its name") {
  VibroTradeoffOptions options = few();
  options.windows_s = {1.0, 30.0};
  std::size_t measured = 0;
  const auto tradeoff =
      measure_vibro_tradeoff(three_materials(), options, ticks,
                             [&](std::size_t, std::size_t, const std::string&) { ++measured; });
  REQUIRE_FALSE(tradeoff);
  CHECK(tradeoff.error().where.find("30 s windows, random") == 0);
  CHECK(measured == 0);
  CHECK_FALSE(check_vibro_tradeoff(three_materials(), options));
  CHECK(check_vibro_tradeoff(three_materials(), few()));
  options.windows_s = {1.0, 1e-3};  // without a sample of the slowest channel
  CHECK_FALSE(check_vibro_tradeoff(three_materials(), options));
}

TEST_CASE("Windows of different lengths have names of their own") {
  VibroTradeoffOptions options = few();
  options.windows_s = {0.25, 0.5};
  options.learners = {classifier::Learner::nb};
  options.families = {vibro::Family::smmrp};
  const auto tradeoff = measure_vibro_tradeoff(three_materials(), options, ticks).value();
  const TradeoffSet set =
      vibro_tradeoff_set(tradeoff, three_materials(), "d.h5", vibro::Protocol::random);
  std::set<std::string> names;
  for (const TradeoffPoint& p : set.points) names.insert(p.name);
  CHECK(names.size() == set.points.size());
  CHECK(names.contains("nb SMMRP 0.25 s S"));
}

}  // namespace
}  // namespace weft::daemon::vibro_trade_test
