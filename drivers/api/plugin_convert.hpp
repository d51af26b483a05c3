#pragma once
// Conversions between the C++ types of drivers and the C structs of the plugin ABI, for both sides.

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <variant>
#include <vector>

#include "drivers/api/driver.hpp"
#include "drivers/api/weft_driver.h"

namespace weft::plugin {

inline TimePoint time_of(std::int64_t ns) {
  return TimePoint(Duration(ns));
}

/// The result points into `error`, which must outlive it.
weft_error_v1 c_error(const Error& error);
/// A code outside Errc becomes Errc::device; NULL parts are empty.
Error error_of(const weft_error_v1& error);

weft_command_v1 c_command(const Command& command);
/// Errors: unsupported, for a kind unknown to this build.
Result<Command> command_of(const weft_command_v1& command);

/// Errors: unsupported (kind), range (number of taxels or values, rate or size of a struct).
Result<Sample> sample_of(const weft_sample_v1& sample);

using SampleValue = decltype(Sample::value);

DeviceIdentity identity_of(const weft_identity_v1& identity);

weft_stage_sample_v1 c_value(const StageSample& stage);
weft_wrench_sample_v1 c_value(const WrenchSample& wrench);
weft_taxel_sample_v1 c_value(const TaxelSample& taxels);
weft_block_sample_v1 c_value(const AccelerationSample& block);
weft_block_sample_v1 c_value(const SoundSample& block);

/// Kinds of samples and of commands are numbered from 1 in the order of the variant.
template <class Variant, std::size_t kind, class Value>
inline constexpr bool has_kind =
    std::is_same_v<std::variant_alternative_t<kind - 1, Variant>, Value>;

static_assert(std::variant_size_v<SampleValue> == WEFT_SOUND_SAMPLE);
static_assert(has_kind<SampleValue, WEFT_STAGE_SAMPLE, StageSample>);
static_assert(has_kind<SampleValue, WEFT_WRENCH_SAMPLE, WrenchSample>);
static_assert(has_kind<SampleValue, WEFT_TAXEL_SAMPLE, TaxelSample>);
static_assert(has_kind<SampleValue, WEFT_ACCELERATION_SAMPLE, AccelerationSample>);
static_assert(has_kind<SampleValue, WEFT_SOUND_SAMPLE, SoundSample>);

static_assert(std::variant_size_v<Command> == WEFT_BIAS);
static_assert(has_kind<Command, WEFT_HOME, HomeCommand>);
static_assert(has_kind<Command, WEFT_MOVE, MoveCommand>);
static_assert(has_kind<Command, WEFT_SERVO, ServoCommand>);
static_assert(has_kind<Command, WEFT_POLL, PollCommand>);
static_assert(has_kind<Command, WEFT_BIAS, BiasCommand>);

/// Calls `use` with the C form of the sample; does not allocate.
template <class Use>
void with_c_sample(const Sample& sample, const Use& use) {
  std::visit(
      [&](const auto& value) {
        const auto c = c_value(value);
        use(weft_sample_v1{sizeof(weft_sample_v1),
                           static_cast<std::uint32_t>(sample.value.index() + 1), &c,
                           ns_of(sample.host), sample.sequence, sample.lost});
      },
      sample.value);
}

template <class Use>
void with_c_identity(const DeviceIdentity& identity, const Use& use) {
  std::vector<weft_reported_v1> reported;
  std::vector<weft_scale_v1> scale;
  for (const auto& [key, text] : identity.reported) reported.push_back({key.c_str(), text.c_str()});
  for (const auto& [key, value] : identity.scale) scale.push_back({key.c_str(), value});
  use(weft_identity_v1{sizeof(weft_identity_v1), static_cast<std::uint32_t>(reported.size()),
                       static_cast<std::uint32_t>(scale.size()), 0, reported.data(), scale.data()});
}

}  // namespace weft::plugin
