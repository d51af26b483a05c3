#include "drivers/api/plugin_convert.hpp"

#include <cmath>

namespace weft::plugin {
namespace {

std::string to_text(const char* text) {
  return text == nullptr ? std::string() : std::string(text);
}

/// The struct of a sample's value; nullptr if it is smaller than in this build.
template <class C>
const C* value_as(const weft_sample_v1& sample) {
  const auto* value = static_cast<const C*>(sample.value);
  return value != nullptr && value->struct_size >= sizeof(C) ? value : nullptr;
}

tl::unexpected<Error> broken_sample(const char* what) {
  return fail(
      {.code = Errc::range, .what = std::string("invalid sample from the plugin: ") + what});
}

Result<Sample> with(const weft_sample_v1& sample, SampleValue value) {
  return Sample{time_of(sample.host_ns), sample.sequence, sample.lost, value};
}

Result<Sample> stage_of(const weft_sample_v1& sample) {
  const auto* c = value_as<weft_stage_sample_v1>(sample);
  if (c == nullptr) return broken_sample("size of the stage reading");
  return with(sample,
              StageSample{c->position, c->moving != 0, c->homed != 0, c->limit != 0, c->move_id});
}

Result<Sample> wrench_of(const weft_sample_v1& sample) {
  const auto* c = value_as<weft_wrench_sample_v1>(sample);
  if (c == nullptr) return broken_sample("size of the wrench");
  WrenchSample wrench;
  for (std::size_t i = 0; i < 3; ++i) {
    wrench.force_n[i] = c->force_n[i];
    wrench.torque_nm[i] = c->torque_nm[i];
  }
  wrench.status = c->status;
  wrench.valid = c->valid != 0;
  return with(sample, wrench);
}

Result<Sample> taxels_of(const weft_sample_v1& sample) {
  const auto* c = value_as<weft_taxel_sample_v1>(sample);
  if (c == nullptr) return broken_sample("size of the taxel frame");
  if (c->taxel_count > most_taxels || (c->counts == nullptr && c->taxel_count != 0))
    return broken_sample("number of taxels");
  return with(
      sample,
      TaxelSample{
          {c->counts, c->taxel_count}, c->proximity_counts, c->ambient_counts, c->device_us});
}

Result<std::span<const double>> block_values(const weft_block_sample_v1* c, std::size_t axes) {
  if (c == nullptr) return broken_sample("size of the block");
  if (c->value_count > most_block_values || c->value_count % axes != 0 ||
      (c->values == nullptr && c->value_count != 0))
    return broken_sample("number of values");
  if (!(c->rate_hz > 0) || !std::isfinite(c->rate_hz)) return broken_sample("rate");
  return std::span(c->values, c->value_count);
}

template <class Block>
Result<Sample> block_of(const weft_sample_v1& sample, std::size_t axes) {
  const auto* c = value_as<weft_block_sample_v1>(sample);
  const auto values = block_values(c, axes);
  if (!values) return pass(values.error());
  return with(sample, Block{*values, c->rate_hz, c->device_us, c->clipped});
}

Errc code_of(std::int32_t code) {
  const bool known = code >= WEFT_INVALID_ARGUMENT && code <= WEFT_BUSY;
  return known ? static_cast<Errc>(code) : Errc::device;
}

weft_block_sample_v1 c_block(std::span<const double> values, double rate_hz,
                             std::uint32_t device_us, std::uint32_t clipped) {
  return {sizeof(weft_block_sample_v1),
          static_cast<std::uint32_t>(values.size()),
          values.data(),
          rate_hz,
          device_us,
          clipped};
}

}  // namespace

weft_error_v1 c_error(const Error& error) {
  return {sizeof(weft_error_v1),  static_cast<std::int32_t>(error.code),
          error.what.c_str(),     error.where.c_str(),
          error.expected.c_str(), error.got.c_str(),
          error.hint.c_str()};
}

Error error_of(const weft_error_v1& error) {
  return {.code = code_of(error.code),
          .where = to_text(error.where),
          .what = to_text(error.message),
          .expected = to_text(error.expected),
          .got = to_text(error.got),
          .hint = to_text(error.hint)};
}

weft_command_v1 c_command(const Command& command) {
  weft_command_v1 c{
      sizeof(weft_command_v1), static_cast<std::uint32_t>(command.index() + 1), 0, 0, 0, 0};
  if (const auto* move = std::get_if<MoveCommand>(&command)) {
    c.target = move->target;
    c.speed = move->speed;
  }
  if (const auto* servo = std::get_if<ServoCommand>(&command)) {
    c.velocity = servo->velocity;
    c.horizon_ns = servo->horizon.count();
  }
  return c;
}

Result<Command> command_of(const weft_command_v1& command) {
  switch (command.kind) {
    case WEFT_HOME:
      return Command(HomeCommand{});
    case WEFT_MOVE:
      return Command(MoveCommand{command.target, command.speed});
    case WEFT_SERVO:
      return Command(ServoCommand{command.velocity, Duration(command.horizon_ns)});
    case WEFT_POLL:
      return Command(PollCommand{});
    case WEFT_BIAS:
      return Command(BiasCommand{});
    default:
      return fail({.code = Errc::unsupported,
                   .what = "command unknown to this build of the driver",
                   .got = "kind " + std::to_string(command.kind),
                   .hint = "Build the driver again with the current headers"});
  }
}

Result<Sample> sample_of(const weft_sample_v1& sample) {
  switch (sample.kind) {
    case WEFT_STAGE_SAMPLE:
      return stage_of(sample);
    case WEFT_WRENCH_SAMPLE:
      return wrench_of(sample);
    case WEFT_TAXEL_SAMPLE:
      return taxels_of(sample);
    case WEFT_ACCELERATION_SAMPLE:
      return block_of<AccelerationSample>(sample, 3);
    case WEFT_SOUND_SAMPLE:
      return block_of<SoundSample>(sample, 1);
    default:
      return fail({.code = Errc::unsupported,
                   .what = "sample unknown to this version of Weft",
                   .got = "kind " + std::to_string(sample.kind)});
  }
}

DeviceIdentity identity_of(const weft_identity_v1& identity) {
  DeviceIdentity out;
  for (std::uint32_t i = 0; i < identity.reported_count; ++i)
    out.reported.emplace_back(to_text(identity.reported[i].key),
                              to_text(identity.reported[i].text));
  for (std::uint32_t i = 0; i < identity.scale_count; ++i)
    out.scale.emplace_back(to_text(identity.scale[i].key), identity.scale[i].value);
  return out;
}

weft_stage_sample_v1 c_value(const StageSample& stage) {
  return {sizeof(weft_stage_sample_v1),
          stage.move_id,
          stage.position,
          static_cast<std::uint8_t>(stage.moving),
          static_cast<std::uint8_t>(stage.homed),
          static_cast<std::uint8_t>(stage.limit),
          {}};
}

weft_wrench_sample_v1 c_value(const WrenchSample& wrench) {
  weft_wrench_sample_v1 c{};
  c.struct_size = sizeof(c);
  c.status = wrench.status;
  for (std::size_t i = 0; i < 3; ++i) {
    c.force_n[i] = wrench.force_n[i];
    c.torque_nm[i] = wrench.torque_nm[i];
  }
  c.valid = wrench.valid ? 1 : 0;
  return c;
}

weft_taxel_sample_v1 c_value(const TaxelSample& taxels) {
  return {sizeof(weft_taxel_sample_v1), static_cast<std::uint32_t>(taxels.counts.size()),
          taxels.counts.data(),         taxels.proximity_counts,
          taxels.ambient_counts,        taxels.device_us};
}

weft_block_sample_v1 c_value(const AccelerationSample& block) {
  return c_block(block.acceleration_mps2, block.rate_hz, block.device_us, block.clipped);
}

weft_block_sample_v1 c_value(const SoundSample& block) {
  return c_block(block.pressure_pa, block.rate_hz, block.device_us, block.clipped);
}

}  // namespace weft::plugin
