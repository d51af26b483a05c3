#pragma once
// The twelve objects of Ellis (1986), section 3.1, as height maps that are made from parameters.
// Classes, lattices and pitches are the paper's; depths, radii, roughness and give are [E].

#include <cstdint>
#include <span>
#include <string_view>

#include "sim/plant/imprint/height_map.hpp"

namespace weft::sim {

enum class ObjectClass : std::uint8_t { planar, rasp, screen, knit };
std::string_view to_string(ObjectClass object_class);

/// How the teeth or holes of a face are laid out, or what its stitches do.
enum class Pattern : std::uint8_t {
  none,           ///< a plane
  square,         ///< holes
  hexagonal,      ///< holes; every other row half a pitch aside
  parallelogram,  ///< teeth; every row a quarter of a pitch further
  rib,            ///< stitches: two wales up, two wales down
  stocking,       ///< stitches: all wales up
  garter          ///< stitches: ridges along the courses
};

/// A face as parameters.
struct ObjectSpec {
  std::string_view name;
  ObjectClass object_class = ObjectClass::planar;
  Pattern pattern = Pattern::none;
  double pitch_x_m = 0;        ///< centre to centre along a row; of a knit: one wale
  double pitch_y_m = 0;        ///< from row to row; of a knit: one course
  double radius_m = 0;         ///< of a tooth's foot, of a hole, of the yarn
  double depth_m = 0;          ///< of the ground below the highest points
  double irregularity = 0;     ///< rms of single features' heights, as a share of the depth
  double roughness_m = 0;      ///< rms of the fine surface, taxel by taxel
  double bow_m = 0;            ///< what a corner of the 36 mm array loses to a bent support
  double compliance_m_pa = 0;  ///< of the object's own surface (Z); 0: rigid
  double modulus_pa = 0;       ///< E* of the object itself (Z+); 0: rigid
};

/// PLANE1 to KNIT3: three of a class, in the order of the paper.
std::span<const ObjectSpec> ellis_objects();
/// nullptr where none of them has this name.
const ObjectSpec* find_object(std::string_view name);

/// One placement of an object on the array. Teeth, holes and stitches are the object's and stay as
/// they are; where it lies, how it is turned and the fine surface follow from the seed.
/// Errors: range, for a grid that `check_grid` refuses, a pattern without pitch or a number in the
/// object that is not within 0 to 1 m (irregularity: 0 to 1).
Result<HeightMap> place(const ObjectSpec& object, std::size_t rows, std::size_t cols,
                        double spacing_m, std::uint64_t seed);

constexpr double cover_stiffness_pa_m = 3e8;  ///< of the array's rubber cover as springs [E]
constexpr double cover_modulus_pa = 2e6;      ///< E* of the cover [E]
/// Cover and object, one behind the other.
SpringLaw bed_under(const ObjectSpec& object, double stiffness_pa_m = cover_stiffness_pa_m);
double modulus_under(const ObjectSpec& object, double modulus_pa = cover_modulus_pa);

}  // namespace weft::sim
