#include "sim/plant/modal/sounding_contact.hpp"

#include <algorithm>
#include <utility>

namespace weft::sim {

namespace {

constexpr Duration longest = std::chrono::seconds(1);  // bounds what one step has to remember

}  // namespace

SoundingContact::SoundingContact(const DynamicContact& contact, const VibrationParams& params,
                                 Vibration vibration, TimePoint start)
    : contact_(contact), vibration_(std::move(vibration)), now_(start) {
  if (params.accelerometer) acceleration_ns_ = params.accelerometer->converter.period_ns;
  if (params.microphone) sound_ns_ = params.microphone->converter.period_ns;
}

Result<SoundingContact> SoundingContact::make(const DynamicContact& contact,
                                              const VibrationParams& params,
                                              const HeightField& field, double skew_rad,
                                              std::uint64_t seed, TimePoint start) {
  const std::int64_t start_ns = ns_of(start);
  const std::int64_t step_ns = std::max<std::int64_t>(params.step_ns, 1);
  const std::int64_t first_step = start_ns < 0 ? -1 : start_ns / step_ns;
  auto vibration = Vibration::make(params, field, seed, {skew_rad, first_step});
  if (!vibration) return pass(vibration.error());
  return SoundingContact(contact, params, std::move(*vibration), start);
}

Instants SoundingContact::ticks(Duration dt) const {
  if (!vibration_.listens()) return {};
  const std::int64_t step = vibration_.step_ns(), begin = ns_of(now_);
  const std::int64_t first = begin / step + 1, last = (begin + dt.count()) / step;
  return {.first_s = to_seconds(Duration(first * step - begin)),
          .every_s = to_seconds(Duration(step)),
          .count = static_cast<std::size_t>(last - first + 1)};
}

ContactState SoundingContact::peek(const ContactState& from, const Pose& to, Duration dt) const {
  if (dt < Duration::zero() || dt > longest) return from;
  return contact_.step(from, to, to_seconds(dt), ticks(dt), {});
}

ContactState SoundingContact::advance(const ContactState& from, const Pose& to, Duration dt) {
  if (dt < Duration::zero() || dt > longest) return from;
  const Instants instants = ticks(dt);
  contacts_.resize(instants.count);
  const ContactState state = contact_.step(from, to, to_seconds(dt), instants, contacts_);
  std::int64_t at_ns = ns_of(now_) / vibration_.step_ns() * vibration_.step_ns();
  for (const SlidingContact& contact : contacts_) {
    at_ns += vibration_.step_ns();
    const VibrationSample sample = vibration_.advance(contact);
    if (sample.acceleration_mps2)
      readings_.acceleration.push_back(
          {static_cast<std::uint64_t>(at_ns / acceleration_ns_), *sample.acceleration_mps2});
    if (sample.sound_pa)
      readings_.sound.push_back({static_cast<std::uint64_t>(at_ns / sound_ns_), *sample.sound_pa});
  }
  now_ += dt;
  return state;
}

VibrationReadings SoundingContact::take() {
  return std::exchange(readings_, {});
}

}  // namespace weft::sim
