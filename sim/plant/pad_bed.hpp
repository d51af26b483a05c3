#pragma once
// The cloth under the 16 pads: what each presses with at its conversion. Pads are converted two at
// a time while the face moves on, and their pressures are computed side by side when a scan is
// done. Source: docs/reference/plant.md, Pads on a surface and Pad effects.

#include <array>
#include <cstddef>

#include "sim/plant/contact.hpp"
#include "sim/plant/pads.hpp"
#include "sim/plant/texture_map.hpp"

namespace weft::sim {

class PadBed {
 public:
  using Values = std::array<double, pad_count>;

  PadBed() = default;
  /// `skew_rad` turns the yarns' frame on the plate.
  PadBed(const ContactMaterial& material, HeightField field, double skew_rad);

  /// The two pads of a stage are converted with the face as it is in `contact`.
  void remember(int stage, const ContactState& contact);
  /// The same with the stages at `pose`, at a share of the time between two states in which the
  /// face touches and leans alike.
  void remember(int stage, const Pose& pose, const ContactState& before, const ContactState& after,
                double share);
  /// Pressure of the pads of stages [first, last) as they were remembered [Pa]; others keep theirs.
  void press(int first, int last, Values& pressure_pa);

  [[nodiscard]] std::size_t tiles() const { return texture_.tiles(); }

 private:
  /// The face when each pad was converted; a load ratio of 0 where it did not touch.
  struct Faces {
    Values x_m, y_m, indentation_m, slope_x, slope_y, load_ratio;
  };
  struct Law {
    Waviness waviness;
    double per_lambda, pressure_pa, skew_cos, skew_sin;
  };
  static void place(const Law& law, Faces& faces, Values& u_m, Values& v_m);
  static void compute(const Law& law, const Faces& faces, const Values& texture, Values& out_pa);

  Law law_{{}, 1, 0, 1, 0};
  TextureMap texture_;
  std::array<TextureMap::Cursor, pad_count> cursors_{};
  Faces faces_{};
};

}  // namespace weft::sim
