#pragma once
// Which resonances the sensors hear: the arm that carries the probe, bending, for the
// accelerometer; the plate under the cloth, sounding, for the microphone. Frequencies and masses
// follow from textbook beams and plates (Blevins 1979, tables 8-1 and 11-4); dimensions are [E].

#include <vector>

#include "sim/plant/modal/modal_bank.hpp"

namespace weft::sim {

/// A uniform cantilever along each axis, probe and accelerometer at its tip.
struct ArmParams {
  double mass_kg = 0.3;                                ///< of the beam; tip's modal mass is 1/4
  std::array<double, 3> fundamental_hz{96, 131, 212};  ///< first bending along x, y, z
  double damping_ratio = 0.02;
  double cross_axis = 0.03;  ///< share of a motion that the two other axes see
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
  double contact_x = 0.42;  ///< where the probe presses, as shares of length and width
  double contact_y = 0.37;
  double microphone_m = 0.3;  ///< distance of the microphone
};

/// Four bending modes per axis, as many as are below 0.45 of the rate. Drive: force on the probe;
/// channels: acceleration along x, y, z [m/s2]. Errors: range, naming the field.
Result<std::vector<Mode>> arm_modes(const ArmParams& params, double rate_hz);

/// All modes below 0.45 of the rate that move air: odd along both sides, others cancel.
/// Drive: normal force on the plate (z); channel 0: sound pressure of a source small against the
/// wavelength, p = rho dQ/dt/(2 pi r) [Pa]. Errors: range, naming the field, or where the plate has
/// no such mode.
Result<std::vector<Mode>> plate_modes(const PlateParams& params, double rate_hz);

/// Frequency of the plate's mode with m and n half waves along length and width.
double plate_frequency_hz(const PlateParams& params, int m, int n);

}  // namespace weft::sim
