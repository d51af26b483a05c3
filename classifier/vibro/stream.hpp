#pragma once
// Features of windows while the samples arrive, each channel at its own rate.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "classifier/vibro/extract.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::vibro {

/// Accepts samples of every channel as they arrive. Window k begins at k times `step_s`; its
/// features are available once all channels reach its end. They have the same bits as
/// WindowExtractor's for a recording of these samples. Keeps only the samples of windows not yet
/// taken. Thread: one at a time.
class WindowStream {
 public:
  struct Timing {
    double window_s = 1.0;
    double step_s = 1.0;  ///< time between two starts
  };
  /// Refuses what WindowExtractor refuses, and times that are not positive or less than a sample.
  static Result<WindowStream> make(std::vector<Channel> channels, FeatureChoice choice,
                                   Timing timing);

  [[nodiscard]] const std::vector<Column>& columns() const { return extractor_.columns(); }
  /// Windows taken so far.
  [[nodiscard]] std::size_t taken() const { return taken_; }

  /// Adds the next samples of a channel. Refuses an unknown channel and non-finite samples; the
  /// stream does not change then.
  Status add(std::size_t channel, std::span<const double> samples);
  /// The next window, if it is complete: valid until the next call of any function.
  Result<std::optional<std::span<const double>>> next();

 private:
  WindowStream(WindowExtractor extractor, Timing timing);

  WindowExtractor extractor_;
  Timing timing_;
  std::size_t taken_ = 0;
  struct Waiting {
    std::size_t dropped = 0;  // samples before the first one kept
    std::vector<double> retained;
  };
  std::vector<Waiting> waiting_;
};

}  // namespace weft::classifier::vibro
