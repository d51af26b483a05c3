#pragma once
// The twelve objects of Ellis (1986), section 3.1, as height maps made from parameters. Classes,
// lattices and pitches are the paper's; depths, radii, roughness and compliance are [E].

#include <cstdint>
#include <span>
#include <string_view>

#include "sim/plant/imprint/height_map.hpp"

namespace weft::sim {

enum class ObjectClass : std::uint8_t { planar, rasp, screen, knit };
std::string_view to_string(ObjectClass object_class);

/// Layout of the teeth or holes of a face, or of its stitches.
enum class Pattern : std::uint8_t {
  none,           ///< a plane
  square,         ///< holes
  hexagonal,      ///< holes; every other row shifted by half a pitch
  parallelogram,  ///< teeth; every row shifted by a quarter of a pitch
  rib,            ///< stitches: two wales up, two wales down
  stocking,       ///< stitches: all wales up
  garter          ///< stitches: ridges along the courses
};

/// Parameters of a face.
struct ObjectSpec {
  std::string_view name;
  ObjectClass object_class = ObjectClass::planar;
  Pattern pattern = Pattern::none;
  double pitch_x_m = 0;        ///< centre to centre along a row; of a knit: one wale
  double pitch_y_m = 0;        ///< from row to row; of a knit: one course
  double radius_m = 0;         ///< of a tooth's foot, of a hole, of the yarn
  double depth_m = 0;          ///< of the ground below the highest points
  double irregularity = 0;     ///< rms of single features' heights, as a share of the depth
  double roughness_m = 0;      ///< rms of the fine surface, independent for each taxel
  double bow_m = 0;            ///< height loss at a corner of the 36 mm array by a bent support
  double compliance_m_pa = 0;  ///< of the object's own surface (Z); 0: rigid
  double modulus_pa = 0;       ///< E* of the object itself (Z+); 0: rigid
};

/// PLANE1 to KNIT3: three per class, in the order of the paper.
std::span<const ObjectSpec> ellis_objects();
/// nullptr if none has this name.
const ObjectSpec* find_object(std::string_view name);

/// One placement of an object on the array. Teeth, holes and stitches belong to the object and are
/// constant; position, rotation and the fine surface follow from the seed. Errors: range, for a
/// grid that `check_grid` refuses, a pattern without pitch or a number in the object that is not
/// within 0 to 1 m (irregularity: 0 to 1).
Result<HeightMap> place(const ObjectSpec& object, std::size_t rows, std::size_t cols,
                        double spacing_m, std::uint64_t seed);

constexpr double cover_stiffness_pa_m = 3e8;  ///< of the array's rubber cover as springs [E]
constexpr double cover_modulus_pa = 2e6;      ///< E* of the cover [E]
/// Cover and object in series.
SpringLaw bed_under(const ObjectSpec& object, double stiffness_pa_m = cover_stiffness_pa_m);
double modulus_under(const ObjectSpec& object, double modulus_pa = cover_modulus_pa);

}  // namespace weft::sim
