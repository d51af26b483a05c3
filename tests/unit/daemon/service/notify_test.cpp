// State changes that are events, the settings that are read, the expansion of a template, and an
// outbox without a receiver.

#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/service/notify/notify_settings.hpp"
#include "daemon/service/notify/outbox.hpp"
#include "tests/unit/temporary_folder.hpp"

namespace weft::daemon::test::notifications {

using namespace notify;
using nlohmann::json;
using runs::RigState;
using runs::RunState;
using runs::RunView;

RunView view(std::int64_t number, RunState state, const std::string& outcome = {}) {
  RunView run;
  run.stored.number = number;
  run.machine.state = state;
  run.stored.outcome = outcome;
  run.trials_done = 3;
  run.trials_planned = 12;
  return run;
}

RunView prompted(std::int64_t number, const std::string& step) {
  RunView run = view(number, RunState::awaiting_operator);
  run.operator_prompt = runs::OperatorPrompt{.prompt = {.text = "Mount denim."}, .step = step};
  return run;
}

std::vector<std::string> names(const std::vector<Event>& events) {
  std::vector<std::string> out;
  for (const Event& event : events) out.emplace_back(to_string(event.kind));
  return out;
}

using Names = std::vector<std::string>;

TEST_CASE("ends, prompts and the empty queue are events, once each", "[notify]") {
  struct Row {
    RunView run;
    Names expected;
  };
  const std::vector<std::vector<Row>> tables{
      // A run that had ended when the daemon started.
      {{view(1, RunState::ended, "complete"), {}}, {view(2, RunState::interrupted), {}}},
      {{view(1, RunState::queued), {}},
       {view(1, RunState::arming), {}},
       {view(1, RunState::running), {}},
       {view(1, RunState::ended, "complete"), {"run.ended", "queue.empty"}},
       {view(1, RunState::ended, "complete"), {}}},  // its handover has changed
      {{view(1, RunState::running), {}},
       {view(2, RunState::queued), {}},
       {view(1, RunState::ended, "failed"), {"run.failed"}},
       {view(2, RunState::arming), {}},
       {view(2, RunState::ended, "aborted"), {"run.ended", "queue.empty"}}},
      {{view(1, RunState::running), {}},
       {view(1, RunState::interrupted), {"run.ended", "queue.empty"}}},
      // Removed from the queue: no run has ended.
      {{view(1, RunState::queued), {}}, {view(1, RunState::ended), {}}},
      {{prompted(1, ""), {}},  // not pending yet
       {prompted(1, "Q-1"), {"operator.needed"}},
       {prompted(1, "Q-1"), {}},
       {view(1, RunState::running), {}},
       {prompted(1, "Q-2"), {"operator.needed"}}},
      // Resumed by a person after its end.
      {{view(1, RunState::running), {}},
       {view(1, RunState::interrupted), {"run.ended", "queue.empty"}},
       {view(1, RunState::queued), {}},
       {view(1, RunState::running), {}},
       {view(1, RunState::ended, "complete"), {"run.ended", "queue.empty"}}},
  };
  for (const auto& table : tables) {
    EventDetector detector("bench17", 0);
    for (const Row& row : table) CHECK(names(detector.on_run(row.run, 5)) == row.expected);
  }
}

TEST_CASE("an end is an event with its facts, and is counted", "[notify]") {
  EventDetector detector("bench17", 0);
  detector.on_run(view(7, RunState::running), 1);
  RunView run = view(7, RunState::ended, "failed");
  run.stored.cleanup = "done";
  run.stored.rig_fact = "safe";
  run.stored.error = "fz: no answer";
  const json event = to_json(detector.on_run(run, 1'000'000).front());
  CHECK(event["event"] == "run.failed");
  CHECK(event["title"] == "bench17: R-000007 failed");
  CHECK(event["priority"] == 5);
  CHECK(event["trials_done"] == 3);
  CHECK(event["error"] == "fz: no answer");
  CHECK(event["time"] == "1970-01-01 00:00:01.000 UTC");
  CHECK(detector.ended() == std::map<std::string, std::uint64_t>{{"failed", 1}});
}

TEST_CASE("a latch is an event when it is set and when it becomes an emergency stop", "[notify]") {
  EventDetector detector("bench17", 0);
  RigState rig;
  rig.halt(RigState::Stop::halt, "ada", "smoke");
  CHECK_FALSE(EventDetector("bench17", 0).on_rig(rig, 1));  // latched before the daemon started
  CHECK_FALSE(detector.on_rig(RigState(), 1));
  CHECK(detector.on_rig(rig, 1));
  CHECK_FALSE(detector.on_rig(rig, 1));
  rig.halt(RigState::Stop::emergency, "ada", "smoke");
  const auto event = detector.on_rig(rig, 1);
  REQUIRE(event);
  CHECK(event->rig == "latched");
  CHECK_FALSE(detector.on_rig(RigState(), 1));
}

TEST_CASE("a low disk is an event again after a tenth above the limit", "[notify]") {
  EventDetector detector("bench17", 1000);
  const std::vector<std::pair<std::uint64_t, bool>> rows{{2000, false}, {999, true},  {500, false},
                                                         {1050, false}, {900, false}, {1100, false},
                                                         {0, true}};
  for (const auto& [free, expected] : rows)
    CHECK(detector.on_disk(free, 1).has_value() == expected);
}

TEST_CASE("templates take the event's values", "[notify]") {
  const json event{{"title", "a \"b\""}, {"priority", 4}, {"error", "line\nend \xff"}};
  CHECK(expand("{title}: {priority} {", event) == "a \"b\": 4 {");
  CHECK(expand_body(R"("{priority} of 5")", event) == "4 of 5");
  const json body = json::parse(expand_body(
      R"({"message":"{title}!","priority":"{priority}","tags":["x","{error}"],"n":1})", event));
  CHECK(body["message"] == "a \"b\"!");
  CHECK(body["priority"] == 4);
  CHECK(body["n"] == 1);
  CHECK(body["tags"][1].get<std::string>().starts_with("line\nend "));
  CHECK(json::parse(expand_body("", to_json(Event{})))["event"] == "run.ended");
}

struct SettingsFolder {
  TemporaryFolder folder;

  void write(const std::string& name, const std::string& text, mode_t mode = 0600) const {
    const auto path = folder / name;
    std::ofstream(path) << text;
    REQUIRE(chmod(path.c_str(), mode) == 0);
  }
  Result<NotifySettings> load(const json& document) const {
    write("notify.json", document.dump(), 0644);
    return load_notify_settings(folder / "notify.json", "bench17");
  }
};

TEST_CASE("settings are read with their secrets", "[notify]") {
  const SettingsFolder files;
  files.write("token", "tk_1\n");
  files.write("password", "secret");
  const auto settings =
      files.load({{"events", {"run.failed", "disk.low"}},
                  {"disk_low_gb", 2.5},
                  {"webhook",
                   {{"url", "https://ntfy.example/weft"},
                    {"token_file", "token"},
                    {"headers", {{"Title", "{title}"}}},
                    {"body", "{text}"}}},
                  {"mqtt", {{"host", "broker"}, {"user", "weft"}, {"password_file", "password"}}}});
  REQUIRE(settings);
  CHECK(settings->events == std::vector{EventKind::run_failed, EventKind::disk_low});
  CHECK(settings->disk_low_bytes == 2'500'000'000);
  CHECK(settings->webhook->token == "tk_1");
  CHECK(settings->webhook->body_json == R"("{text}")");
  CHECK(settings->webhook->tls == TlsUse::verified);
  CHECK(settings->mqtt->topic == "weft/bench17");
  CHECK(settings->mqtt->port == 8883);
  CHECK(settings->mqtt->password == "secret");
  const auto plain = files.load({{"mqtt", {{"host", "broker"}, {"tls", "off"}}}});
  REQUIRE(plain);
  CHECK(plain->mqtt->port == 1883);
  CHECK(plain->events.size() == event_names.size());
}

TEST_CASE("settings that cannot be used are refused", "[notify]") {
  const SettingsFolder files;
  files.write("token", "tk_1");
  files.write("open", "tk_1", 0644);
  files.write("group", "tk_1", 0640);
  files.write("two", "a\nb");
  const auto webhook = [](json more) {
    more["url"] = more.value("url", "https://a.example/x");
    return json{{"webhook", std::move(more)}};
  };
  struct Row {
    json document;
    Errc code;
    std::string where, hint;
  };
  const std::vector<Row> rows{
      {json::object(), Errc::parse, "", ""},
      {{{"webhok", json::object()}}, Errc::parse, "/webhok", "webhook"},
      {webhook({{"headres", json::object()}}), Errc::parse, "/webhook/headres", "headers"},
      {{{"events", {"run.faild"}}, {"mqtt", {{"host", "b"}}}},
       Errc::parse,
       "/events/0",
       "run.failed"},
      {webhook({{"body", "{titel}"}}), Errc::parse, "/webhook/body", "{title}"},
      {webhook({{"body", {{"a", {"{titel}"}}}}}), Errc::parse, "/webhook/body/a/0", ""},
      {webhook({{"token", "tk_1"}}), Errc::parse, "/webhook/token", ""},
      {webhook({{"headers", {{"authorization", "Bearer tk_1"}}}}), Errc::parse,
       "/webhook/headers/authorization", ""},
      {webhook({{"headers", {{"X", "a\r\nb"}}}}), Errc::parse, "/webhook/headers/X", ""},
      {webhook({{"url", "ftp://a.example"}}), Errc::parse, "/webhook/url", ""},
      {webhook({{"url", "https://u:p@a.example"}}), Errc::parse, "/webhook/url", ""},
      {webhook({{"url", "http://a.example"}, {"token_file", "token"}}), Errc::parse, "/webhook/url",
       ""},
      {webhook({{"ca_file", "none.pem"}}), Errc::parse, "/webhook/ca_file", ""},
      {webhook({{"token_file", "open"}}), Errc::wrong_state, "open", "chmod 600"},
      {webhook({{"token_file", "two"}}), Errc::parse, "two", ""},
      {webhook({{"token_file", "none"}}), Errc::not_found, "none", ""},
      {{{"mqtt", {{"host", "b"}, {"topic", "a/#"}}}}, Errc::parse, "/mqtt/topic", ""},
      {{{"mqtt", {{"host", "b"}, {"password", "x"}}}}, Errc::parse, "/mqtt/password", ""},
      {{{"mqtt", {{"host", "b"}, {"password_file", "token"}}}}, Errc::parse, "/mqtt", ""},
      {{{"mqtt", {{"host", "b"}, {"port", 0}}}}, Errc::parse, "/mqtt/port", ""},
  };
  for (const Row& row : rows) {
    CAPTURE(row.document.dump());
    const auto settings = files.load(row.document);
    REQUIRE_FALSE(settings);
    CHECK(settings.error().code == row.code);
    CHECK(settings.error().where.find(row.where) != std::string::npos);
    CHECK(settings.error().hint.find(row.hint) != std::string::npos);
    CHECK(to_string(settings.error()).find("tk_1") == std::string::npos);
  }
  CHECK(files.load(webhook({{"token_file", "group"}})));
}

constexpr Clock second = std::chrono::seconds(1);

TEST_CASE("an outbox keeps the newest events and waits longer after each failure", "[notify]") {
  Outbox outbox;
  for (std::size_t i = 0; i < Outbox::most_waiting + 2; ++i) outbox.put(Event{}, second);
  CHECK(outbox.counts().waiting == Outbox::most_waiting);
  CHECK(outbox.counts().lost == 2);
  CHECK(outbox.front({}, {})->number == 3);
  std::vector<std::int64_t> waits_ms;
  for (int i = 0; i < 9; ++i) waits_ms.push_back(outbox.on_failed("HTTP 500", second).count());
  CHECK(waits_ms ==
        std::vector<std::int64_t>{500, 1000, 2000, 4000, 8000, 16000, 32000, 60000, 60000});
  outbox.on_sent(3);
  CHECK(outbox.front({}, {})->number == 4);
  CHECK(outbox.on_failed("HTTP 500", second).count() == 500);
  const Clock late = second * 3602;
  outbox.on_failed("HTTP 500", late);
  CHECK(outbox.counts().waiting == 0);  // it gives up after an hour
  CHECK(outbox.counts().lost == Outbox::most_waiting + 1);
}

TEST_CASE("failures are reported once per window", "[notify]") {
  Outbox outbox;
  outbox.put(Event{}, second);
  outbox.on_failed("no route", second);
  outbox.on_failed("no route", second);
  CHECK_FALSE(outbox.take_report(second));  // the failure may be temporary
  outbox.on_failed("no route", second);
  const auto first = outbox.take_report(second);
  REQUIRE(first);
  CHECK(first->failed_attempts == 3);
  CHECK(first->waiting == 1);
  CHECK(first->error == "no route");
  outbox.on_refused(1, "HTTP 404");
  CHECK_FALSE(outbox.take_report(second * 599));
  const auto later = outbox.take_report(second * 601);
  REQUIRE(later);
  CHECK(later->lost == 1);
  CHECK(later->failed_attempts == 0);
  CHECK_FALSE(outbox.take_report(second * 5000));
}

}  // namespace weft::daemon::test::notifications
