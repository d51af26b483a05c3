#include "daemon/storage/dataset/data_warnings.hpp"

#include <catch2/catch.hpp>

#include "daemon/storage/recordings/recording_set.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::data_warnings_test {
namespace {

// Five recordings of a signal that changes, except in the `faulty` ones.
CheckedSignal constant_in(const std::string& name, const std::vector<std::size_t>& faulty) {
  CheckedSignal out{name, std::vector<classifier::SignalState>(5)};
  for (const std::size_t i : faulty) out.states[i].constant = true;
  return out;
}

const std::vector<std::string> names{"a", "b", "c", "d", "e"};

std::vector<std::string> texts_of(const std::vector<CheckedSignal>& signals) {
  std::vector<std::string> out;
  for (const Warning& one : describe_signals(signals, names, "taxel", "trial"))
    out.push_back(one.text);
  return out;
}

}  // namespace

TEST_CASE("signals with one fault in the same recordings share a sentence that names both") {
  CHECK(texts_of({constant_in("1", {}), constant_in("7", {1, 3})}) ==
        std::vector<std::string>{"taxel 7 is constant in 2 of 5 trials (b, d)"});
  CHECK(texts_of({constant_in("1", {2}), constant_in("2", {2}), constant_in("3", {2}),
                  constant_in("5", {2}), constant_in("6", {0, 1, 2, 3, 4})}) ==
        std::vector<std::string>{"taxel 6 is constant in all 5 trials",
                                 "taxels 1 to 3, 5 are constant in 1 of 5 trials (c)"});
}

TEST_CASE("a lower limit is one where the signal does not rest") {
  CheckedSignal signal = constant_in("1", {});
  for (classifier::SignalState& state : signal.states) state.high.value = 100;
  signal.states[1].low.held = true;
  CHECK(texts_of({signal}).empty());
  signal.rest.assign(5, 0.0);
  CHECK(texts_of({signal}).empty());
  signal.rest.assign(5, 90.0);
  CHECK(texts_of({signal}) ==
        std::vector<std::string>{"taxel 1 is saturated in 1 of 5 trials (b)"});
  signal.states[0].low.value = -1.0;  // now there is a value below
  CHECK(texts_of({signal}).empty());
}

TEST_CASE("a channel is a clock only where it rises in every recording") {
  CheckedSignal signal = constant_in("t", {});
  for (classifier::SignalState& state : signal.states) state.only_rises = true;
  const auto warnings = describe_signals(std::vector{signal}, names, "channel", "recording");
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].code == "only_rises");
  CHECK(warnings[0].text.starts_with("channel t "));
  CHECK(warnings[0].text.find("all 5 ") != std::string::npos);
  signal.states[4].only_rises = false;
  CHECK(texts_of({signal}).empty());
}

TEST_CASE("gaps of recordings are written, read and part of the digest, and none changes nothing") {
  const test::TemporaryFolder folder;
  RecordingSet set{"s", "recordings", BenchKind::real, {}};
  set.recordings.push_back({"a", "felt", "1", {{"X", 10.0, "1"}}, {{1, 2, 3, 4}}});
  set.recordings.push_back(set.recordings[0]);
  set.recordings[1].file = "b";
  const std::string before = recordings_sha256(set);
  set.recordings[1].gaps = {{0.1, 0.1}, {0.2, 0.3}};
  const auto digest = write_recordings(set, folder / "r.h5");
  REQUIRE(digest);
  CHECK(*digest != before);
  const auto copy = read_recordings(folder / "r.h5");
  REQUIRE(copy);
  CHECK(copy->recordings[0].gaps.empty());
  CHECK(copy->recordings[1].gaps == set.recordings[1].gaps);
  std::swap(set.recordings[1].gaps[0], set.recordings[1].gaps[1]);
  CHECK_FALSE(write_recordings(set, folder / "bad.h5"));
}

}  // namespace weft::daemon::data_warnings_test
