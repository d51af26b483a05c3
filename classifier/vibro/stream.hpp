#pragma once
// Features of windows while the samples come in, each channel at its own pace.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "classifier/vibro/extract.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::vibro {

/// Takes samples of every channel as they arrive and gives the features of window k, which begins
/// at k times `step_s`, once all channels have come to its end: the same bits that
/// WindowExtractor gives for the same samples of a recording. Keeps no more than the samples of the
/// windows that are not taken yet. Not for two threads at once.
class WindowStream {
 public:
  struct Timing {
    double window_s = 1.0;
    double step_s = 1.0;  ///< from one start to the next
  };
  /// Refuses what WindowExtractor refuses, and times that are not positive or less than a sample.
  static Result<WindowStream> make(std::vector<Channel> channels, FeatureChoice choice,
                                   Timing timing);

  [[nodiscard]] const std::vector<Column>& columns() const { return extractor_.columns(); }
  /// Windows taken so far.
  [[nodiscard]] std::size_t taken() const { return taken_; }

  /// The next samples of a channel. Refuses a channel that does not exist and samples that are not
  /// finite; the stream is then as before.
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
