#include "drivers/vibro/vibro_driver.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <memory>

#include "drivers/api/plugin_convert.hpp"
#include "protocols/vibro/vibro.hpp"
#include "tests/unit/allocations.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace vibro_test {

using namespace weft;
using namespace weft::testing;
namespace vibro = protocols::vibro;

namespace {

constexpr double block_s = 0.02;

vibro::Description usual() {
  return {.serial = 17,
          .firmware = {1, 2, 3},
          .acceleration = {200'000, 20'000'000, 2000, 4},
          .sound = {8'000'000, 2'000'000, 32768, 160}};
}

Bytes bytes_of(const vibro::Frame& frame) {
  Bytes out;
  append(out, frame);
  return out;
}

/// Block `number` of a sensor that started at time zero, with noise of one count.
vibro::Frame block(vibro::Kind kind, unsigned number) {
  vibro::Frame frame;
  frame.kind = kind;
  frame.sequence = static_cast<std::uint16_t>(number);
  frame.device_us = number * 20'000U;
  frame.value_count = kind == vibro::Kind::sound ? 160 : 12;
  for (std::size_t i = 0; i < frame.value_count; ++i)
    frame.values[i] = static_cast<std::int16_t>(100 * (i % 3) + (number + i) % 2);
  return frame;
}

struct Bench : DriverBench {
  explicit Bench(const std::string& config = "{}") : DriverBench(drivers::vibro_entry, config) {}
  using DriverBench::receive;
  void receive(const vibro::Frame& frame) { receive(bytes_of(frame)); }
  void describe(const vibro::Description& description) {
    vibro::Frame frame;
    frame.description = description;
    receive(frame);
  }
  void both(unsigned number) {
    receive(block(vibro::Kind::acceleration, number));
    receive(block(vibro::Kind::sound, number));
  }
  void arm() {
    REQUIRE(driver->open());
    describe(usual());
    REQUIRE(driver->arm());
    both(10);
    REQUIRE(driver->state() == DriverState::armed);
    next = 11;
    host.samples.clear();
  }
  /// Blocks of both channels at their times.
  void stream(unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      host.loop_.run_for(block_s);
      both(next++);
    }
  }
  std::string fault_message() const { return host.faults.empty() ? "" : fault().what; }

  unsigned next = 0;
};

/// The fault on opening a sensor with this description.
Error refused(const vibro::Description& description, const std::string& config = "{}") {
  Bench bench(config);
  REQUIRE(bench.driver->open());
  bench.describe(description);
  return bench.fault();
}

}  // namespace

TEST_CASE("the sensor opens on its description and arms when both channels have been seen") {
  Bench bench;
  REQUIRE(bench.driver->open());
  bench.both(3);
  CHECK(bench.driver->state() == DriverState::closed);
  bench.describe(usual());
  CHECK(bench.driver->state() == DriverState::open);
  REQUIRE(bench.host.identities.size() == 1);
  CHECK(to_json(bench.host.identities[0]) ==
        R"({"reported":{"acceleration_block_readings":"4","acceleration_rate_hz":"200.000000",)"
        R"("firmware":"1.2.3","serial":"17","sound_block_readings":"160",)"
        R"("sound_rate_hz":"8000.000000"},"scale":{"mps2_per_count":0.01,)"
        R"("pa_per_count":6.103515625e-05}})");
  REQUIRE(bench.driver->arm());
  CHECK(bench.driver->arm().error().code == Errc::wrong_state);
  bench.receive(block(vibro::Kind::sound, 4));
  CHECK(bench.driver->state() == DriverState::open);
  CHECK(bench.host.samples.empty());
  bench.receive(block(vibro::Kind::acceleration, 4));
  CHECK(bench.host.states == std::vector{DriverState::open, DriverState::armed});
  CHECK(bench.host.samples.size() == 1);
  CHECK(bench.driver->command(BiasCommand{}).error().code == Errc::unsupported);
  bench.driver->stop();
  CHECK(bench.driver->state() == DriverState::open);
}

TEST_CASE("blocks become SI by the range in the description, and carry their time and rate") {
  Bench bench;
  bench.arm();
  bench.host.record = false;
  struct Reader final : DriverHost {
    explicit Reader(FakeHost& under) : fake(under) {}
    Loop& loop() override { return fake.loop_; }
    Link& link() override { return fake.link_; }
    void publish(const Sample& sample) override {
      if (const auto* a = std::get_if<AccelerationSample>(&sample.value)) {
        acceleration.assign(a->acceleration_mps2.begin(), a->acceleration_mps2.end());
        meta = *a;
      } else {
        const auto& s = std::get<SoundSample>(sample.value);
        sound.assign(s.pressure_pa.begin(), s.pressure_pa.end());
        clipped = s.clipped;
      }
      sequence = sample.sequence;
      arrival = sample.host;
    }
    void identified(const DeviceIdentity&) override {}
    void state_changed(DriverState) override {}
    void fault(const Error&) override {}
    void log(LogLevel, std::string_view) override {}
    FakeHost& fake;
    std::vector<double> acceleration, sound;
    AccelerationSample meta;
    std::uint32_t clipped = 0, sequence = 0;
    TimePoint arrival;
  };
  FakeHost far;
  Reader reader(far);
  auto driver = drivers::vibro_entry.create("{}", reader).value();
  REQUIRE(driver->open());
  vibro::Frame reported;
  reported.description = usual();
  far.link_.deliver(bytes_of(reported), far.loop_.now());
  REQUIRE(driver->arm());
  far.link_.deliver(bytes_of(block(vibro::Kind::sound, 6)), far.loop_.now());
  vibro::Frame shaken = block(vibro::Kind::acceleration, 7);
  std::copy_n(
      std::array<std::int16_t, 12>{1, -2, 981, 0, 5, 980, 2000, -2000, 0, 2047, 1, 2}.begin(), 12,
      shaken.values.begin());
  far.loop_.run_for(0.14);
  far.link_.deliver(bytes_of(shaken), far.loop_.now());
  REQUIRE(reader.acceleration.size() == 12);
  CHECK(reader.acceleration[0] == 0.01);
  CHECK(reader.acceleration[1] == -0.02);
  CHECK(reader.acceleration[2] == 9.81);
  CHECK(reader.meta.rate_hz == 200);
  CHECK(reader.meta.device_us == 140'000);
  CHECK(reader.meta.clipped == 3);
  CHECK(reader.sequence == 7);
  CHECK(reader.arrival == far.loop_.now());
  vibro::Frame loud = block(vibro::Kind::sound, 7);
  loud.values[0] = std::numeric_limits<std::int16_t>::min();
  loud.values[1] = std::numeric_limits<std::int16_t>::max();
  far.link_.deliver(bytes_of(loud), far.loop_.now());
  CHECK(reader.sound[0] == -2.0);
  CHECK(reader.sound[1] == 32767 * 2.0 / 32768);
  CHECK(reader.clipped == 2);
}

TEST_CASE("losses are counted in each channel by itself, and late blocks are dropped") {
  Bench bench;
  bench.arm();
  bench.receive(block(vibro::Kind::sound, 14));
  bench.receive(block(vibro::Kind::acceleration, 11));
  REQUIRE(bench.host.samples.size() == 2);
  CHECK(bench.host.samples[0].lost == 3);
  CHECK(bench.host.samples[1].lost == 0);
  bench.receive(block(vibro::Kind::sound, 13));
  bench.receive(block(vibro::Kind::sound, 14));
  CHECK(bench.host.samples.size() == 2);
  CHECK(bench.host.logs.size() == 1);
  bench.receive(block(vibro::Kind::sound, 15));
  REQUIRE(bench.host.samples.size() == 3);
  CHECK(bench.host.samples[2].lost == 0);
}

TEST_CASE("a damaged frame is a lost one and is reported") {
  Bench bench;
  bench.arm();
  Bytes bytes = bytes_of(block(vibro::Kind::sound, 11));
  bytes[100] ^= 4;
  bench.host.link_.deliver(bytes, bench.host.loop_.now());
  bench.receive(block(vibro::Kind::sound, 12));
  REQUIRE(bench.host.samples.size() == 1);
  CHECK(bench.host.samples[0].lost == 1);
  REQUIRE(bench.host.logs.size() == 1);
  CHECK(bench.host.logs[0].find("damaged") != std::string::npos);
  CHECK(bench.host.logs[0].ends_with(" 1"));
}

TEST_CASE("a sensor that restarts is followed, whatever its numbers were") {
  for (const unsigned numbers_before : {200U, 40000U}) {
    Bench bench;
    bench.arm();
    bench.next = numbers_before / 2;  // a step ahead is less than half of the counter's range
    bench.stream(1);
    bench.next = numbers_before;
    bench.stream(3);
    const std::size_t before = bench.host.samples.size();
    bench.next = 0;
    bench.stream(5);
    INFO(numbers_before);
    CHECK(bench.host.samples.size() == before + 10);
    CHECK(bench.host.samples.back().lost == 0);
    CHECK(std::ranges::count_if(bench.host.logs, [](const std::string& line) {
            return line.find("restarted") != std::string::npos;
          }) == 2);
  }
}

TEST_CASE("a sensor that differs from the configuration is refused on opening, with its values") {
  const Error serial = refused(usual(), R"({"serial": 18})");
  CHECK(serial.code == Errc::device_identity);
  CHECK(serial.where == "/serial");
  CHECK(serial.expected == "18");
  const Error rate = refused(usual(), R"({"sound_rate_hz": 16000})");
  CHECK(rate.where == "/sound_rate_hz");
  CHECK(rate.got == "8000.000000 Hz");
  vibro::Description deaf = usual();
  deaf.sound = {};
  CHECK(refused(deaf).code == Errc::device_settings);
  CHECK(refused(deaf).where == "/sound_rate_hz");
  CHECK(refused(deaf).got.empty());
  for (auto damage : std::initializer_list<void (*)(vibro::ChannelDescription&)>{
           [](auto& c) { c.range_micro = 0; }, [](auto& c) { c.full_scale_counts = 0; },
           [](auto& c) { c.block_readings = 0; }, [](auto& c) { c.block_readings = 513; }}) {
    vibro::Description odd = usual();
    damage(odd.acceleration);
    const Error error = refused(odd);
    CHECK(error.code == Errc::device_data);
    CHECK(error.what.find("acceleration") != std::string::npos);
    CHECK(error.got.find("full scale") != std::string::npos);
  }
}

TEST_CASE("a channel that is left out is not waited for, not published and not judged") {
  Bench bench(R"({"sound_rate_hz": 0})");
  REQUIRE(bench.driver->open());
  vibro::Description deaf = usual();
  deaf.sound = {};
  bench.describe(deaf);
  REQUIRE(bench.driver->arm());
  bench.both(1);
  CHECK(bench.driver->state() == DriverState::armed);
  CHECK(bench.host.samples.size() == 1);
}

TEST_CASE("silence is a fault: of the description, of all, and of one channel beside the other") {
  Bench mute;
  REQUIRE(mute.driver->open());
  mute.host.loop_.run_for(3.1);
  CHECK(mute.fault().code == Errc::timeout);
  CHECK(mute.fault().what.find("description") != std::string::npos);
  Bench bench;
  bench.arm();
  for (unsigned i = 11; i < 40; ++i) {
    bench.host.loop_.run_for(block_s);
    bench.receive(block(vibro::Kind::acceleration, i));
  }
  CHECK(bench.fault().code == Errc::timeout);
  CHECK(bench.fault().what.find("sound") != std::string::npos);
  CHECK(bench.host.loop_.timers() == 0);
}

TEST_CASE("frozen, saturated, slow and badly clocked channels are named") {
  struct Case {
    void (*harm)(vibro::Frame&);
    unsigned every;  ///< one block of this number arrives
    const char* name;
    const char* got;
  };
  const Case cases[] = {
      {[](vibro::Frame& f) {
         if (f.kind == vibro::Kind::acceleration)
           for (std::size_t i = 1; i < f.value_count; i += 3) f.values[i] = 7;
       },
       1, "y axis", "always 7 counts"},
      {[](vibro::Frame& f) {
         if (f.kind == vibro::Kind::sound)
           for (std::size_t i = 0; i < f.value_count; ++i) f.values[i] = 32767;
       },
       1, "microphone", "always 32767 counts"},
      {[](vibro::Frame& f) { f.sequence = static_cast<std::uint16_t>(f.sequence / 2); }, 2, "rate",
       "blocks/s"},
      {[](vibro::Frame& f) { f.device_us /= 2; }, 1, "clock", " s by"},
  };
  for (const Case& c : cases) {
    Bench bench;
    bench.arm();
    for (unsigned i = 0; i < 300 && bench.host.faults.empty(); ++i) {
      bench.host.loop_.run_for(block_s);
      for (const auto kind : {vibro::Kind::acceleration, vibro::Kind::sound}) {
        vibro::Frame frame = block(kind, 100 + i);
        c.harm(frame);
        if (i % c.every == 0) bench.receive(frame);
      }
    }
    INFO(c.name);
    CHECK(bench.fault_message().find(c.name) != std::string::npos);
    CHECK(bench.fault().got.find(c.got) != std::string::npos);
  }
  Bench well;
  well.arm();
  well.stream(500);
  CHECK(well.fault_message().empty());
}

TEST_CASE("a block of another length and a description that changes are faults") {
  Bench bench;
  bench.arm();
  vibro::Frame cut = block(vibro::Kind::sound, 11);
  cut.value_count = 80;
  bench.receive(cut);
  CHECK(bench.fault().code == Errc::device_data);
  CHECK(bench.fault().got == "80");
  Bench other;
  other.arm();
  other.describe(usual());
  CHECK(other.fault_message().empty());
  vibro::Description changed = usual();
  changed.acceleration.range_micro *= 2;
  other.describe(changed);
  CHECK(other.fault().code == Errc::device_restarted);
}

TEST_CASE("streaming vibration allocates nothing") {
  Bench bench;
  bench.arm();
  bench.host.record = false;
  std::vector<Bytes> frames;
  for (unsigned i = 11; i < 511; ++i) frames.push_back(bytes_of(block(vibro::Kind::sound, i)));
  bench.host.link_.deliver(frames[0], bench.host.loop_.now());
  const std::size_t before = allocations();
  for (std::size_t i = 1; i < frames.size(); ++i)
    bench.host.link_.deliver(frames[i], bench.host.loop_.now());
  CHECK(allocations() - before == 0);
}

TEST_CASE("blocks cross the C ABI unchanged, and broken ones are refused") {
  const std::array<double, 6> values{1, -2, 3.5, 4, 5, 6};
  const Sample acceleration{TimePoint(Duration(5)), 6, 7, AccelerationSample{values, 200, 8, 9}};
  const Sample sound{TimePoint(Duration(5)), 6, 7, SoundSample{values, 8000, 8, 9}};
  plugin::with_c_sample(acceleration, [&](const weft_sample_v1& c) {
    const Sample back = plugin::sample_of(c).value();
    const auto& block = std::get<AccelerationSample>(back.value);
    CHECK(back.sequence == 6);
    CHECK(back.lost == 7);
    CHECK(block.acceleration_mps2.data() == values.data());
    CHECK(block.acceleration_mps2.size() == 6);
    CHECK(block.rate_hz == 200);
    CHECK(block.device_us == 8);
    CHECK(block.clipped == 9);
  });
  plugin::with_c_sample(sound, [&](const weft_sample_v1& c) {
    CHECK(c.kind == WEFT_SOUND_SAMPLE);
    CHECK(std::get<SoundSample>(plugin::sample_of(c).value().value).pressure_pa.size() == 6);
  });
  const weft_block_sample_v1 good{sizeof(good), 6, values.data(), 200, 8, 9};
  const auto refused_as = [&](const weft_block_sample_v1& block, std::uint32_t kind) {
    const auto made = plugin::sample_of({sizeof(weft_sample_v1), kind, &block, 0, 0, 0});
    return made ? std::string() : made.error().what;
  };
  CHECK(refused_as(good, WEFT_ACCELERATION_SAMPLE).empty());
  weft_block_sample_v1 bad = good;
  bad.value_count = 5;
  CHECK(refused_as(bad, WEFT_ACCELERATION_SAMPLE).find("number") != std::string::npos);
  CHECK(refused_as(bad, WEFT_SOUND_SAMPLE).empty());
  bad = good;
  bad.values = nullptr;
  CHECK(refused_as(bad, WEFT_SOUND_SAMPLE).find("number") != std::string::npos);
  bad = good;
  bad.rate_hz = std::numeric_limits<double>::quiet_NaN();
  CHECK(refused_as(bad, WEFT_SOUND_SAMPLE).find("rate") != std::string::npos);
  bad = good;
  bad.struct_size = 8;
  CHECK(refused_as(bad, WEFT_SOUND_SAMPLE).find("size") != std::string::npos);
}

}  // namespace vibro_test
