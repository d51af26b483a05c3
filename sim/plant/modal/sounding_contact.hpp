#pragma once
// Level L3 of the probe on the cloth: the contact of level L2, stepped so that it is known at every
// tick of the vibration, and the sensors that hear it. Ticks and readings lie on one grid of whole
// nanoseconds since time zero, whatever steps the stages make. What is not asked for is not
// computed: without a sensor this is level L2, bit for bit. Source: docs/reference/plant.md,
// Levels.

#include <cstdint>
#include <vector>

#include "protocols/base/time.hpp"
#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/modal/vibration.hpp"

namespace weft::sim {

/// One reading of the accelerometer, due at `index` times its period since time zero.
struct AccelerationReading {
  std::uint64_t index = 0;
  std::array<double, 3> acceleration_mps2{};
};
/// One reading of the microphone, likewise.
struct SoundReading {
  std::uint64_t index = 0;
  double pressure_pa = 0;
};
struct VibrationReadings {
  std::vector<AccelerationReading> acceleration;
  std::vector<SoundReading> sound;
};

class SoundingContact {
 public:
  /// Listens to `contact` on a patch whose surface is `field`, its yarns turned by `skew_rad`, from
  /// `start` >= 0 on. Out of contact before: a contact under load at once is a blow.
  /// Errors: range, naming the sensor and the field; what Vibration::make refuses.
  static Result<SoundingContact> make(const DynamicContact& contact, const VibrationParams& params,
                                      const HeightField& field, double skew_rad, std::uint64_t seed,
                                      TimePoint start);

  /// The state `dt` later with the stages at `to`, moved there in a straight line, and what the
  /// sensors read until then. A `dt` below 0 or above a second changes nothing.
  ContactState advance(const ContactState& from, const Pose& to, Duration dt);
  /// What advance() would lead to; hears and changes nothing.
  [[nodiscard]] ContactState peek(const ContactState& from, const Pose& to, Duration dt) const;
  /// Up to when advance() has come.
  [[nodiscard]] TimePoint now() const { return now_; }
  /// Readings since they were last taken.
  VibrationReadings take();

 private:
  SoundingContact(const DynamicContact& contact, const VibrationParams& params, Vibration vibration,
                  TimePoint start);
  [[nodiscard]] Instants ticks(Duration dt) const;

  DynamicContact contact_;
  Vibration vibration_;
  std::int64_t acceleration_ns_ = 1, sound_ns_ = 1;  ///< periods
  TimePoint now_;
  std::vector<SlidingContact> contacts_;  ///< of one step, kept for its memory
  VibrationReadings readings_;
};

}  // namespace weft::sim
