#pragma once
// One fabric of the table, one patch cut from it, and its variation between trials.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"
#include "sim/plant/contact.hpp"
#include "sim/plant/fabric_law.hpp"
#include "sim/plant/height_field.hpp"
#include "sim/plant/pads.hpp"

namespace weft::sim {

/// A row of sim/fabrics.json or sim/textures.json in SI.
struct Fabric {
  std::string name;
  double thickness_m = 0;
  KesCompression kes;
  double friction_mean = 0;       ///< MIU
  double friction_deviation = 0;  ///< MMD; kept for the record, unused at level L1
  double roughness_m = 0;         ///< SMD
  double height_rms_m = 0;        ///< std(h), calibrated; 0: derived from SMD
  double waviness_rms_m = 0;      ///< calibrated; 0: that of all fabrics
  double warp_per_m = 0;          ///< yarns, wales or ribs per metre along x; 0 without a lattice
  double weft_per_m = 0;          ///< along y
  double grain_m = 0;  ///< longest distance between asperities; 0: default of RubbingParams
  Structure structure;
};

/// Wear of the surface by rubbing. The logarithm of the heights is reduced by the share w = most (1
/// - e^{-dose/scale}). The dose is the integral of pressure over the way of all touches of the
/// mounted piece. The thickness decreases with it.
struct Wear {
  double most = 0;          ///< in [0, 1]; 0: no wear
  double scale_pa_m = 2e4;  ///< twenty strokes of 50 mm under 20 kPa [E]
};

/// Common values of all fabrics; every number [E], from `parameters` of sim/fabrics.json.
struct MaterialParams {
  /// Relaxation shares g_i = base + slope * eta.
  std::array<double, Relaxation::terms> relaxation_base{0.12, 0.10};
  std::array<double, Relaxation::terms> relaxation_slope{0.25, 0.2};
  std::array<double, Relaxation::terms> relaxation_time_s{0.3, 5};
  double hysteresis_length = 0.3;
  double friction_exponent = 0.9;
  double friction_reference_n = 5;
  double bristle_length_m = 150e-6;
  /// std(h) = this * 5 um * (SMD/5 um)^exponent: the KES contactor averages over 5 mm.
  double height_per_roughness = 2;
  double roughness_exponent = 1;
  Wear wear;
  Cover cover;  ///< of the pressing sensor; the rig file may name another
  WavinessSpec waviness;
};

// Variation at four levels; the rig's own is in PadParams. Standard deviations, of ratios unless
// named otherwise; every number [E].

/// Between pieces of a fabric.
struct PieceSpread {
  double lambda = 0.03;
  double pressure = 0.06;
  double friction = 0.04;
  double thickness = 0.01;
  double roughness = 0.1;
  double pitch = 0.01;  ///< of the yarns
};
/// Between mountings of a piece by hand.
struct MountingSpread {
  double position_m = 2e-3;  ///< along x and along y
  double skew_rad = 0.0175;  ///< of the yarns against the stages
  double tension = 0.01;     ///< of lambda
  double tilt = 1e-4;        ///< of the support of the piece, about x and about y [rad]
  double pad_height_m = 0;   ///< of the piece under each pad
};
/// Between touches.
struct TouchSpread {
  double path_m = 1e-4;     ///< along x and along y
  double gain = 0.002;      ///< of all pads together
  double pad_ratio = 3e-3;  ///< of each pad
};
struct Spread {
  PieceSpread piece;
  MountingSpread mounting;
  TouchSpread touch;
};
/// Seeds of a trial's fabric. Each level has its own seed, and each of its members a stream of its
/// own. A level with the same seed is equal to the bit whatever the others do.
struct PatchSeeds {
  std::uint64_t piece = 0, mounting = 0, touch = 0;
};

/// Errors of both: range, with the name of the field.
Status check(const MaterialParams& params);
Status check(const Spread& spread);

/// Mechanisms that a rig file may switch off.
struct MaterialSwitches {
  bool relaxation = true;
  bool hysteresis = true;
  bool friction = true;
  bool texture = true;
  bool waviness = true;
  bool trial_spread = true;
};

/// The patch of fabric that one trial touches.
struct Patch {
  std::string fabric;  ///< name of its fabric; empty: the bare plate
  ContactMaterial material;
  HeightField field;
  double skew_rad = 0;
  double offset_x_m = 0, offset_y_m = 0;  ///< of the field's origin; included in the waviness
  double tilt_x = 0, tilt_y = 0;          ///< added to the rig's own tilt
  double gain_scale = 1;
  std::array<double, 16> pad_ratio = filled_ratio();  ///< of each pad's gain
  std::array<double, 16> pad_height_m{};              ///< of the piece under each pad, upwards
  Wear wear;
  double grain_m = 0;         ///< the fabric's; used at level L3 only
  std::uint64_t seed = 0;     ///< seed of the trial's noise
  std::uint64_t mounted = 0;  ///< identifies the mounted piece; 0: no memory of it is kept

 private:
  static constexpr std::array<double, 16> filled_ratio() {
    std::array<double, 16> out{};
    out.fill(1);
    return out;
  }
};

/// Cuts a piece, mounts and touches it. Amplitudes, pitches and material depend on fabric and
/// piece, and so do phases, wander and random waves. Errors: range, for a fabric without a fitting
/// law and for parameters that check() refuses.
Result<Patch> cut_patch(const Fabric& fabric, const MaterialParams& params, const Spread& spread,
                        const MaterialSwitches& switches, const PatchSeeds& seeds);
/// The same with all seeds derived from one; no memory is kept.
Result<Patch> cut_patch(const Fabric& fabric, const MaterialParams& params, const Spread& spread,
                        const MaterialSwitches& switches, std::uint64_t seed);

/// Bare plate: stiff, smooth, without memory, under the sensor's cover.
Patch bare_plate(const Cover& cover = {});

// Reads sim/fabrics.json. Every number there carries its standing: [value, "estimated"], [value,
// "sourced", "S4"], where S4 is a key of the file's `sources`, or [value, standing, "C1", [low,
// high]] with C1 a key of `calibrations` and one of the standings calibrated, bounded and not_seen.

struct FabricLibrary {
  std::vector<Fabric> fabrics;
  std::optional<PadParams> pads;  ///< of the sensor, if the table was calibrated with one
  MaterialParams params;
  Spread spread;

  /// nullptr for a name that the table does not have.
  [[nodiscard]] const Fabric* find(std::string_view name) const;
  [[nodiscard]] std::vector<std::string> names() const;
};

/// Errors: parse (not JSON, a key missing or unknown, a number without its standing), range (an
/// impossible value); `where` is a JSON pointer.
Result<FabricLibrary> parse_fabrics(std::string_view json);

}  // namespace weft::sim
