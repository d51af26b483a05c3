#include "sim/plant/texture_map.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/unit/plant/support.hpp"

namespace pad_bed_test {

using namespace weft::sim;

namespace {

/// A face that tilts, slides and sinks from stage to stage.
ContactState face_at(int stage) {
  ContactState state;
  state.pose = {.x_m = 0.03, .y_m = 0.03 + 6e-6 * stage};
  state.indentation_m = 2e-4 + 1e-6 * stage;
  state.slope_x = 3e-3;
  state.slope_y = -2e-3;
  state.load_ratio = 0.9 - 0.01 * stage;
  state.normal_n = 5;
  return state;
}

constexpr double skew_rad = 0.02;

struct Bed {
  Patch patch = test::patch_of(test::library(), "denim", 1);
  PadBed bed{patch.material, patch.field, skew_rad};
  PadBed::Values pressure_pa{};
};

}  // namespace

TEST_CASE("pads side by side press as each does by itself, with the face where it was then") {
  Bed side;
  for (int stage = 0; stage < pad_timing::stages; ++stage) side.bed.remember(stage, face_at(stage));
  side.bed.press(0, pad_timing::stages, side.pressure_pa);
  const ContactModel model({}, {}, side.patch.material);
  TextureMap texture(side.patch.field, side.patch.material.law.lambda_m);
  const double c = std::cos(skew_rad), s = std::sin(skew_rad);
  for (std::size_t pad = 0; pad < pad_count; ++pad) {
    const ContactState face = face_at(static_cast<int>(pad) % pad_timing::stages);
    const double x = face.face_x_m() + pad_dx_m(pad), y = face.face_y_m() + pad_dy_m(pad);
    TextureMap::Cursor cursor;
    const double surface = texture.response(c * x + s * y, c * y - s * x, cursor);
    const double alone_pa = model.pressure_pa(face, pad_dx_m(pad), pad_dy_m(pad), surface);
    CHECK(alone_pa > 10);
    CHECK(side.pressure_pa[pad] == Approx(alone_pa).epsilon(1e-12));
  }
}

TEST_CASE("part of a scan gives the bits of the whole and leaves the other pads alone") {
  Bed whole, parts;
  for (int stage = 0; stage < pad_timing::stages; ++stage)
    whole.bed.remember(stage, face_at(stage));
  whole.bed.press(0, pad_timing::stages, whole.pressure_pa);
  parts.pressure_pa.fill(-1);
  for (int stage = 0; stage < 3; ++stage) parts.bed.remember(stage, face_at(stage));
  parts.bed.press(0, 3, parts.pressure_pa);
  CHECK(parts.pressure_pa[2] == whole.pressure_pa[2]);
  CHECK(parts.pressure_pa[10] == whole.pressure_pa[10]);
  CHECK(parts.pressure_pa[3] == -1);
  for (int stage = 3; stage < pad_timing::stages; ++stage)
    parts.bed.remember(stage, face_at(stage));
  parts.bed.press(3, pad_timing::stages, parts.pressure_pa);
  CHECK(parts.pressure_pa == whole.pressure_pa);
}

TEST_CASE("a face above the cloth presses nothing and makes no texture") {
  Bed above;
  ContactState face = face_at(0);
  face.normal_n = 0;
  above.pressure_pa.fill(-1);
  for (int stage = 0; stage < pad_timing::stages; ++stage) above.bed.remember(stage, face);
  above.bed.press(0, pad_timing::stages, above.pressure_pa);
  CHECK(above.pressure_pa == PadBed::Values{});
  CHECK(above.bed.tiles() == 0);
}

}  // namespace pad_bed_test
