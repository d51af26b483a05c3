#pragma once
// The strokes of a view, made by the plant with the same fabrics, mountings, patches, speeds,
// lengths and repetitions. SIMULATED.
//
// A spring presses the probe; its stiffness is a parameter. A soft spring keeps the force, a stiff
// one the height; then long waves are common to all pads. The fabric has relaxed before a stroke
// starts. The force is chosen to give the recorded level (a nuisance parameter: the recorded sensor
// has another gain than the plant's). If phase S was recorded with the probe on the fabric, counts
// are relative to that load, and a wrench gives its share of the force (press.hpp). For a sensor
// with more counts than the plant's, counts are scaled (ClothModel::scale()).
//
// One frame of the plant is one sample of the recording, whatever its rate: path and noise are per
// sample, and all times of the plant are scaled by the ratio of the rates.

#include <array>
#include <cstdint>
#include <memory>

#include "daemon/analysis/calibration/cloth_model.hpp"
#include "sim/plant/plant.hpp"

namespace weft::daemon::calibration {

/// The strokes on one piece in one mounting.
struct SceneGroup {
  std::string cloth;
  std::uint32_t mounting = 0;
  double rate_hz = 0;
  std::vector<std::size_t> strokes;  ///< indices in the view, in its order
};

class Scene {
 public:
  /// `model` must outlive the scene. Errors: unsupported for an array with more channels than the
  /// plant's.
  static Result<Scene> make(const RecordingView& like, const ClothModel& model);

  /// Strokes in the order of `like`. Groups are computed independently, so the number of threads
  /// does not change the result. A group is not computed again if its parameters equal those of one
  /// of its last two calls. Texture tiles are kept while surface and seed are unchanged. Errors:
  /// range for values that the plant refuses.
  Result<RecordingView> simulate(std::span<const double> values, std::uint64_t seed,
                                 std::size_t threads);

 private:
  struct Made {
    std::vector<double> values;
    std::uint64_t seed = 0;
    std::vector<Stroke> strokes;
  };
  /// Texture tiles, and the values on which they depend.
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
