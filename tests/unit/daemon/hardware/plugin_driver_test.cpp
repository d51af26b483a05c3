// A driver behind the C table: it equals the built-in one, and its faults are contained.

#include "daemon/hardware/plugins/plugin_driver.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <condition_variable>
#include <mutex>
#include <stdexcept>

#include "drivers/api/plugin.hpp"
#include "drivers/taxel_array/taxel_driver.hpp"
#include "drivers/thorlabs_apt/stage_driver.hpp"
#include "protocols/taxel/taxel.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace plugin_driver_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::testing;

namespace {

using namespace std::chrono_literals;

// In these tests nothing is late except calls that wait for the watch.
constexpr PluginWatch::Limits patient{60s, 120s};

struct Loaded {
  FakeHost host;
  PluginWatch watch{patient, [](const PluginCall&) {}};
  std::unique_ptr<Driver> driver;

  Loaded(const weft_driver_entry_v1& table, const std::string& config)
      : driver(std::move(
            PluginDriver::create({nullptr, &table, "test.so"}, "taxels", config, host, watch)
                .value())) {}
};

template <const DriverEntry& entry>
const weft_driver_entry_v1& table() {
  static const weft_driver_entry_v1 made = plugin::table_of<entry>();
  return made;
}

Bytes frame(std::uint8_t sequence) {
  protocols::taxel::Frame f;
  f.sequence = sequence;
  f.taxel_count = 2;
  f.counts[0] = 1000;
  f.counts[1] = sequence;
  f.device_us = 27000u * sequence;
  Bytes bytes;
  protocols::taxel::append(bytes, f);
  return bytes;
}

/// A sequence with good, lost and damaged frames, silence at its end, and a second opening.
void converse(Driver& driver, FakeHost& host, TestLoop& loop) {
  REQUIRE(driver.open());
  for (const std::uint8_t sequence : std::initializer_list<std::uint8_t>{1, 2, 3, 7, 8}) {
    Bytes bytes = frame(sequence);
    if (sequence == 3) bytes[5] = static_cast<std::uint8_t>(~bytes[5]);
    loop.run_for(0.027);
    host.link_.deliver(bytes, loop.now());
    if (sequence == 1) REQUIRE(driver.arm());
  }
  CHECK_FALSE(driver.command(HomeCommand{}));
  CHECK_FALSE(driver.arm());
  loop.run_for(2);
  driver.close();
  REQUIRE(driver.open());
  host.link_.break_off();
  driver.stop();
  driver.close();
}

}  // namespace

TEST_CASE("a driver behind the C table behaves exactly like the same driver built in") {
  const std::string config = R"({"taxels": 2})";
  FakeHost direct;
  const auto built_in = drivers::taxel_array_entry.create(config, direct).value();
  converse(*built_in, direct, direct.loop_);
  Loaded loaded(table<drivers::taxel_array_entry>(), config);
  converse(*loaded.driver, loaded.host, loaded.host.loop_);

  CHECK(loaded.host.states == direct.states);
  CHECK(loaded.host.logs == direct.logs);
  CHECK(loaded.host.taxel_counts == direct.taxel_counts);
  REQUIRE(direct.faults.size() == 2);
  REQUIRE(loaded.host.faults.size() == 2);
  for (std::size_t i = 0; i < 2; ++i)
    CHECK(to_string(loaded.host.faults[i]) == to_string(direct.faults[i]));
  REQUIRE(loaded.host.identities.size() == direct.identities.size());
  CHECK(to_json(loaded.host.identities.front()) == to_json(direct.identities.front()));
  REQUIRE(direct.samples.size() == 3);
  REQUIRE(loaded.host.samples.size() == 3);
  for (std::size_t i = 0; i < direct.samples.size(); ++i) {
    CHECK(loaded.host.samples[i].host == direct.samples[i].host);
    CHECK(loaded.host.samples[i].sequence == direct.samples[i].sequence);
    CHECK(loaded.host.samples[i].lost == direct.samples[i].lost);
  }
}

TEST_CASE("a stage behind the C table writes the bytes and keeps the timers of the built-in one") {
  FakeHost direct;
  const auto built_in = drivers::thorlabs_apt_entry.create("{}", direct).value();
  Loaded loaded(table<drivers::thorlabs_apt_entry>(), "{}");
  REQUIRE(built_in->open());
  REQUIRE(loaded.driver->open());
  const Bytes requested = direct.link_.take_written();
  CHECK_FALSE(requested.empty());
  CHECK(loaded.host.link_.take_written() == requested);
  CHECK(loaded.host.loop_.timers() == direct.loop_.timers());
  loaded.driver->close();
  CHECK(loaded.host.loop_.timers() == 0);
  CHECK_FALSE(loaded.host.link_.listened_to());
}

namespace {

/// Sends to its HTTP port the bytes received on its link, and vice versa.
class Crossing final : public Driver {
 public:
  explicit Crossing(DriverHost& host) : host_(&host) {}
  [[nodiscard]] DriverState state() const noexcept override { return DriverState::closed; }
  Status open() override {
    if (host_->http() == nullptr)
      return fail({.code = Errc::unsupported, .what = "there is no HTTP port"});
    host_->link().on_receive(
        [this](ByteView bytes, TimePoint) { static_cast<void>(host_->http()->write(bytes)); });
    host_->http()->on_receive(
        [this](ByteView bytes, TimePoint) { static_cast<void>(host_->link().write(bytes)); });
    return {};
  }
  Status arm() override { return {}; }
  Result<std::uint32_t> command(const Command&) override { return 0; }
  void stop() override {}
  void close() override {}

 private:
  DriverHost* host_;
};

constinit const DriverEntry crossing{
    "crossing", "Passes bytes on", "{}",
    [](std::string_view, DriverHost& host) -> Result<std::unique_ptr<Driver>> {
      return std::make_unique<Crossing>(host);
    }};

/// A host with an HTTP port for its device.
class HostWithHttp final : public DriverHost {
 public:
  Loop& loop() override { return inner.loop(); }
  Link& link() override { return inner.link(); }
  Link* http() override { return &http_; }
  void publish(const Sample& sample) override { inner.publish(sample); }
  void identified(const DeviceIdentity& identity) override { inner.identified(identity); }
  void state_changed(DriverState state) override { inner.state_changed(state); }
  void fault(const Error& error) override { inner.fault(error); }
  void log(LogLevel level, std::string_view text) override { inner.log(level, text); }

  FakeHost inner;
  FakeLink http_;
};

}  // namespace

TEST_CASE("a plugin has the device's HTTP port where there is one, and its bytes stay apart") {
  HostWithHttp host;
  PluginWatch watch(patient, [](const PluginCall&) {});
  auto driver = std::move(
      PluginDriver::create({nullptr, &table<crossing>(), "test.so"}, "ft", "{}", host, watch)
          .value());
  REQUIRE(driver->open());
  host.http_.deliver(Bytes{1, 2}, TimePoint{});
  host.inner.link_.deliver(Bytes{3}, TimePoint{});
  CHECK(host.inner.link_.take_written() == Bytes{1, 2});
  CHECK(host.http_.take_written() == Bytes{3});
  driver.reset();
  CHECK_FALSE(host.http_.listened_to());
  CHECK_FALSE(host.inner.link_.listened_to());

  Loaded without(table<crossing>(), "{}");
  CHECK(without.driver->open().error().what == "there is no HTTP port");
}

TEST_CASE("what a driver refuses comes through the C table with all its parts") {
  FakeHost direct;
  const Error wanted = drivers::taxel_array_entry.create(R"({"taxells": 2})", direct).error();
  FakeHost host;
  PluginWatch watch(patient, [](const PluginCall&) {});
  const auto refused =
      PluginDriver::create({nullptr, &table<drivers::taxel_array_entry>(), "test.so"}, "taxels",
                           R"({"taxells": 2})", host, watch);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == wanted.code);
  CHECK(to_string(refused.error()) == to_string(wanted));
}

namespace {

/// A hand-written table with functions that throw across the C border, which is forbidden.
struct Rogue {
  static inline const char* throws_in = "";
  static inline int stops = 0;
  static inline const weft_host_v1* host = nullptr;

  static void inspect(const char* function) {
    if (std::string(function) == throws_in) throw std::runtime_error("out of paper");
  }
  static weft_device* create(const char*, const weft_host_v1* given) {
    inspect("create");
    host = given;
    static int device = 0;
    return reinterpret_cast<weft_device*>(&device);
  }
  static void destroy(weft_device*) { inspect("destroy"); }
  static std::int32_t open(weft_device*) {
    inspect("open");
    host->link->on_receive(
        host->link->self,
        [](void*, const std::uint8_t*, std::size_t, std::int64_t) { inspect("received"); },
        nullptr);
    host->timer_at(
        host->self, 1000, [](void*) { inspect("timer"); }, nullptr);
    host->state_changed(host->self, WEFT_OPEN);
    return 0;
  }
  static std::int32_t arm(weft_device*) {
    inspect("arm");
    return 0;
  }
  static std::int32_t command(weft_device*, const weft_command_v1*, std::uint32_t*) {
    inspect("command");
    return 0;
  }
  static void stop(weft_device*) {
    ++stops;
    inspect("stop");
  }
  static void close(weft_device*) { inspect("close"); }

  static weft_driver_entry_v1 table() {
    return {WEFT_DRIVER_ABI_VERSION,
            sizeof(weft_driver_entry_v1),
            WEFT_DRIVER_FINGERPRINT,
            "rogue",
            "Throws",
            "{}",
            create,
            destroy,
            open,
            arm,
            command,
            stop,
            close};
  }
};

}  // namespace

TEST_CASE("an exception of a plugin becomes a fault of its device, which gets no further call") {
  const weft_driver_entry_v1 table = Rogue::table();
  for (const char* function : {"open", "received", "timer", "arm", "command", "close"}) {
    CAPTURE(function);
    Rogue::throws_in = function;
    Rogue::stops = 0;
    Loaded rogue(table, "{}");
    static_cast<void>(rogue.driver->open());
    static_cast<void>(rogue.driver->arm());
    static_cast<void>(rogue.driver->command(PollCommand{}));
    rogue.host.link_.deliver(Bytes{1}, TimePoint{});
    rogue.host.loop_.run_for(1);
    rogue.driver->close();
    REQUIRE(rogue.host.faults.size() == 1);
    const Error& fault = rogue.host.faults.front();
    CHECK(fault.what.find("test.so") != std::string::npos);
    CHECK(fault.got == "out of paper");
    CHECK(to_string(fault).find(function) != std::string::npos);
    CHECK(rogue.driver->state() == DriverState::faulted);
    CHECK(Rogue::stops == 1);
    CHECK_FALSE(rogue.driver->open());
    CHECK_FALSE(rogue.driver->command(PollCommand{}));
    CHECK(rogue.host.loop_.timers() == 0);
    CHECK_FALSE(rogue.host.link_.listened_to());
  }
}

TEST_CASE("a plugin that throws in create is refused, and one that throws in destroy is gone") {
  const weft_driver_entry_v1 table = Rogue::table();
  Rogue::throws_in = "create";
  FakeHost host;
  PluginWatch watch(patient, [](const PluginCall&) {});
  const auto refused =
      PluginDriver::create({nullptr, &table, "test.so"}, "taxels", "{}", host, watch);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().got == "out of paper");
  CHECK(refused.error().what.find("create") != std::string::npos);

  Rogue::throws_in = "destroy";
  Loaded rogue(table, "{}");
  rogue.driver.reset();
  CHECK(rogue.host.faults.empty());
}

namespace {

/// Blocked in a call until the watch has noticed that it does not return.
struct Stuck {
  static inline std::mutex mutex;
  static inline std::condition_variable noticed;
  static inline bool seen = false;
  static inline std::string reported;

  static std::int32_t open(weft_device*) {
    std::unique_lock lock(mutex);
    noticed.wait(lock, [] { return seen; });
    return 0;
  }
  static void hung(const PluginCall& call) {
    const std::lock_guard lock(mutex);
    reported = std::string(call.device) + " " + call.file + " " + call.function;
    seen = true;
    noticed.notify_all();
  }
};

}  // namespace

TEST_CASE("a plugin that does not come back is noticed by the watch, and faulted if it does") {
  Rogue::throws_in = "";
  weft_driver_entry_v1 table = Rogue::table();
  table.open = &Stuck::open;
  FakeHost host;
  PluginWatch watch({2ms, 6ms}, &Stuck::hung);
  const auto driver =
      PluginDriver::create({nullptr, &table, "stuck.so"}, "taxels", "{}", host, watch).value();
  CHECK_FALSE(driver->open());
  CHECK(Stuck::reported == "taxels stuck.so open");
  REQUIRE(host.faults.size() == 1);
  CHECK(to_string(host.faults.front()).find("in open") != std::string::npos);
  CHECK(driver->state() == DriverState::faulted);
}

TEST_CASE("time that the host spends for a plugin is not the plugin's") {
  std::atomic<bool> hung = false;
  PluginWatch watch({1ms, 2ms}, [&](const PluginCall&) { hung = true; });
  const PluginCall outer{"a", "a.so", "received"};
  const PluginCall inner{"b", "b.so", "command"};
  const PluginWatch::Turn of_a(watch, &outer);
  const PluginWatch::Turn of_host(watch, nullptr);
  const PluginWatch::Turn of_b(watch, &inner);
  while (!of_b.late()) std::this_thread::yield();
  CHECK_FALSE(of_a.late());
  CHECK_FALSE(of_host.late());
}

TEST_CASE("a sample that is broken, or of a kind from the future, faults the plugin") {
  Rogue::throws_in = "";
  const weft_driver_entry_v1 table = Rogue::table();
  weft_taxel_sample_v1 taxels{sizeof(taxels), 5000, nullptr, 0, 0, 0};
  for (const std::uint32_t kind : {std::uint32_t{WEFT_TAXEL_SAMPLE}, 77u}) {
    Loaded rogue(table, "{}");
    REQUIRE(rogue.driver->open());
    const weft_sample_v1 sample{sizeof(sample), kind, &taxels, 0, 0, 0};
    Rogue::host->publish(Rogue::host->self, &sample);
    CHECK(rogue.host.samples.empty());
    REQUIRE(rogue.host.faults.size() == 1);
    CHECK(rogue.host.faults.front().what.find("test.so") != std::string::npos);
    CHECK_FALSE(rogue.driver->arm());
  }
}

}  // namespace plugin_driver_test
