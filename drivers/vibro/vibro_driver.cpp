#include "drivers/vibro/vibro_driver.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "drivers/api/config.hpp"

namespace weft::drivers {

namespace vibro = protocols::vibro;

namespace {

constexpr double rate_tolerance = 1e-3;
constexpr double micro = 1e6;

const char* noun_of(vibro::Kind kind) {
  return kind == vibro::Kind::sound ? "sound" : "acceleration";
}

const char* rate_key(vibro::Kind kind) {
  return kind == vibro::Kind::sound ? "/sound_rate_hz" : "/acceleration_rate_hz";
}

double rate_of(const vibro::ChannelDescription& channel) {
  return channel.rate_mhz / 1e3;
}

constexpr std::uint32_t least_blocks = 20;
std::string name_of(vibro::Kind kind, std::size_t axis) {
  constexpr std::array names{"x axis of the accelerometer", "y axis of the accelerometer",
                             "z axis of the accelerometer"};
  return kind == vibro::Kind::sound ? "microphone" : names[axis];
}

}  // namespace

BlockWatch::BlockWatch(Duration window, double blocks_hz, int full_scale_counts)
    : StreamWatch({.rate_hz = blocks_hz,
                   .window = window,
                   .least_frames = least_blocks,
                   .rate_what = "rate of the sensor differs from its description",
                   .rate_unit = "blocks/s",
                   .rate_hint = "Check the settings of the sensor and its line"}),
      full_scale_counts_(full_scale_counts) {}

void BlockWatch::begin(const vibro::Frame& block) {
  std::copy_n(block.values.begin(), first_values_.size(), first_values_.begin());
  changed_ = {};
}

void BlockWatch::note(const vibro::Frame& block) {
  const std::size_t axes = vibro::values_per_reading(block.kind);
  for (std::size_t i = 0; i < block.value_count; ++i)
    if (block.values[i] != first_values_[i % axes]) changed_[i % axes] = true;
}

/// Every such sensor has noise of about a count, so an axis that never changes is not measured.
std::optional<Error> BlockWatch::check_values(const vibro::Frame& block) const {
  for (std::size_t axis = 0; axis < vibro::values_per_reading(block.kind); ++axis) {
    if (changed_[axis]) continue;
    const int at = first_values_[axis];
    const bool full = std::abs(at) >= full_scale_counts_;
    return Error{
        .code = Errc::device_data,
        .what = name_of(block.kind, axis) +
                (full ? " saturated: its readings stay at the end of the range"
                      : " frozen: its readings do not change"),
        .expected = "noise",
        .got = "always " + std::to_string(at) + " counts",
        .hint = "Check the sensor and its mounting; set watch_s to 0 for a sensor without noise"};
  }
  return std::nullopt;
}

VibroDriver::Channel::Channel(VibroDriver& driver, vibro::Kind its_kind, double configured_hz)
    : kind(its_kind),
      rate_hz(configured_hz),
      silence(driver.host().loop(), [this, &driver] { driver.on_channel_silence(*this); }) {}

VibroDriver::VibroDriver(const VibroSettings& settings, DriverHost& driver_host)
    : ListeningDriver(driver_host, "a vibration sensor"),
      settings_(settings),
      acceleration_(*this, vibro::Kind::acceleration, settings.acceleration_rate_hz),
      sound_(*this, vibro::Kind::sound, settings.sound_rate_hz) {}

Status VibroDriver::open() noexcept {
  if (Status taken = attach(); !taken) return taken;
  splitter_.clear();
  description_.reset();
  for (Channel* channel : {&acceleration_, &sound_}) {
    channel->order.reset();
    channel->late_reported = false;
  }
  silence().expect_within(settings_.reply_timeout);
  return {};
}

void VibroDriver::await_frames() {
  for (Channel* channel : {&acceleration_, &sound_}) {
    channel->came = !channel->wanted();
    channel->watch.restart();
    if (channel->wanted())
      channel->silence.expect_within(std::max(settings_.stale_after, settings_.reply_timeout));
  }
}

void VibroDriver::stop_waiting() noexcept {
  acceleration_.silence.stop();
  sound_.silence.stop();
}

void VibroDriver::received(ByteView bytes, TimePoint arrival) {
  const std::uint64_t before = splitter_.damaged();
  splitter_.push(bytes);
  while (attached() && splitter_.next(frame_)) on_frame(arrival);
  count_damaged(splitter_.damaged() - before, arrival);
}

void VibroDriver::on_frame(TimePoint arrival) {
  if (frame_.kind == vibro::Kind::description) return on_description();
  Channel& channel = frame_.kind == vibro::Kind::sound ? sound_ : acceleration_;
  if (description_ && channel.wanted()) on_block(channel, arrival);
}

void VibroDriver::on_description() {
  if (description_) {
    if (*description_ == frame_.description) return;
    return raise(
        {.code = Errc::device_restarted,
         .what = "description of the sensor changed after opening",
         .expected = "serial " + std::to_string(description_->serial) + ", the same channels",
         .got = "serial " + std::to_string(frame_.description.serial),
         .hint = "Check whether the sensor was replaced or changed, then open it again"});
  }
  const vibro::Description& description_seen = frame_.description;
  if (settings_.serial != 0 && settings_.serial != description_seen.serial)
    return raise({.code = Errc::device_identity,
                  .where = "/serial",
                  .what = "serial number of the sensor differs from the configuration",
                  .expected = std::to_string(settings_.serial),
                  .got = std::to_string(description_seen.serial),
                  .hint = "Correct the rig file, or check which sensor is on this port"});
  if (auto wrong = unfit(acceleration_, description_seen.acceleration)) return raise(*wrong);
  if (auto wrong = unfit(sound_, description_seen.sound)) return raise(*wrong);
  description_ = description_seen;
  learn(acceleration_, description_seen.acceleration);
  learn(sound_, description_seen.sound);
  silence().stop();
  report_identity();
  enter(LifecycleEvent::opened);
}

/// The reason why a configured channel cannot be used with the sensor's description, if any.
std::optional<Error> VibroDriver::unfit(const Channel& channel,
                                        const vibro::ChannelDescription& description_seen) const {
  if (!channel.wanted()) return std::nullopt;
  const std::string noun = noun_of(channel.kind), key = rate_key(channel.kind);
  if (description_seen.rate_mhz == 0)
    return Error{.code = Errc::device_settings,
                 .where = key,
                 .what = "sensor without a channel for " + noun,
                 .hint = "Set this key to 0 in the rig file"};
  if (std::abs(rate_of(description_seen) - channel.rate_hz) > rate_tolerance * channel.rate_hz)
    return Error{.code = Errc::device_settings,
                 .where = key,
                 .what = "rate of " + noun + " differs from the configuration",
                 .expected = std::to_string(channel.rate_hz) + " Hz",
                 .got = std::to_string(rate_of(description_seen)) + " Hz",
                 .hint = "Correct the rig file, or the settings of the sensor"};
  const std::size_t values =
      description_seen.block_readings * vibro::values_per_reading(channel.kind);
  if (description_seen.range_micro == 0 || description_seen.full_scale_counts == 0 || values == 0 ||
      values > vibro::max_values)
    return Error{.code = Errc::device_data,
                 .what = "description of the channel for " + noun + " invalid",
                 .expected = "a range, counts at full scale, 1 to 1536 values per block",
                 .got = "range " + std::to_string(description_seen.range_micro) +
                        "e-6, full scale " + std::to_string(description_seen.full_scale_counts) +
                        ", " + std::to_string(description_seen.block_readings) +
                        " readings per block",
                 .hint = "Check the firmware of the sensor"};
  return std::nullopt;
}

void VibroDriver::learn(Channel& channel, const vibro::ChannelDescription& description_seen) {
  channel.described = description_seen;
  if (!channel.wanted()) return;
  channel.unit_per_count =
      description_seen.range_micro / micro / description_seen.full_scale_counts;
  channel.largest_count =
      std::min<int>(description_seen.full_scale_counts, std::numeric_limits<std::int16_t>::max());
  channel.watch = {settings_.watch, rate_of(description_seen) / description_seen.block_readings,
                   channel.largest_count};
}

void VibroDriver::report_identity() {
  const auto& firmware = description_->firmware;
  DeviceIdentity identity;
  identity.reported = {
      {"serial", std::to_string(description_->serial)},
      {"firmware", std::to_string(firmware[0]) + "." + std::to_string(firmware[1]) + "." +
                       std::to_string(firmware[2])}};
  for (const Channel* channel : {&acceleration_, &sound_}) {
    if (!channel->wanted()) continue;
    const std::string noun = noun_of(channel->kind);
    identity.reported.emplace_back(noun + "_rate_hz", std::to_string(rate_of(channel->described)));
    identity.reported.emplace_back(noun + "_block_readings",
                                   std::to_string(channel->described.block_readings));
    identity.scale.emplace_back(
        channel->kind == vibro::Kind::sound ? "pa_per_count" : "mps2_per_count",
        channel->unit_per_count);
  }
  host().identified(identity);
}

void VibroDriver::on_block(Channel& channel, TimePoint arrival) {
  const std::size_t expected =
      channel.described.block_readings * vibro::values_per_reading(channel.kind);
  if (frame_.value_count != expected)
    return raise({.code = Errc::device_data,
                  .what = std::string("number of values in a block of ") + noun_of(channel.kind) +
                          " differs from the description",
                  .expected = std::to_string(expected),
                  .got = std::to_string(frame_.value_count)});
  const BlockOrder::Step step = channel.order.observe(frame_);
  if (step.verdict == BlockOrder::Verdict::late) {
    if (!std::exchange(channel.late_reported, true))
      host().log(LogLevel::warning, std::string("block of ") + noun_of(channel.kind) +
                                        " received twice or late; it was dropped");
    return;
  }
  if (step.verdict == BlockOrder::Verdict::restarted) {
    channel.watch.restart();
    host().log(LogLevel::warning, std::string("the sensor restarted: its numbers of ") +
                                      noun_of(channel.kind) + " blocks jumped back");
  }
  if (!advance(channel)) return;
  if (auto wrong = channel.watch.check(frame_, step.lost, arrival)) return raise(*wrong);
  publish(channel, step.lost, arrival);
}

/// Advances the lifecycle on a good block. False while blocks must not be published.
bool VibroDriver::advance(Channel& channel) {
  if (arming()) {
    channel.came = true;
    if (acceleration_.came && sound_.came) be_armed();
  }
  if (state() != DriverState::armed) return false;
  channel.silence.expect_within(settings_.stale_after);
  return true;
}

void VibroDriver::publish(const Channel& channel, std::uint32_t lost, TimePoint arrival) {
  std::uint32_t clipped = 0;
  for (std::size_t i = 0; i < frame_.value_count; ++i) {
    const int counts = frame_.values[i];
    clipped += std::abs(counts) >= channel.largest_count ? 1 : 0;
    values_[i] = counts * channel.unit_per_count;
  }
  const std::span<const double> values = std::span(values_).first(frame_.value_count);
  const double rate_hz = rate_of(channel.described);
  Sample sample{arrival, frame_.sequence, lost,
                SoundSample{values, rate_hz, frame_.device_us, clipped}};
  if (channel.kind == vibro::Kind::acceleration)
    sample.value = AccelerationSample{values, rate_hz, frame_.device_us, clipped};
  host().publish(sample);
}

void VibroDriver::on_silence() {
  raise({.code = Errc::timeout,
         .what = "no description from the vibration sensor",
         .expected = "one each second",
         .got = "nothing received",
         .hint = "Check the port and the power of the sensor"});
}

void VibroDriver::on_channel_silence(const Channel& channel) {
  raise({.code = Errc::timeout,
         .what = std::string("no ") + noun_of(channel.kind) + " from the vibration sensor",
         .got = "nothing received",
         .hint = "Switch the sensor off and on, then repeat"});
}

constinit const DriverEntry vibro_entry{
    .name = "vibro",
    .summary = "Vibration sensor: blocks of accelerometer and microphone readings",
    .config_schema_json = vibro_config_schema,
    .create = create_driver<VibroDriver, read_vibro_settings>,
};

const char vibro_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "Vibration sensor",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "acceleration_rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 0, "maximum": 100000, "default": 200, "description": "readings per second of the accelerometer; 0: not used"},
    "sound_rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 0, "maximum": 400000, "default": 8000, "description": "readings per second of the microphone; 0: not used"},
    "serial": {"type": "integer", "minimum": 0, "maximum": 4294967295, "default": 0, "description": "required serial number of the sensor; 0: any"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 3, "description": "longest wait for the description of the sensor, sent once per second"},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.01, "maximum": 60, "default": 0.3, "description": "longest time without a block of a channel"},
    "watch_s": {"x-unit": "s", "type": "number", "minimum": 0, "maximum": 3600, "default": 2, "description": "length of the windows in which frozen and saturated values, rate and clock are checked; 0: no check"}
  }
})";

Result<VibroSettings> read_vibro_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  VibroSettings settings;
  settings.acceleration_rate_hz = config.number("acceleration_rate_hz", 200, {0, 1e5});
  settings.sound_rate_hz = config.number("sound_rate_hz", 8000, {0, 4e5});
  settings.serial = static_cast<std::uint32_t>(config.integer("serial", 0, {0, 4294967295.0}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 3, {0.01, 60}));
  settings.stale_after = from_seconds(config.number("stale_after_s", 0.3, {0.01, 60}));
  settings.watch = from_seconds(config.number("watch_s", 2, {0, 3600}));
  if (settings.acceleration_rate_hz == 0 && settings.sound_rate_hz == 0)
    config.refuse("sound_rate_hz", "no channel used", "a rate above 0 for one of them",
                  "0 for both");
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
