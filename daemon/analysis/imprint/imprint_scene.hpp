#pragma once
// The scene `imprint`: Ellis' twelve objects pressed on the simulated array, lightly and heavily
// (Ellis 1986, section 3.1).

#include <cstdint>

#include "daemon/storage/dataset/dataset.hpp"
#include "sim/plant/imprint/height_map.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::daemon {

struct ImprintSceneOptions {
  sim::Level level = sim::Level::z_plus;    ///< z or z_plus
  std::size_t side = sim::calibrated_side;  ///< taxels of the part that is read, 1 to 128
  std::uint64_t seed = 1;
  std::size_t presses = 1;  ///< of each object with each force
  sim::TaxelParams taxels = {};
};

/// A hand overshoots before it holds still: by up to so much of the force [E]. The cover lets go
/// late, so that a reading remembers it.
constexpr double largest_overshoot = 0.3;

/// PLANE1-light, PLANE1-heavy and so on, 12 x 2 x presses imprints: label is the class, group the
/// object. Every press is laid on anew on the whole array of 128 x 128 taxels over 36 mm (choice
/// E7), held after an overshoot, and read by a part of it that lies anywhere. The set says that it
/// is simulated; its scene stands in rig_json. Errors: unsupported for another level, range for a
/// side or no press, and those of the plant.
Result<Dataset> simulate_imprints(const ImprintSceneOptions& options);

}  // namespace weft::daemon
