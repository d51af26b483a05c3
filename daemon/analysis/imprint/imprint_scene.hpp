#pragma once
// The scene `imprint`: Ellis' twelve objects, pressed lightly and heavily on the simulated array
// (Ellis 1986, section 3.1).

#include <cstdint>

#include "daemon/storage/dataset/dataset.hpp"
#include "sim/plant/imprint/height_map.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::daemon {

struct ImprintSceneOptions {
  sim::Level level = sim::Level::z_plus;    ///< z or z_plus
  std::size_t side = sim::calibrated_side;  ///< side of the read part, 1 to 128 [taxels]
  std::uint64_t seed = 1;
  std::size_t presses = 1;  ///< per object and force
  sim::TaxelParams taxels = {};
};

/// Largest overshoot of a hand before it holds still, as a share of the force [E]. The cover has
/// hysteresis, so the overshoot affects the reading.
constexpr double largest_overshoot = 0.3;

/// PLANE1-light, PLANE1-heavy and so on, 12 x 2 x presses imprints; label: the class, group: the
/// object. Every press has a new position on the whole array of 128 x 128 taxels over 36 mm (choice
/// E7). It is held after an overshoot, and a part of the array at a random place is read. The set
/// is marked as simulated; the scene is stored in rig_json. Errors: unsupported for another level;
/// range for `side` or `presses`; those of the plant.
Result<Dataset> simulate_imprints(const ImprintSceneOptions& options);

}  // namespace weft::daemon
