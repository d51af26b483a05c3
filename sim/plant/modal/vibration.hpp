#pragma once
// Level L3: accelerometer on the probe and microphone above the plate, from the contact of level L2
// and the resonances of arm and plate. Sensors that are not set are not computed. Source:
// docs/reference/plant.md, Levels; rates of VibTac-12 (200 Hz, 8 kHz).

#include <cstdint>
#include <optional>
#include <vector>

#include "protocols/base/time.hpp"
#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/modal/converter.hpp"
#include "sim/plant/modal/modal_bank.hpp"
#include "sim/plant/modal/rubbing.hpp"

namespace weft::sim {

struct AccelerometerParams {
  ConverterParams converter{5'000'000, 80, 0.02, 19.6133, 19.6133 / 2048};  ///< +-2 g, 12 bits [E]
  std::array<double, 3> gravity_mps2{0, 0, 9.80665};  ///< as mounted: z downwards reads +1 g
  ArmParams arm;
};

struct MicrophoneParams {
  ConverterParams converter{125'000, 3600, 1e-3, 2, 2.0 / 32768};  ///< 34 dB(SPL) of noise [E]
  PlateParams plate;
};

struct VibrationParams {
  std::int64_t step_ns = 62'500;  ///< 16 kHz: forces are linear in between
  std::optional<AccelerometerParams> accelerometer = AccelerometerParams{};
  std::optional<MicrophoneParams> microphone = MicrophoneParams{};
  RubbingParams rubbing;
};

/// Orientation and start time of a fabric, which differ between mounted patches.
struct VibrationStart {
  double skew_rad = 0;          ///< of the yarns against the stages
  std::int64_t first_step = 0;  ///< >= 0, steps since time zero; readings are due at multiples of
                                ///< the sensors' periods since then
};

/// Readings that are due at the end of a step.
struct VibrationSample {
  std::optional<std::array<double, 3>> acceleration_mps2;
  std::optional<double> sound_pa;
};

/// Starts without contact: a first contact under load is an impact.
class Vibration {
 public:
  /// Errors: range, with the name of the field, and those of the parts.
  static Result<Vibration> make(const VibrationParams& params, const HeightField& field,
                                std::uint64_t seed, const VibrationStart& start = {});

  /// One step of `step_ns` with the contact at its end. For any contact, readings are finite
  /// numbers within their range.
  VibrationSample advance(const SlidingContact& at_end);
  [[nodiscard]] std::int64_t step_ns() const { return step_ns_; }
  /// Whether any sensor is set.
  [[nodiscard]] bool listens() const { return probe_ || sound_; }

 private:
  struct Probe {
    ModalBank bank;
    std::array<double, 3> gravity_mps2;
    std::vector<Converter> axes;
  };
  struct Sound {
    ModalBank bank;
    Converter converter;
  };
  Vibration(std::int64_t step_ns, Rubbing rubbing)
      : step_ns_(step_ns), rubbing_(std::move(rubbing)) {}
  static Result<Probe> probe(const AccelerometerParams& params, std::int64_t step_ns,
                             std::uint64_t seed, std::int64_t first_step);
  static Result<Sound> sound(const MicrophoneParams& params, std::int64_t step_ns,
                             std::uint64_t seed, std::int64_t first_step);

  std::int64_t step_ns_;
  Rubbing rubbing_;
  std::optional<Probe> probe_;
  std::optional<Sound> sound_;
};

// Level L3 of the probe on the fabric: the contact of level L2, with steps that end at every tick
// of the vibration, and the sensors of the vibration. Ticks and readings are on one grid of whole
// nanoseconds since time zero, for any steps of the stages. Sensors that are not set are not
// computed: without a sensor this is level L2, bit for bit. Source: docs/reference/plant.md,
// Levels.

/// One reading of the accelerometer, due at `index` times its period since time zero.
struct AccelerationReading {
  std::uint64_t index = 0;
  std::array<double, 3> acceleration_mps2{};
};
/// One reading of the microphone, due in the same way.
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
  /// Simulates the vibrations of `contact` from `start` >= 0 on, on a patch with the surface
  /// `field` and yarns turned by `skew_rad`. Before `start` there is no contact: a contact under
  /// load at once is an impact. Errors: range, with the sensor and the field, and those of
  /// Vibration::make.
  static Result<SoundingContact> make(const DynamicContact& contact, const VibrationParams& params,
                                      const HeightField& field, double skew_rad, std::uint64_t seed,
                                      TimePoint start);

  /// The state `dt` later with the stages at `to`, moved there in a straight line, and the sensors'
  /// readings until then. A `dt` below 0 or above a second changes nothing.
  ContactState advance(const ContactState& from, const Pose& to, Duration dt);
  /// The result of advance(), without readings; changes nothing.
  [[nodiscard]] ContactState peek(const ContactState& from, const Pose& to, Duration dt) const;
  /// Time up to which advance() has been called.
  [[nodiscard]] TimePoint now() const { return now_; }
  /// Readings since the last call.
  VibrationReadings take();

 private:
  SoundingContact(const DynamicContact& contact, const VibrationParams& params, Vibration vibration,
                  TimePoint start);
  [[nodiscard]] Instants ticks(Duration dt) const;

  DynamicContact contact_;
  Vibration vibration_;
  std::int64_t acceleration_ns_ = 1, sound_ns_ = 1;  ///< periods
  TimePoint now_;
  std::vector<SlidingContact> contacts_;  ///< of one step; kept to reuse its memory
  VibrationReadings readings_;
};

}  // namespace weft::sim
