#include "sim/plant/imprint/objects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "sim/plant/random.hpp"

namespace weft::sim {

namespace {

constexpr double half_root_3 = std::numbers::sqrt3 / 2;
constexpr double array_corner_m = 25.3e-3;  // half the diagonal of 128 x 128 taxels
constexpr double largest_turn_rad = 0.2;    // placed by hand [E]
constexpr double tooth_tip_m = 0.2e-3;      // radius that rounds a tooth's tip [E]

constexpr std::array objects{
    ObjectSpec{.name = "PLANE1",  // stiff conductive foam
               .roughness_m = 12e-6,
               .compliance_m_pa = 4e-9,
               .modulus_pa = 1e6},
    ObjectSpec{.name = "PLANE2", .roughness_m = 2e-6},  // unetched printed circuit board
    ObjectSpec{.name = "PLANE3",  // rubber sheet under air: nearly the same pressure everywhere
               .roughness_m = 5e-6,
               .compliance_m_pa = 1e-6,
               .modulus_pa = 20e3},
    ObjectSpec{.name = "RASP1",
               .object_class = ObjectClass::rasp,
               .pattern = Pattern::parallelogram,
               .pitch_x_m = 3.4e-3,
               .pitch_y_m = 4.0e-3,
               .radius_m = 1.3e-3,
               .depth_m = 1.2e-3,
               .irregularity = 0.10,
               .roughness_m = 5e-6},
    ObjectSpec{.name = "RASP2",
               .object_class = ObjectClass::rasp,
               .pattern = Pattern::parallelogram,
               .pitch_x_m = 3.4e-3,
               .pitch_y_m = 4.0e-3,
               .radius_m = 1.1e-3,
               .depth_m = 0.9e-3,
               .irregularity = 0.14,
               .roughness_m = 8e-6},
    ObjectSpec{.name = "RASP3",
               .object_class = ObjectClass::rasp,
               .pattern = Pattern::parallelogram,
               .pitch_x_m = 2.4e-3,
               .pitch_y_m = 3.2e-3,
               .radius_m = 0.9e-3,
               .depth_m = 0.7e-3,
               .irregularity = 0.10,
               .roughness_m = 5e-6},
    ObjectSpec{.name = "SCREEN1",  // aluminium, square grid
               .object_class = ObjectClass::screen,
               .pattern = Pattern::square,
               .pitch_x_m = 6.8e-3,
               .pitch_y_m = 6.8e-3,
               .radius_m = 2.6e-3,
               .depth_m = 1.0e-3,
               .roughness_m = 5e-6},
    ObjectSpec{.name = "SCREEN2",  // aluminium, hexagonal
               .object_class = ObjectClass::screen,
               .pattern = Pattern::hexagonal,
               .pitch_x_m = 4.9e-3,
               .pitch_y_m = 4.9e-3 * half_root_3,
               .radius_m = 1.7e-3,
               .depth_m = 1.0e-3,
               .roughness_m = 5e-6},
    ObjectSpec{.name = "SCREEN3",  // thick block of hard plastic: the glass under the array bends
               .object_class = ObjectClass::screen,
               .pattern = Pattern::hexagonal,
               .pitch_x_m = 5.2e-3,
               .pitch_y_m = 5.2e-3 * half_root_3,
               .radius_m = 1.4e-3,
               .depth_m = 3.0e-3,
               .roughness_m = 3e-6,
               .bow_m = 0.15e-3},
    ObjectSpec{.name = "KNIT1",  // cuff, wool
               .object_class = ObjectClass::knit,
               .pattern = Pattern::rib,
               .pitch_x_m = 1.6e-3,
               .pitch_y_m = 1.2e-3,
               .radius_m = 0.45e-3,
               .depth_m = 0.7e-3,
               .irregularity = 0.10,
               .roughness_m = 20e-6,
               .compliance_m_pa = 12e-9,
               .modulus_pa = 0.3e6},
    ObjectSpec{.name = "KNIT2",  // sweater, acrylic
               .object_class = ObjectClass::knit,
               .pattern = Pattern::stocking,
               .pitch_x_m = 2.2e-3,
               .pitch_y_m = 1.7e-3,
               .radius_m = 0.55e-3,
               .depth_m = 0.6e-3,
               .irregularity = 0.08,
               .roughness_m = 20e-6,
               .compliance_m_pa = 9e-9,
               .modulus_pa = 0.4e6},
    ObjectSpec{.name = "KNIT3",  // scarf
               .object_class = ObjectClass::knit,
               .pattern = Pattern::garter,
               .pitch_x_m = 2.6e-3,
               .pitch_y_m = 1.6e-3,
               .radius_m = 0.6e-3,
               .depth_m = 0.9e-3,
               .irregularity = 0.10,
               .roughness_m = 25e-6,
               .compliance_m_pa = 10e-9,
               .modulus_pa = 0.35e6}};

/// Height of one tooth, hole or stitch relative to its neighbours: equal in every press.
double feature_offset(const ObjectSpec& object, double column, double row) {
  if (object.irregularity == 0) return 0;
  const auto part = [](double i) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(i));
  };
  Random random(mix(mix(mix(0, object.name), part(column)), part(row)));
  return object.irregularity * object.depth_m * std::clamp(random.gaussian(), -3.0, 3.0);
}

double tooth_m(const ObjectSpec& object, double distance_m, double offset_m) {
  const double rounded = std::hypot(distance_m, tooth_tip_m) - tooth_tip_m;
  const double height = (object.depth_m + offset_m) * (1 - rounded / object.radius_m);
  return std::max(0.0, height) - object.depth_m;
}

/// Teeth are on a ground, holes in a face; the nearest features of the lattice determine the
/// height.
double lattice_m(const ObjectSpec& object, double x_m, double y_m) {
  const double shift = object.pattern == Pattern::hexagonal       ? 0.5
                       : object.pattern == Pattern::parallelogram ? 0.25
                                                                  : 0;
  const bool teeth = object.object_class == ObjectClass::rasp;
  double height = teeth ? -object.depth_m : 0;
  const double middle_row = std::round(y_m / object.pitch_y_m);
  for (double row = middle_row - 1; row <= middle_row + 1; ++row) {
    const double aside = shift * row;
    const double middle = std::round(x_m / object.pitch_x_m - aside);
    for (double column = middle - 1; column <= middle + 1; ++column) {
      const double distance =
          std::hypot(x_m - (column + aside) * object.pitch_x_m, y_m - row * object.pitch_y_m);
      if (distance > 2 * object.radius_m) continue;
      if (teeth)
        height = std::max(height, tooth_m(object, distance, feature_offset(object, column, row)));
      else if (distance < object.radius_m)
        height = -object.depth_m;
    }
  }
  return height;
}

/// Both legs of a stitch lean outwards from one course to the next; the yarn is round.
double stitch_m(const ObjectSpec& object, double x_m, double y_m) {
  const double wale = std::round(x_m / object.pitch_x_m),
               course = std::floor(y_m / object.pitch_y_m);
  const double across = std::abs(x_m / object.pitch_x_m - wale);
  const double along = y_m / object.pitch_y_m - course;
  const double from_leg = (across - (0.12 + 0.26 * along)) * object.pitch_x_m / object.radius_m;
  const double yarn = std::max(0.0, 1 - from_leg * from_leg);
  const bool down =
      object.pattern == Pattern::rib && static_cast<std::int64_t>(std::floor(wale / 2)) % 2 != 0;
  const double offset = feature_offset(object, wale, course);
  return object.depth_m * ((down ? 0.3 : 1.0) * yarn - 1) + offset * yarn;
}

/// Ridges of two courses each, with a dent between loops.
double garter_m(const ObjectSpec& object, double x_m, double y_m) {
  const double ridge = y_m / (2 * object.pitch_y_m), wale = x_m / object.pitch_x_m;
  const double crest = 0.5 + 0.5 * std::cos(2 * std::numbers::pi * ridge);
  const double loop = 0.75 + 0.25 * std::cos(2 * std::numbers::pi * wale);
  const double offset = feature_offset(object, std::round(wale), std::round(ridge));
  return object.depth_m * (crest * loop - 1) + offset * crest;
}

double face_m(const ObjectSpec& object, double x_m, double y_m) {
  switch (object.pattern) {
    case Pattern::none:
      return 0;
    case Pattern::square:
    case Pattern::hexagonal:
    case Pattern::parallelogram:
      return lattice_m(object, x_m, y_m);
    case Pattern::rib:
    case Pattern::stocking:
      return stitch_m(object, x_m, y_m);
    case Pattern::garter:
      return garter_m(object, x_m, y_m);
  }
  return 0;
}

Status check(const ObjectSpec& object) {
  const auto wrong = [&](std::string_view what, double value) {
    return fail({.code = Errc::range,
                 .where = std::string(what),
                 .what = "dimension of the object out of range",
                 .expected = "0 to 1",
                 .got = std::to_string(value),
                 .hint = "State lengths in metres"});
  };
  const std::pair<std::string_view, double> all[] = {{"pitch_x_m", object.pitch_x_m},
                                                     {"pitch_y_m", object.pitch_y_m},
                                                     {"radius_m", object.radius_m},
                                                     {"depth_m", object.depth_m},
                                                     {"irregularity", object.irregularity},
                                                     {"roughness_m", object.roughness_m},
                                                     {"bow_m", object.bow_m},
                                                     {"compliance_m_pa", object.compliance_m_pa}};
  for (const auto& [what, value] : all)
    if (!(value >= 0 && value <= 1)) return wrong(what, value);
  if (!(object.depth_m + 4 * object.roughness_m + object.bow_m <= 0.1))
    return wrong("depth_m", object.depth_m);
  if (object.pattern == Pattern::none) return {};
  for (const auto& [what, value] : {all[0], all[1], all[2]})
    if (!(value >= 1e-6)) return wrong(what, value);
  return {};
}

}  // namespace

std::string_view to_string(ObjectClass object_class) {
  constexpr std::array<std::string_view, 4> names{"planar", "rasp", "screen", "knit"};
  return names.at(static_cast<std::size_t>(object_class));
}

std::span<const ObjectSpec> ellis_objects() {
  return objects;
}

const ObjectSpec* find_object(std::string_view name) {
  const auto found = std::ranges::find(objects, name, &ObjectSpec::name);
  return found != objects.end() ? &*found : nullptr;
}

Result<HeightMap> place(const ObjectSpec& object, std::size_t rows, std::size_t cols,
                        double spacing_m, std::uint64_t seed) {
  if (auto ok = check_grid(rows, cols, spacing_m); !ok) return pass(ok.error());
  if (auto ok = check(object); !ok) return pass(ok.error(), object.name);
  Random random(mix(seed, "placement"));
  const double turn = random.uniform(-largest_turn_rad, largest_turn_rad);
  const double shift_x = object.pitch_x_m * random.uniform(-8, 8);
  const double shift_y = object.pitch_y_m * random.uniform(-8, 8);
  Random fine(mix(seed, "fine surface"));
  HeightMap map{rows, cols, spacing_m, {}};
  map.height_m.reserve(rows * cols);
  const auto centred = [&](std::size_t i, std::size_t count) {
    return (static_cast<double>(i) - 0.5 * static_cast<double>(count - 1)) * spacing_m;
  };
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < cols; ++c) {
      const double x = centred(c, cols), y = centred(r, rows);
      const double face = face_m(object, x * std::cos(turn) - y * std::sin(turn) + shift_x,
                                 x * std::sin(turn) + y * std::cos(turn) + shift_y);
      const double corners = (x * x + y * y) / (array_corner_m * array_corner_m);
      const double rough = std::clamp(fine.gaussian(), -4.0, 4.0) * object.roughness_m;
      map.height_m.push_back(face - object.bow_m * std::min(corners, 1.0) + rough);
    }
  return map;
}

SpringLaw bed_under(const ObjectSpec& object, double stiffness_pa_m) {
  return SpringLaw::linear(stiffness_pa_m / (1 + stiffness_pa_m * object.compliance_m_pa));
}

double modulus_under(const ObjectSpec& object, double modulus_pa) {
  return object.modulus_pa > 0 ? 1 / (1 / modulus_pa + 1 / object.modulus_pa) : modulus_pa;
}

}  // namespace weft::sim
