#pragma once
// The ten features of an imprint at one scale of smoothing, and of several scales side by side
// (Ellis 1986, sections 3.3 and 3.4.1).

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/imprint/image.hpp"
#include "classifier/imprint/step_edges.hpp"

namespace weft::classifier::imprint {

// Mean and spread of the edges and extrema of an imprint: of lengths, and of directions.

struct Moments {
  double mean = 0;       ///< 0 without values
  double deviation = 0;  ///< biased; 0 for fewer than two values
};
Moments moments(std::span<const double> values);

/// Spread of the orientations of edges (choice E3).
enum class OrientationSpread {
  /// sqrt(-2 ln R) / 2 in radians, for directions modulo pi: an edge has no front. R is their mean
  /// resultant length, at least 1/n. 0 for fewer than two.
  circular,
  /// Standard deviation of the gradient's angle in (-pi, pi], treated like a length.
  linear
};
inline constexpr std::array<std::string_view, 2> orientation_names{"circular", "linear"};
double orientation_spread(std::span<const EdgeTaxel> edges, OrientationSpread kind);

// Local minima and maxima of a smoothed imprint (Ellis 1986, section 3.3).

/// For every taxel below (above) all of its eight neighbours: the difference to their mean, in
/// counts, in row order. Strict, and interior taxels only (choice E4): a plateau has none.
struct Extrema {
  std::vector<double> minima, maxima;
};

/// Reuses the memory of `out`.
void find_extrema(const Image& image, Extrema& out);

/// The ten of a scale, in the order of the vector:
///   edges.n     taxels on a step edge
///   edges.mean  mean strength of the steps [counts/taxel]
///   edges.std   deviation of the strength [counts/taxel]
///   edges.ori   spread of the orientations [rad]
///   min.n       local minima [taxels]
///   min.mean    mean depth below the eight neighbours [counts]
///   min.std     deviation of the depth [counts]
///   max.n       local maxima [taxels]
///   max.mean    mean height above the eight neighbours [counts]
///   max.std     deviation of the height [counts]
inline constexpr std::size_t features_per_scale = 10;

/// Selection of the ten features.
enum class Form {
  full,    ///< all ten
  brief,   ///< the paper's seven: without the spread of orientations and the mean heights
  steps,   ///< the four of the step edges (section 3.4.6)
  extrema  ///< the six of the extrema (section 3.4.6)
};
inline constexpr std::array<std::string_view, 4> form_names{"10", "7", "steps", "extrema"};
std::string_view to_string(Form form);

struct ScaleOptions {
  std::vector<double> sigmas = {1.0, 2.0, 4.0};  ///< taxels; at least one, each once
  Form form = Form::full;
  NoiseForm noise = NoiseForm::gradient;
  OrientationSpread orientation = OrientationSpread::circular;
  EdgeThresholds thresholds = {};
};

/// Extracts the features of several scales. Keeps its scratch memory; one object per thread.
class ScaleFeatures {
 public:
  /// Refuses no scale, a repeated scale, a scale that GaussianFilter refuses, unusable thresholds.
  static Result<ScaleFeatures> make(const ScaleOptions& options);

  /// Names, scale by scale: "edges.mean@2" is edges.mean at sigma 2 taxels.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

  /// [names().size()], all finite; valid until the next call. Refuses what check(image) refuses. An
  /// image without interior (fewer than 3 rows or columns) gives only zeros, and so does a constant
  /// or fully saturated one.
  Result<std::span<const double>> extract(const Image& image);

 private:
  struct Scratch {
    Image smoothed;
    Gradient gradient;
    StepEdges edges;
    Extrema extrema;
    std::vector<double> strengths;
  };

  void add_scale(const Image& image, GaussianFilter& filter);

  ScaleOptions options_;
  std::vector<GaussianFilter> filters_;
  std::vector<std::string> names_;
  std::vector<double> values_;
  Scratch scratch_;
};

}  // namespace weft::classifier::imprint
