#pragma once
// The whole plant: contact, texture and pads of one mounted patch. Steps between given poses; knows
// no clock.

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

/// What somebody looks at. The rest is not computed.
struct Watched {
  bool contact = true;  ///< force and indentation; pads need it too
  bool pads = true;     ///< texture, pressures and counts
};

struct PlantParams {
  Level level = Level::quasistatic;  ///< L0 to L3; L3's vibrations are in modal/
  Watched watched;
  double set_point_n = 5;  ///< used at L0: the force of a pressed probe
  /// Used at L1: a longer advance() is made of equal steps of at most this, and shorter ones of one
  /// scan are put together up to it. The default balances the contact at every conversion; a step
  /// as long as a scan balances it once per scan, and between two balances the pads see a face that
  /// sinks in evenly.
  double quasistatic_step_s = 1e-9 * static_cast<double>(pad_timing::stage_ns);
  DynamicsParams dynamics;    ///< used from L2 on
  VibrationParams vibration;  ///< used at L3: sensors that are set are computed
  ContactGeometry geometry;
  Mount mount;
  Cover cover;  ///< of the sensor, for the bare plate: a cloth's law has it already
  PadParams pads;
  double rig_tilt =
      1e-4;  ///< standard deviation of the probe's own tilt, drawn once per rig [rad, E]
};

/// Refuses what the levels' equations have no solution for; the sensors' parameters at L3 only.
/// Errors: range, naming the field.
Status check(const PlantParams& params, const ContactMaterial& material);

/// What the cloth and the pads know of earlier touches. Where it is put back the next minutes are
/// the same again, at any level.
struct PlantMemory {
  ContactState contact;
  PadArray::State pads;
  double dose_pa_m = 0;  ///< of rubbing
};

class Plant {
 public:
  /// The parameters must pass check() with the material of every patch.
  Plant(const PlantParams& params, std::uint64_t rig_seed);

  /// A patch under the probe at `pose`; `memory` of the same one, touched before, or nothing: then
  /// it is fresh. `now` >= 0 matters to level L3 alone, whose readings are counted from time zero.
  void mount(const Patch& patch, const Pose& pose, TimePoint now = {},
             const PlantMemory* memory = nullptr);
  /// The next cloth to be mounted is the one that lies in `other`, with the same field and law: its
  /// tiles of texture need not be made again. Changes no number.
  void share_tiles(const Plant& other);
  /// As of now, the scan under way not in it.
  [[nodiscard]] PlantMemory memory();
  /// Moves in a straight line to `pose` within `dt_s` >= 0; at L3 whole nanoseconds, at most 1 s.
  void advance(const Pose& pose, double dt_s);
  /// What advance() would lead to; changes nothing.
  [[nodiscard]] ContactState peek(const Pose& pose, double dt_s) const;
  /// What accelerometer and microphone have read since this was last called; nothing below L3. The
  /// readings are kept until they are taken.
  VibrationReadings extract_vibration();
  /// Converts the two pads of one stage of frame `frame` in the present state. Stages run from 0 to
  /// 7; counts appear with the frame's last.
  void convert(int stage, std::uint64_t frame);

  /// At L1 with a step longer than a conversion: as of the last balance, at most that step ago.
  [[nodiscard]] const ContactState& contact() const { return contact_; }
  /// As of now, whatever the step.
  [[nodiscard]] ContactState contact_now() const {
    return gathered_.moved ? quasistatic(gathered_.pose, gathered_.dt_s) : contact_;
  }
  /// Of the last frame that was converted to its end, and of stages that a mount cut short.
  [[nodiscard]] const std::array<std::uint16_t, pad_count>& pad_counts() const {
    return pads_.counts();
  }
  /// Of each pad at its own last conversion, as of the last balance.
  [[nodiscard]] const std::array<double, pad_count>& pad_pressures_pa() const {
    if (!algebraic_ && gathered_.count == 0) bed_.press(scan_first_, scan_last_, pressure_pa_);
    return pressure_pa_;
  }
  [[nodiscard]] std::size_t texture_tiles() const {
    return algebraic_ ? algebraic_->texture.tiles() : bed_.tiles();
  }

 private:
  /// Level L0, where texture is linear.
  struct Algebraic {
    AlgebraicProbe probe;
    LinearTexture texture;
    double skew_cos, skew_sin, offset_x_m, offset_y_m;
    std::array<TextureMap::Cursor, pad_count> cursors{};
    std::array<double, pad_count> pad_heights_m{};
    double unworn = 1;
  };
  /// What waits, at L1 with a long step, for the next balance.
  struct Gathered {
    struct Conversion {
      int stage;
      Pose pose;
      double after_s;
    };
    bool moved = false;
    Pose pose;        ///< where the stages are
    double dt_s = 0;  ///< since the last balance
    int count = 0;    ///< of the conversions
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
  std::uint64_t mounted_ = 0;  ///< Patch::mounted of what lies there
  Wear wear_;
  double dose_pa_m_ = 0;
  Vector2 rubbed_to_m_{};  ///< the stages when the dose was last counted
  mutable PadBed bed_;     ///< at L1 and above; makes texture where it is looked at
  PadArray pads_;
  mutable std::array<double, pad_count> pressure_pa_{};  ///< of pads that wait: not yet
  std::uint64_t scan_frame_ = 0;  // stages [first, last) of it wait for their counts
  int scan_first_ = 0, scan_last_ = 0;
  Gathered gathered_;
  /// A scan has steps of two lengths: what relaxes over them is kept.
  struct PreparedStep {
    double dt_s;
    RelaxationStep relaxation;
  };
  std::array<std::optional<PreparedStep>, 2> prepared_;
};

}  // namespace weft::sim
