#pragma once
// A recording of several channels with different rates, its windows, and the sets of features of
// the 2023 paper with their names and units.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/vibro/channel_features.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::vibro {

/// One source of samples.
struct Channel {
  std::string name;      ///< "S", "X", "Y", "Z"
  double rate_hz = 0.0;  ///< above 0
  std::string unit;      ///< of a sample: "count", "m/s^2"; "1" without a unit
  friend bool operator==(const Channel&, const Channel&) = default;
};

/// Largest relative difference of the rates of two recordings of one sensor. The clocks of two
/// sensors of one model are off by 100 ppm each.
inline constexpr double clock_tolerance = 2e-4;
/// True if recordings of both are comparable: the same names and units in the same order, rates
/// within clock_tolerance.
bool same_sensor(const std::vector<Channel>& a, const std::vector<Channel>& b);

/// "S 8000.000000 Hz [Pa], X 200.000000 Hz [m/s2]", for messages.
std::string format_channels(const std::vector<Channel>& channels);

enum class Family {
  smmrp,     ///< the five figures that the paper kept: MEAN, STD, MAD, RMSE, PERCEPTUAL
  smmrp10,   ///< all ten figures, before the paper's selection
  fft,       ///< one number per channel: the mean amplitude of its spectrum (S6)
  smmrpfft,  ///< smmrp, then fft
  all,       ///< smmrp10, then fft
  bands,     ///< our own: power in sixteen bands, its mean and deviation over the frames
  wide,      ///< our own: all, then bands
};
std::string_view to_string(Family family);
Result<Family> family_from(std::string_view text);

/// How the figures of the channels are combined (S1).
enum class Combine {
  mean,   ///< mean over the channels, whatever their units: the paper's ten columns
  concat  ///< a column per channel
};
std::string_view to_string(Combine combine);
Result<Combine> combine_from(std::string_view text);

struct FeatureChoice {
  Family family = Family::smmrpfft;
  Combine combine = Combine::mean;
  friend bool operator==(const FeatureChoice&, const FeatureChoice&) = default;
};

struct Column {
  std::string name;  ///< "MEAN", "MEAN.X" with concat, "FFT.X"
  std::string unit;  ///< "mixed" for a mean over channels of several units
};

/// The figures of a family, in their order; empty for `fft`.
std::vector<FrameFeature> features_of_family(Family family);
bool has_fft(Family family);
bool has_bands(Family family);
/// Figures (channel by channel with concat), then FFT channel by channel, then bands as figures.
std::vector<Column> columns_of(const std::vector<Channel>& channels, FeatureChoice choice);

/// Seconds from the start of a recording that no window may include: another phase, or (with
/// duration 0) a pause between two samples.
struct Gap {
  double from_s = 0.0, to_s = 0.0;
  friend bool operator==(const Gap&, const Gap&) = default;
};

struct Recording {
  std::string file;   ///< unique in its data set
  std::string label;  ///< texture
  std::string group;  ///< unit that a split must not divide
  std::vector<Channel> channels;
  std::vector<std::vector<double>> samples;    ///< per channel; all start at the same instant
  std::vector<Gap> gaps = {};                  ///< ascending, disjoint
  std::vector<std::string> group_values = {};  ///< other values to group by

  /// Duration of the shortest channel.
  [[nodiscard]] double duration_s() const;
};

/// Samples of one window, a span per channel.
using WindowView = std::vector<std::span<const double>>;

/// First sample of a window that begins at `start_s`, and number of samples of `window_s`. Both are
/// rounded to nearest, so windows of one duration have the same number anywhere.
std::size_t first_sample(double start_s, double rate_hz);
std::size_t samples_in(double window_s, double rate_hz);

/// Refuses a window that extends beyond the end of a channel, or that has no sample of one.
Result<WindowView> window_at(const Recording& recording, double start_s, double window_s);

/// Place of a window.
struct Place {
  double start_s = 0.0;
  std::size_t block = 0;  ///< index of the contiguous part of the recording
};

/// A period that is a multiple of the sample periods of all channels: 5 ms for 200 Hz and 8 kHz.
inline constexpr double window_tick_s = 0.005;

/// Up to `count` different random places on the tick, in the order drawn: the paper's "100 random
/// samples without replacement", read as windows (S7). They overlap, so a split of them has the
/// same instants on both sides. All samples of each lie in the recording, none in a gap.
std::vector<Place> random_places(const Recording& recording, double window_s, std::size_t count,
                                 std::uint64_t seed);

/// Places every `step_s` inside each of `blocks` equal parts of the recording. Parts begin at a
/// sample of each channel, so windows of two blocks never share a sample. After a gap the places
/// start again.
std::vector<Place> block_places(const Recording& recording, double window_s, std::size_t blocks,
                                double step_s);

}  // namespace weft::classifier::vibro
