#pragma once
// Feature vectors of windows: of one, of all windows of a set of recordings, and while samples
// arrive.

#include <cstddef>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/vibro/recording.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::vibro {

/// Computes the columns of columns_of(channels, choice). Thread: one at a time.
class WindowExtractor {
 public:
  /// Refuses no channels, repeated channel names, rates that are not positive and finite.
  static Result<WindowExtractor> make(std::vector<Channel> channels, FeatureChoice choice);

  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }
  [[nodiscard]] const std::vector<Column>& columns() const { return columns_; }

  /// All finite; valid until the next call. Refuses another number of channels than channels() has,
  /// and what ChannelExtractor refuses, with the channel's name.
  Result<std::span<const double>> features(const WindowView& window);

 private:
  WindowExtractor(std::vector<Channel> channels, FeatureChoice choice);
  Status append(std::size_t channel, std::span<const double> samples);
  void append(std::size_t channel, std::span<const double> values, std::vector<double>& to) const;

  std::vector<Channel> channels_;
  FeatureChoice choice_;
  std::vector<FrameFeature> figures_;
  std::vector<Column> columns_;
  std::vector<ChannelExtractor> extractors_;
  std::vector<double> features_, bands_;
};

/// Returns the places of the windows of one recording.
using PlacesOf = std::function<std::vector<Place>(const Recording& recording)>;

/// A recording shorter than a window; it neither trains nor tests.
struct TooShort {
  std::string file;
  std::string label;
};

struct WindowSet {
  double window_s = 0.0;
  std::set<double> rates_hz;  ///< of the channels
  FeatureMatrix matrix;  ///< a row per window: file window_name(), label and group of the recording
  std::vector<Place> places;           ///< per row
  std::vector<std::size_t> recording;  ///< per row: index of its recording
  std::vector<TooShort> too_short;
};

/// The windows of all recordings without their features: places, labels and groups. Each recording
/// must have samples for every channel that it names.
WindowSet lay_out(std::span<const Recording> recordings, double window_s, const PlacesOf& places);

/// All windows of all recordings, which must have the same channels. Runs on `threads` threads (0:
/// one per core); the bits do not depend on the number.
Result<WindowSet> cut_and_extract(std::span<const Recording> recordings, double window_s,
                                  const PlacesOf& places, FeatureChoice choice,
                                  std::size_t threads = 0);

}  // namespace weft::classifier::vibro
