#pragma once
// Resonances of a structure, computed in parallel. Each mode responds exactly to a force that is
// linear between samples, x'' + 2 zeta w x' + w^2 x = drive . force; channels are weighted sums of
// the modes' accelerations. A mode is one complex number: w <- e^{s h} w + f with s = -zeta w + i w
// sqrt(1 - zeta^2), four multiplications. Source: docs/reference/plant.md, Closed forms (12), Time
// and numbers, Levels.
// multiplications. Source: docs/reference/plant.md, Closed forms (12), Time and numbers, Levels.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::sim {

constexpr std::size_t bank_inputs = 3;    ///< force along x, y, z [N]
constexpr std::size_t bank_channels = 3;  ///< largest number of channels of a bank
using Force = std::array<double, bank_inputs>;

struct Mode {
  double frequency_hz = 0;  ///< undamped
  double damping_ratio = 0;
  std::array<double, bank_inputs> drive_1_kg{};  ///< modal acceleration per newton
  std::array<double, bank_channels> weight{};    ///< channel's unit per m/s2 of the mode
};

class ModalBank {
 public:
  /// Errors: range, for no or more than 4096 modes, 0 or more than 3 channels, a rate outside 1 Hz
  /// to 10 MHz, a frequency outside 1e-6 to 0.49 of the rate, a damping ratio outside 0 to 0.9, a
  /// drive or weight beyond 1e9.
  static Result<ModalBank> make(std::span<const Mode> modes, std::size_t channels, double rate_hz);

  /// One sample per force, with the force linear from the last one; out holds samples x channels.
  /// NaN counts as 0, a force beyond 1e9 N as that limit, below 1e-100 N as 0.
  void advance(std::span<const Force> force_n, std::span<double> out);

  [[nodiscard]] std::size_t channels() const { return channels_; }
  /// Complex amplitudes, scaled; for tests of denormals.
  [[nodiscard]] std::span<const double> state() const { return state_; }

 private:
  explicit ModalBank(std::size_t modes, std::size_t channels);
  void set(std::size_t index, const Mode& mode, double step_s);

  std::size_t channels_;
  std::size_t groups_;  // of 4 modes
  // Per group of 4 lanes: Re and Im of e^{s h}, three drives, two weights per channel.
  std::vector<double> coefficients_;
  std::vector<double> state_;  // per group: 4 real parts, 4 imaginary parts
  std::array<Force, bank_channels> direct_{};
};

// Resonances in the sensors' signals: bending of the arm that carries the probe, for the
// accelerometer; sound of the plate under the fabric, for the microphone. Frequencies and masses
// follow from textbook beams and plates (Blevins 1979, tables 8-1 and 11-4); dimensions are [E].

/// A uniform cantilever along each axis, probe and accelerometer at its tip.
struct ArmParams {
  double mass_kg = 0.3;                                ///< of the beam; tip's modal mass is 1/4
  std::array<double, 3> fundamental_hz{96, 131, 212};  ///< first bending along x, y, z
  double damping_ratio = 0.02;
  double cross_axis = 0.03;  ///< share of a motion in the two other axes
};

/// A rectangular plate, simply supported, in a baffle.
struct PlateParams {
  double length_m = 0.30;
  double width_m = 0.20;
  double thickness_m = 2e-3;
  double modulus_pa = 70e9;  ///< aluminium
  double density_kg_m3 = 2700;
  double poisson_ratio = 0.33;
  double damping_ratio = 0.01;
  double contact_x = 0.42;  ///< point of contact, as shares of length and width
  double contact_y = 0.37;
  double microphone_m = 0.3;  ///< distance of the microphone
};

/// Four bending modes per axis, limited to those below 0.45 of the rate. Drive: force on the probe;
/// channels: acceleration along x, y, z [m/s2]. Errors: range, with the name of the field.
Result<std::vector<Mode>> arm_modes(const ArmParams& params, double rate_hz);

/// All modes below 0.45 of the rate that radiate sound: odd along both sides, others cancel. Drive:
/// normal force on the plate (z); channel 0: sound pressure of a source small against the
/// wavelength, p = rho dQ/dt/(2 pi r) [Pa]. Errors: range, with the name of the field, or if the
/// plate has no such mode.
Result<std::vector<Mode>> plate_modes(const PlateParams& params, double rate_hz);

/// Frequency of the plate's mode with m and n half waves along length and width.
double plate_frequency_hz(const PlateParams& params, int m, int n);

}  // namespace weft::sim
