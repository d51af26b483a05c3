#pragma once
// The strokes of a view, made by the plant: same cloths, mountings, patches, speeds, lengths and
// repetitions. SIMULATED.
//
// The probe is pressed by a spring, whose stiffness is a parameter: a soft one holds the force, a
// stiff one the height, and then long waves are common to all pads. The cloth has relaxed before a
// stroke begins. Force there: that which gives the recorded level (a nuisance: the recorded sensor
// has another gain than the plant's). Where phase S was recorded with the probe on the cloth,
// counts are above that load: a wrench gives its share of the force (press.hpp). A sensor that
// reads more counts than the plant's can has its counts scaled down (ClothModel::scale()).
//
// Frames of the plant are taken for samples of the recording, whatever its rate: path and noise are
// per sample, and all times of the plant are scaled by the ratio of the rates.

#include <array>
#include <cstdint>
#include <memory>

#include "daemon/analysis/calibration/cloth_model.hpp"
#include "sim/plant/plant.hpp"

namespace weft::daemon::calibration {

/// What one piece in one mounting sees.
struct SceneGroup {
  std::string cloth;
  std::uint32_t mounting = 0;
  double rate_hz = 0;
  std::vector<std::size_t> strokes;  ///< of the view, in its order
};

class Scene {
 public:
  /// `model` must outlive it. Errors: unsupported, for an array of more channels than the plant's.
  static Result<Scene> make(const RecordingView& like, const ClothModel& model);

  /// Strokes in the order of `like`. Groups are computed apart, so that the number of threads
  /// changes nothing, and a group whose parameters are those of one of its last two calls is not
  /// computed again. Tiles of texture are kept while surface and seed stay. Errors: range, for
  /// values that the plant refuses.
  Result<RecordingView> simulate(std::span<const double> values, std::uint64_t seed,
                                 std::size_t threads);

 private:
  struct Made {
    std::vector<double> values;
    std::uint64_t seed = 0;
    std::vector<Stroke> strokes;
  };
  /// Tiles of texture, and what they depend on.
  struct Textured {
    std::vector<double> values;
    std::uint64_t seed = 0;
    std::shared_ptr<const sim::Plant> plant;
  };
  struct Job {
    SceneGroup group;
    std::array<Made, 2> made;
    Textured textured;
  };
  Scene(const RecordingView& like, const ClothModel& model) : like_(like), model_(&model) {}
  [[nodiscard]] std::vector<double> values_of(const SceneGroup& group,
                                              std::span<const double> values) const;
  [[nodiscard]] Textured texture_of(const SceneGroup& group, std::span<const double> values,
                                    std::uint64_t seed) const;
  Status make_group(Job& job, std::span<const double> values, std::uint64_t seed) const;
  Result<std::vector<Stroke>> slide(Job& job, std::span<const double> values,
                                    std::uint64_t seed) const;

  RecordingView like_;
  const ClothModel* model_;
  std::vector<Job> jobs_;
};

}  // namespace weft::daemon::calibration
