#include "sim/plant/modal/vibration.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "sim/plant/bounds.hpp"

namespace weft::sim {
namespace {

double rate_hz(std::int64_t step_ns) {
  return 1e9 / static_cast<double>(step_ns);
}

constexpr Duration longest = std::chrono::seconds(1);  // limits the memory of one step

}  // namespace

Result<Vibration::Probe> Vibration::probe(const AccelerometerParams& params, std::int64_t step_ns,
                                          std::uint64_t seed, std::int64_t first_step) {
  for (const double g : params.gravity_mps2)
    if (auto ok =
            check_limits({{"gravity_mps2", "gravity out of range", g, -1e4, 1e4, "-1e4 to 1e4"}});
        !ok)
      return pass(ok.error());
  const auto modes = arm_modes(params.arm, rate_hz(step_ns));
  if (!modes) return pass(modes.error());
  auto bank = ModalBank::make(*modes, 3, rate_hz(step_ns));
  if (!bank) return pass(bank.error());
  Probe probe{std::move(*bank), params.gravity_mps2, {}};
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    auto converter = Converter::make(params.converter, step_ns, mix(seed, axis), first_step);
    if (!converter) return pass(converter.error());
    probe.axes.push_back(*converter);
  }
  return probe;
}

Result<Vibration::Sound> Vibration::sound(const MicrophoneParams& params, std::int64_t step_ns,
                                          std::uint64_t seed, std::int64_t first_step) {
  const auto modes = plate_modes(params.plate, rate_hz(step_ns));
  if (!modes) return pass(modes.error());
  auto bank = ModalBank::make(*modes, 1, rate_hz(step_ns));
  if (!bank) return pass(bank.error());
  auto converter = Converter::make(params.converter, step_ns, seed, first_step);
  if (!converter) return pass(converter.error());
  return Sound{std::move(*bank), *converter};
}

Result<Vibration> Vibration::make(const VibrationParams& params, const HeightField& field,
                                  std::uint64_t seed, const VibrationStart& start) {
  constexpr double any = std::numeric_limits<double>::infinity();
  if (auto ok = check_limits({{"step_ns", "step out of range", static_cast<double>(params.step_ns),
                               1000, 1e8, "1000 to 100000000", true},
                              {"first_step", "first step out of range",
                               static_cast<double>(start.first_step), 0, any, "at least 0", true}});
      !ok)
    return pass(ok.error());
  auto rubbing = Rubbing::make(params.rubbing, field, mix(seed, "rubbing"), start.skew_rad);
  if (!rubbing) return pass(rubbing.error(), "rubbing");
  Vibration made(params.step_ns, std::move(*rubbing));
  if (params.accelerometer) {
    auto probe = Vibration::probe(*params.accelerometer, params.step_ns, mix(seed, "probe"),
                                  start.first_step);
    if (!probe) return pass(probe.error(), "accelerometer");
    made.probe_ = std::move(*probe);
  }
  if (params.microphone) {
    auto sound = Vibration::sound(*params.microphone, params.step_ns, mix(seed, "microphone"),
                                  start.first_step);
    if (!sound) return pass(sound.error(), "microphone");
    made.sound_ = std::move(*sound);
  }
  return made;
}

VibrationSample Vibration::advance(const SlidingContact& at_end) {
  VibrationSample sample;
  if (!probe_ && !sound_) return sample;
  const Force on_plate = rubbing_.advance(at_end);
  if (probe_) {
    const Force on_probe{-on_plate[0], -on_plate[1], -on_plate[2]};
    std::array<double, 3> a{};
    probe_->bank.advance(std::span(&on_probe, 1), a);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto reading = probe_->axes[axis].advance(a[axis], probe_->gravity_mps2[axis]);
      if (!reading) continue;
      if (axis == 0) sample.acceleration_mps2.emplace();
      (*sample.acceleration_mps2)[axis] = *reading;
    }
  }
  if (sound_) {
    double pressure = 0;
    sound_->bank.advance(std::span(&on_plate, 1), std::span(&pressure, 1));
    sample.sound_pa = sound_->converter.advance(pressure);
  }
  return sample;
}

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
