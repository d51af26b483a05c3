// Events: snapshots, deltas, reported gaps, and replay.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/service/methods/services.hpp"
#include "daemon/service/rpc/event_hub.hpp"

namespace event_hub_test {

using namespace weft::daemon::server;
using namespace std::chrono_literals;
using nlohmann::json;

namespace {

SubscriptionRequest request(Mode mode, std::vector<std::string> topics = {"run:*"}) {
  return {std::move(topics), mode, 20};
}

std::vector<json> take_all(Subscription& from, Clock now) {
  std::vector<json> out;
  for (std::string next = from.take(now); !next.empty(); next = from.take(now))
    out.push_back(json::parse(next));
  return out;
}

}  // namespace

TEST_CASE("A subscription begins with a snapshot of what was published before") {
  Hub hub;
  hub.publish("run:1", {{"state", "running"}, {"rep", 1}}, 10);
  hub.publish("run:1", {{"rep", 2}}, 20);
  hub.publish("rig", {{"rig", "safe"}}, 30);
  const Opened opened = hub.open(request(Mode::every));
  CHECK(opened.seq == 3);
  CHECK(json::parse(opened.snapshot_json) == json{{"run:1", {{"state", "running"}, {"rep", 2}}}});
  CHECK(opened.subscription->take(0ns).empty());
}

TEST_CASE("Mode every gives each event once, in order, with its number and time") {
  Hub hub;
  const Opened opened = hub.open(request(Mode::every));
  for (int rep = 1; rep <= 3; ++rep) hub.publish("run:1", {{"rep", rep}}, rep * 100);
  hub.publish("rig", {{"rig", "safe"}}, 400);  // not subscribed
  const auto events = take_all(*opened.subscription, 0ns);
  REQUIRE(events.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(events[i]["seq"] == i + 1);
    CHECK(events[i]["t_us"] == (i + 1) * 100);
    CHECK(events[i]["delta"]["rep"] == i + 1);
    CHECK(events[i]["dropped"] == 0);
  }
}

TEST_CASE("Merged events report removed members, also after an intermediate value") {
  Hub hub;
  const Opened opened = hub.open(request(Mode::latest));
  hub.publish("run:1", {{"attention", {{"text", "Mount denim."}, {"step", "Q-1"}}}}, 10);
  hub.publish("run:1", {{"attention", {{"text", "Mount silk."}, {"step", nullptr}}}}, 20);
  auto events = take_all(*opened.subscription, 0ns);
  REQUIRE(events.size() == 1);
  CHECK(events[0]["delta"]["attention"] == json{{"text", "Mount silk."}, {"step", nullptr}});
  hub.publish("run:1", {{"attention", {{"text", "Mount wool."}}}}, 30);
  hub.publish("run:1", {{"attention", nullptr}}, 40);
  events = take_all(*opened.subscription, 1s);
  REQUIRE(events.size() == 1);
  CHECK(events[0]["delta"].at("attention").is_null());
}

TEST_CASE("A listener that does not read loses its oldest events, counted, and no other's") {
  Hub hub;
  const Opened slow = hub.open(request(Mode::every)), quick = hub.open(request(Mode::every));
  constexpr std::size_t count = Subscription::most_waiting + 5;
  std::size_t seen = 0;
  for (std::size_t i = 1; i <= count; ++i) {
    hub.publish("run:1", {{"rep", i}}, 0);
    seen += take_all(*quick.subscription, 0ns).size();
  }
  CHECK(seen == count);
  const auto late = take_all(*slow.subscription, 0ns);
  REQUIRE(late.size() == Subscription::most_waiting);
  CHECK(late.front()["dropped"] == 5);
  CHECK(late.front()["delta"]["rep"] == 6);
  CHECK(late[1]["dropped"] == 0);
}

TEST_CASE("Mode latest merges what changed until it is taken, and keeps to its rate") {
  Hub hub;
  const Opened opened = hub.open(request(Mode::latest));
  for (int i = 1; i <= 100; ++i)
    hub.publish("run:1", {{"rep", i}, {i % 2 == 0 ? "k0" : "k1", i}}, i);
  auto events = take_all(*opened.subscription, 0ns);
  REQUIRE(events.size() == 1);
  CHECK(events[0]["delta"] == json{{"rep", 100}, {"k0", 100}, {"k1", 99}});
  CHECK(events[0]["seq"] == 100);
  hub.publish("run:1", {{"rep", 101}}, 101);
  CHECK(opened.subscription->take(49ms).empty());
  CHECK_FALSE(opened.subscription->take(50ms).empty());
}

TEST_CASE("A topic that was forgotten comes from the archive, by its name") {
  Hub hub;
  hub.archive_in({.prefix = "run:",
                  .find = [](std::string_view topic) -> std::optional<json> {
                    if (topic == "run:1") return json{{"state", "ended"}};
                    return std::nullopt;
                  },
                  .count = [] { return std::size_t{5}; }});
  hub.publish("run:1", {{"state", "running"}}, 10);
  hub.publish("run:2", {{"state", "queued"}}, 20);
  hub.forget("run:1");
  hub.forget("run:9");
  const Opened by_name = hub.open(request(Mode::every, {"run:1", "run:2", "run:3", "run:1"}));
  CHECK(json::parse(by_name.snapshot_json) ==
        json{{"run:1", {{"state", "ended"}}}, {"run:2", {{"state", "queued"}}}});
  CHECK(by_name.left_off == 0);
  for (const char* const pattern : {"run:*", "*"}) {
    const Opened all = hub.open(request(Mode::every, {pattern}));
    CHECK(json::parse(all.snapshot_json) == json{{"run:2", {{"state", "queued"}}}});
    CHECK(all.left_off == 4);
  }
  hub.publish("run:1", {{"state", "arming"}}, 30);
  CHECK(json::parse(hub.open(request(Mode::every)).snapshot_json).size() == 2);
}

TEST_CASE("A busy topic does not keep a quiet one waiting") {
  Hub hub;
  const Opened opened = hub.open({{"a", "b"}, Mode::latest, 0});
  hub.publish("b", {{"n", 1}}, 0);
  for (int i = 0; i < 10; ++i) hub.publish("a", {{"n", i}}, 0);
  CHECK(json::parse(opened.subscription->take(0ns))["topic"] == "b");
}

TEST_CASE("Events can be had again from a number on, as long as they are kept") {
  Hub hub;
  for (std::size_t i = 1; i <= Hub::most_replayed + 10; ++i) hub.publish("run:1", {{"rep", i}}, 0);
  const std::uint64_t newest = hub.seq();
  const auto again = hub.replay(request(Mode::every), newest - 3);
  REQUIRE(again);
  const auto events = take_all(*again->subscription, 0ns);
  REQUIRE(events.size() == 3);
  CHECK(events[0]["seq"] == newest - 2);
  const auto gone = hub.replay(request(Mode::every), 5);
  REQUIRE_FALSE(gone);
  CHECK(gone.error().kind == "replay.gone");
  CHECK_FALSE(hub.replay(request(Mode::every), newest + 1));
}

TEST_CASE("All events after one come again, however many are kept, and then what is new") {
  Hub hub;
  constexpr std::size_t count = Hub::most_replayed;
  for (std::size_t i = 1; i <= count; ++i) hub.publish("run:1", {{"rep", i}}, 0);
  const auto again = hub.replay(request(Mode::every), 0);
  REQUIRE(again);
  constexpr std::size_t more = Subscription::most_waiting + 5;  // without a reader
  for (std::size_t i = 1; i <= more; ++i) hub.publish("run:1", {{"rep", count + i}}, 0);
  const auto events = take_all(*again->subscription, 0ns);
  REQUIRE(events.size() == count + Subscription::most_waiting);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < count; ++i)
    wrong += events[i]["seq"] == i + 1 && events[i]["dropped"] == 0 ? 0 : 1;
  CHECK(wrong == 0);
  CHECK(events[count]["dropped"] == 5);  // the gap is reported at its place
  CHECK(events[count]["seq"] == count + 6);
  CHECK(events[count + 1]["dropped"] == 0);
}

TEST_CASE("Numbers of what was only passed on are no gap in what is kept") {
  Hub hub;
  for (int i = 0; i < 5; ++i) hub.pass_on("stream:force", {{"fz_n", i}}, 0);
  hub.publish("run:1", {{"rep", 1}}, 0);
  const auto again = hub.replay(request(Mode::every), 2);
  REQUIRE(again);
  CHECK(take_all(*again->subscription, 0ns).size() == 1);
}

TEST_CASE("A snapshot too long for one line has the newest topics and the count of the rest") {
  Hub hub;
  const std::string long_text(10'000, 'x');
  constexpr std::size_t count = 300;
  for (std::size_t i = 0; i < count; ++i)
    hub.publish("run:" + std::to_string(i), {{"text", long_text}}, 0);
  hub.publish("run:7", {{"rep", 1}}, 0);
  const Opened opened = hub.open(request(Mode::latest));
  CHECK(opened.snapshot_json.size() <= Hub::most_snapshot_bytes + 2);
  const json snapshot = json::parse(opened.snapshot_json);
  CHECK(snapshot.size() + opened.left_off == count);
  CHECK(snapshot.size() > 90);
  CHECK(snapshot.contains("run:7"));
  CHECK(snapshot.contains("run:299"));
  CHECK_FALSE(snapshot.contains("run:0"));
}

TEST_CASE("A subscription that is gone costs nothing more") {
  Hub hub;
  {
    const Opened opened = hub.open(request(Mode::every));
    CHECK(hub.listeners() == 1);
  }
  hub.publish("run:1", {{"rep", 1}}, 0);
  CHECK(hub.listeners() == 0);
}

TEST_CASE("Votes of two explorations' models do not run into each other, merged or not") {
  const auto vote = [](std::vector<std::pair<std::string, double>> probability) {
    weft::daemon::LiveVoteUpdate moment;
    moment.winner = probability.empty() ? "denim" : probability.front().first;
    moment.probability = std::move(probability);
    return weft::daemon::api::vote_json(moment);
  };
  Hub hub;
  const Opened before = hub.open(request(Mode::latest, {"vote:*"}));
  hub.publish("vote:1", vote({{"denim", 0.9}, {"satin", 0.1}}), 10);
  hub.publish("vote:1", vote({{"felt", 0.7}, {"terry", 0.3}}), 20);
  const json expected = json::array(
      {{{"label", "felt"}, {"probability", 0.7}}, {{"label", "terry"}, {"probability", 0.3}}});
  const auto merged = take_all(*before.subscription, 0ns);
  REQUIRE(merged.size() == 1);
  CHECK(merged[0]["delta"]["probability"] == expected);
  CHECK(json::parse(
            hub.open(request(Mode::every, {"vote:*"})).snapshot_json)["vote:1"]["probability"] ==
        expected);
  hub.publish("vote:1", vote({}), 30);  // from a model without unknown-fabric check
  const json now = json::parse(hub.open(request(Mode::every, {"vote:*"})).snapshot_json)["vote:1"];
  CHECK_FALSE(now.contains("probability"));
  CHECK(now["winner"] == "denim");
}

TEST_CASE("Passed-on events reach present listeners only, and are in no snapshot or replay") {
  Hub hub;
  CHECK_FALSE(hub.wanted("stream:force"));
  const Opened listens = hub.open(request(Mode::every, {"stream:*"}));
  const Opened other = hub.open(request(Mode::every));
  CHECK(hub.wanted("stream:force"));
  CHECK_FALSE(hub.wanted("vote:1"));
  hub.publish("run:1", {{"rep", 1}}, 10);
  hub.pass_on("stream:force", {{"fz_n", 5.0}}, 20);
  hub.publish("run:1", {{"rep", 2}}, 30);
  const auto received = take_all(*listens.subscription, 0ns);
  REQUIRE(received.size() == 1);
  CHECK(received[0]["delta"] == json{{"fz_n", 5.0}});
  CHECK(received[0]["seq"] == 2);
  CHECK(take_all(*other.subscription, 0ns).size() == 2);
  CHECK(hub.open(request(Mode::every, {"stream:*"})).snapshot_json == "{}");
  const auto again = hub.replay(request(Mode::every, {"*"}), 0);
  REQUIRE(again);
  CHECK(take_all(*again->subscription, 0ns).size() == 2);
}

TEST_CASE("A subscription with credit sends at most the granted events, in either mode") {
  Hub hub;
  SubscriptionRequest some = request(Mode::every);
  some.credit = 1;
  const Opened every = hub.open(some);
  some.mode = Mode::latest;
  some.max_hz = 0;
  const Opened latest = hub.open(some);
  const Opened free = hub.open(request(Mode::every));
  for (int rep = 1; rep <= 3; ++rep) hub.publish("run:1", {{"rep", rep}}, rep);
  hub.publish("run:2", {{"rep", 9}}, 4);
  CHECK(take_all(*every.subscription, 0ns).size() == 1);
  CHECK(take_all(*latest.subscription, 0ns).front()["delta"] == json{{"rep", 3}});
  REQUIRE(every.subscription->grant(2));
  const auto more = take_all(*every.subscription, 0ns);
  REQUIRE(more.size() == 2);
  CHECK(more[0]["delta"] == json{{"rep", 2}});
  CHECK(*every.subscription->credit() == 0);
  REQUIRE(latest.subscription->grant(Subscription::most_credit));
  CHECK(take_all(*latest.subscription, 0ns).size() == 1);
  REQUIRE(latest.subscription->grant(Subscription::most_credit));
  CHECK(*latest.subscription->credit() == Subscription::most_credit);
  CHECK(free.subscription->grant(1).error().code == weft::Errc::wrong_state);
}

}  // namespace event_hub_test
