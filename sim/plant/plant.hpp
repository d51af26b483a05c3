#pragma once
// The whole plant: contact, texture and pads of one mounted patch. It steps between given poses and
// uses no clock.

#include <array>
#include <cstdint>
#include <optional>

#include "sim/plant/algebraic/algebraic_probe.hpp"
#include "sim/plant/contact.hpp"
#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/modal/vibration.hpp"
#include "sim/plant/pads.hpp"
#include "sim/plant/scene/scene.hpp"
#include "sim/plant/texture_map.hpp"

namespace weft::sim {

/// Quantities that are needed; others are not computed.
struct Watched {
  bool contact = true;  ///< force and indentation; pads need it too
  bool pads = true;     ///< texture, pressures and counts
};

struct PlantParams {
  Level level = Level::quasistatic;  ///< L0 to L3; L3's vibrations are in modal/
  Watched watched;
  double set_point_n = 5;  ///< used at L0: the force of a pressed probe
  /// Used at L1. A longer advance() is divided into equal steps of at most this; shorter ones of
  /// one scan are combined up to it. The default balances the contact at every conversion. A step
  /// as long as a scan balances it once per scan, and the pads use an even indentation between two
  /// balances.
  double quasistatic_step_s = 1e-9 * static_cast<double>(pad_timing::stage_ns);
  DynamicsParams dynamics;    ///< used from L2 on
  VibrationParams vibration;  ///< used at L3: only the sensors that are set are computed
  ContactGeometry geometry;
  Mount mount;
  Cover cover;  ///< of the sensor, for the bare plate; the law of a fabric includes it already
  PadParams pads;
  double rig_tilt =
      1e-4;  ///< standard deviation of the probe's own tilt, drawn once per rig [rad, E]
};

/// Refuses parameters without a solution of the level's equations; checks the sensors' parameters
/// at L3 only. Errors: range, with the name of the field.
Status check(const PlantParams& params, const ContactMaterial& material);

/// Memory of fabric and pads of earlier touches. Restoring it repeats the following simulation at
/// any level.
struct PlantMemory {
  ContactState contact;
  PadArray::State pads;
  double dose_pa_m = 0;  ///< dose of wear
};

class Plant {
 public:
  /// The parameters must pass check() with the material of every patch.
  Plant(const PlantParams& params, std::uint64_t rig_seed);

  /// Mounts a patch under the probe at `pose`. `memory`: of earlier touches of the same patch, or
  /// nullptr for a fresh one. `now` >= 0 is used at level L3 only, where readings count from time
  /// zero.
  void mount(const Patch& patch, const Pose& pose, TimePoint now = {},
             const PlantMemory* memory = nullptr);
  /// The next fabric to be mounted is the one in `other`, with the same field and law: its tiles of
  /// texture are reused. Changes no result.
  void share_tiles(const Plant& other);
  /// The memory now, without the scan in progress.
  [[nodiscard]] PlantMemory memory();
  /// Moves in a straight line to `pose` within `dt_s` >= 0; at L3 whole nanoseconds, at most 1 s.
  void advance(const Pose& pose, double dt_s);
  /// The result of advance(); changes nothing.
  [[nodiscard]] ContactState peek(const Pose& pose, double dt_s) const;
  /// Readings of accelerometer and microphone since the last call; empty below L3. The readings are
  /// kept until this call.
  VibrationReadings extract_vibration();
  /// Converts the two pads of one stage of frame `frame` in the present state. Stages run from 0 to
  /// 7; counts appear after the last stage of the frame.
  void convert(int stage, std::uint64_t frame);

  /// At L1 with a step longer than a conversion: state of the last balance, at most that step ago.
  [[nodiscard]] const ContactState& contact() const { return contact_; }
  /// The state now, for any step.
  [[nodiscard]] ContactState contact_now() const {
    return gathered_.moved ? quasistatic(gathered_.pose, gathered_.dt_s) : contact_;
  }
  /// Counts of the last complete frame, and of the stages before a mount interrupted a frame.
  [[nodiscard]] const std::array<std::uint16_t, pad_count>& pad_counts() const {
    return pads_.counts();
  }
  /// Pressure of each pad at its own last conversion, as of the last balance.
  [[nodiscard]] const std::array<double, pad_count>& pad_pressures_pa() const {
    if (!algebraic_ && gathered_.count == 0) bed_.press(scan_first_, scan_last_, pressure_pa_);
    return pressure_pa_;
  }
  [[nodiscard]] std::size_t texture_tiles() const {
    return algebraic_ ? algebraic_->texture.tiles() : bed_.tiles();
  }

 private:
  /// Level L0, with linear texture.
  struct Algebraic {
    AlgebraicProbe probe;
    LinearTexture texture;
    double skew_cos, skew_sin, offset_x_m, offset_y_m;
    std::array<TextureMap::Cursor, pad_count> cursors{};
    std::array<double, pad_count> pad_heights_m{};
    double unworn = 1;
  };
  /// Motion and conversions that wait for the next balance, at L1 with a long step.
  struct Gathered {
    struct Conversion {
      int stage;
      Pose pose;
      double after_s;
    };
    bool moved = false;
    Pose pose;        ///< pose of the stages
    double dt_s = 0;  ///< since the last balance
    int count = 0;    ///< number of conversions
    std::array<Conversion, pad_timing::stages> conversions;
  };
  void listen(const Patch& patch, TimePoint now);
  [[nodiscard]] bool gathers() const;
  void gather(const Pose& pose, double dt_s);
  void balance();
  void balance_each();
  [[nodiscard]] ContactState quasistatic(const Pose& pose, double dt_s) const;
  void press_linear(int stage);
  void finish_stages();
  void rub(const Pose& pose);
  ContactMaterial worn(ContactMaterial material) const;
  const RelaxationStep& relaxation_over(double dt_s);

  PlantParams params_;
  std::uint64_t rig_seed_;
  double rig_tilt_x_, rig_tilt_y_;
  std::array<double, pad_count> pad_heights_m_{};  ///< of the rig's sensor
  ContactModel model_;
  std::optional<Algebraic> algebraic_;
  std::optional<DynamicContact> dynamic_;
  std::optional<SoundingContact> sounding_;
  ContactState contact_;
  std::uint64_t mounted_ = 0;  ///< Patch::mounted of the mounted patch
  Wear wear_;
  double dose_pa_m_ = 0;
  Vector2 rubbed_to_m_{};  ///< stage position at the last count of the dose
  mutable PadBed bed_;     ///< at L1 and above; creates texture where it is needed
  PadArray pads_;
  mutable std::array<double, pad_count> pressure_pa_{};  ///< pads that wait have their old value
  std::uint64_t scan_frame_ = 0;  // stages [first, last) of it wait for their counts
  int scan_first_ = 0, scan_last_ = 0;
  Gathered gathered_;
  /// A scan has steps of two lengths; their relaxation is kept.
  struct PreparedStep {
    double dt_s;
    RelaxationStep relaxation;
  };
  std::array<std::optional<PreparedStep>, 2> prepared_;
};

}  // namespace weft::sim
