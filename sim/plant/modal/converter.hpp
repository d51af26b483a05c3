#pragma once
// From a quantity in every step to the readings of one sensor axis: low-pass, sampling at the
// sensor's own period, noise, range, quantum.

#include <array>
#include <cstdint>
#include <optional>

#include "sim/plant/modal/oscillator.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

/// How one sensor's converter samples. Periods are whole numbers of the vibration's steps.
struct ConverterParams {
  std::int64_t period_ns = 0;
  double bandwidth_hz = 0;  ///< of a fourth-order Butterworth low-pass before sampling; 0: none
  double noise = 0;         ///< rms, in the sensor's unit
  double range = 0;         ///< readings are held within +- this
  double quantum = 0;       ///< step of a reading; 0: none
};

/// Fourth-order Butterworth: two resonances, stepped exactly. Unit gain at rest.
class LowPass {
 public:
  /// Errors: as OscillatorStep::make.
  static Result<LowPass> make(double bandwidth_hz, double step_s);
  double advance(double value);

 private:
  struct Section {
    OscillatorStep step;
    double square = 0;  // of the angular frequency
    OscillatorState state;
    double last = 0;
  };
  std::array<std::optional<Section>, 2> sections_;
};

/// One sensor's axis: low-pass, noise, range and quantum.
class Converter {
 public:
  /// Errors: range, naming the field.
  /// Readings are due at multiples of the period; the converter starts at the end of step
  /// `first_step` >= 0.
  static Result<Converter> make(const ConverterParams& params, std::int64_t step_ns,
                                std::uint64_t seed, std::int64_t first_step = 0);
  /// A reading where one is due at this step's end; `offset` is there from the beginning of time.
  std::optional<double> advance(double value, double offset = 0);

 private:
  Converter(const ConverterParams& params, std::int64_t steps, std::uint64_t seed)
      : params_(params), steps_(steps), noise_(seed) {}

  ConverterParams params_;
  std::int64_t steps_;
  std::int64_t left_ = 0;
  std::optional<LowPass> low_pass_;
  Random noise_;
};

}  // namespace weft::sim
