#include "sim/rig/device_config.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "sim/plant/field_reader.hpp"

namespace weft::sim {

namespace {

/// What the rig file says of one channel.
struct ChannelKeys {
  const char* rate_key;
  const char* block_key;
  double rate_hz, block_readings;
  std::size_t axes;
};

/// Sets `converter` to the rate: its low-pass stays in proportion to it.
Result<VibroChannelParams> sample(const ChannelKeys& keys, std::int64_t step_ns,
                                  ConverterParams& converter, const std::string& where) {
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / keys.rate_hz));
  if (period_ns % step_ns != 0)
    return fail({.code = Errc::range,
                 .where = where + "/" + keys.rate_key,
                 .what = "the plant does not sample at this rate",
                 .expected = std::to_string(1'000'000'000 / step_ns) + " divided by a whole number",
                 .got = std::to_string(keys.rate_hz)});
  const double values = keys.block_readings * static_cast<double>(keys.axes);
  if (values > static_cast<double>(protocols::vibro::max_values))
    return fail({.code = Errc::range,
                 .where = where + "/" + keys.block_key,
                 .what = "a block of so many readings does not fit a frame",
                 .expected = "at most " + std::to_string(protocols::vibro::max_values / keys.axes),
                 .got = std::to_string(keys.block_readings)});
  converter.bandwidth_hz *=
      static_cast<double>(converter.period_ns) / static_cast<double>(period_ns);
  converter.period_ns = period_ns;
  return VibroChannelParams{period_ns, converter.range, converter.quantum,
                            static_cast<std::uint16_t>(keys.block_readings)};
}

Status sample_all(const ChannelKeys& acceleration, const ChannelKeys& sound,
                  const std::string& where, VibrationParams& plant, VibroEmulatorParams& params) {
  if (acceleration.rate_hz == 0)
    plant.accelerometer.reset();
  else if (auto made = sample(acceleration, plant.step_ns, plant.accelerometer->converter, where))
    params.acceleration = *made;
  else
    return pass(made.error());
  if (sound.rate_hz == 0)
    plant.microphone.reset();
  else if (auto made = sample(sound, plant.step_ns, plant.microphone->converter, where))
    params.sound = *made;
  else
    return pass(made.error());
  return {};
}

}  // namespace

Result<VibroEmulatorParams> read_vibro(const nlohmann::json& emulator, const std::string& where,
                                       VibrationParams& plant) {
  VibroEmulatorParams params;
  plant = {};
  ChannelKeys acceleration{"acceleration_rate_hz", "acceleration_block", 200, 4,
                           protocols::vibro::axes};
  ChannelKeys sound{"sound_rate_hz", "sound_block", 8000, 160, 1};
  std::string kind, form = "stream";
  double serial = params.serial, chunk = 0;
  FieldReader reader(emulator, where);
  reader.text("kind", kind).text("form", form).number("serial", serial, 0, 4294967295.0);
  for (ChannelKeys* keys : {&acceleration, &sound}) {
    reader.number(keys->rate_key, keys->rate_hz, 0, 16000);
    reader.number(keys->block_key, keys->block_readings, 1, protocols::vibro::max_values);
  }
  reader.number("largest_chunk_bytes", chunk, 0, 4096);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (form != "stream" && form != "datagram")
    return fail({.code = Errc::parse,
                 .where = where + "/form",
                 .what = "no such form",
                 .expected = "stream or datagram",
                 .got = form});
  for (ChannelKeys* keys : {&acceleration, &sound})
    if (keys->rate_hz != 0 && keys->rate_hz < 1)
      return fail({.code = Errc::range,
                   .where = where + "/" + keys->rate_key,
                   .what = "too slow for a vibration",
                   .expected = "0 or 1 to 16000",
                   .got = std::to_string(keys->rate_hz)});
  if (acceleration.rate_hz == 0 && sound.rate_hz == 0)
    return fail({.code = Errc::range,
                 .where = where + "/sound_rate_hz",
                 .what = "a vibration sensor without a channel",
                 .expected = "a rate above 0 for one of them",
                 .got = "0 for both"});
  params.datagrams = form == "datagram";
  params.serial = static_cast<std::uint32_t>(serial);
  params.largest_chunk_bytes = static_cast<std::size_t>(chunk);
  if (Status s = sample_all(acceleration, sound, where, plant, params); !s) return pass(s.error());
  return params;
}

}  // namespace weft::sim
