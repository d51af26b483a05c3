#pragma once
// Resonances of a structure, side by side: each mode answers a force that is linear between samples
// exactly, x'' + 2 zeta w x' + w^2 x = drive . force, and channels weigh the modes' accelerations.
// A mode is one complex number: w <- e^{s h} w + f with s = -zeta w + i w sqrt(1 - zeta^2), four
// multiplications. Source: docs/reference/plant.md, Closed forms (12), Time and numbers, Levels.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::sim {

constexpr std::size_t bank_inputs = 3;    ///< force along x, y, z [N]
constexpr std::size_t bank_channels = 3;  ///< most channels of a bank
using Force = std::array<double, bank_inputs>;

struct Mode {
  double frequency_hz = 0;  ///< undamped
  double damping_ratio = 0;
  std::array<double, bank_inputs> drive_1_kg{};  ///< modal acceleration per newton
  std::array<double, bank_channels> weight{};    ///< channel's unit per m/s2 of the mode
};

class ModalBank {
 public:
  /// Errors: range, for none or more than 4096 modes, 0 or more than 3 channels, a rate outside
  /// 1 Hz to 10 MHz, a frequency outside 1e-6 to 0.49 of the rate, a damping ratio outside 0 to
  /// 0.9, a drive or weight beyond 1e9.
  static Result<ModalBank> make(std::span<const Mode> modes, std::size_t channels, double rate_hz);

  /// One sample per force, the force linear from the last one; out holds samples x channels.
  /// What is not a number counts as 0, a force beyond 1e9 N as that, below 1e-100 N as none.
  void advance(std::span<const Force> force_n, std::span<double> out);

  [[nodiscard]] std::size_t channels() const { return channels_; }
  /// Complex amplitudes, scaled; for tests that look for denormals.
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

}  // namespace weft::sim
