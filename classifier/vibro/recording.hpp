#pragma once
// A recording of several channels of different rates, the windows that are cut from it, and the
// sets of features of the 2023 paper with their names and units.

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
  std::string unit;      ///< of a sample: "count", "m/s^2"; "1" where it has none
  friend bool operator==(const Channel&, const Channel&) = default;
};

/// By how much the rates of two recordings of one sensor may differ: the clocks of two sensors of
/// one model are off by 100 ppm each.
inline constexpr double clock_tolerance = 2e-4;
/// Whether recordings of both can be compared: the same names and units in the same order, rates
/// within clock_tolerance.
bool same_sensor(const std::vector<Channel>& a, const std::vector<Channel>& b);

/// "S 8000.000000 Hz [Pa], X 200.000000 Hz [m/s2]", for messages.
std::string format_channels(const std::vector<Channel>& channels);

enum class Family {
  smmrp,     ///< the five that the paper kept: MEAN, STD, MAD, RMSE, PERCEPTUAL
  smmrp10,   ///< all ten figures, before the paper's selection
  fft,       ///< one number per channel: the mean amplitude of its spectrum (S6)
  smmrpfft,  ///< smmrp, then fft
  all,       ///< smmrp10, then fft
  bands,     ///< ours: power in sixteen bands, its mean and deviation over the frames
  wide,      ///< ours: all, then bands
};
std::string_view to_string(Family family);
Result<Family> family_from(std::string_view text);

/// What happens to a figure that every channel has (S1).
enum class Combine {
  mean,   ///< its mean over the channels, whatever their units: the paper's ten columns
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

/// The figures of a family, in their order; none of `fft`.
std::vector<FrameFeature> features_of_family(Family family);
bool has_fft(Family family);
bool has_bands(Family family);
/// Figures (channel by channel with concat), then FFT channel by channel, then bands as figures.
std::vector<Column> columns_of(const std::vector<Channel>& channels, FeatureChoice choice);

/// Seconds from the begin of a recording that no window may hold a sample of: another phase, or (of
/// no duration) a pause between two samples.
struct Gap {
  double from_s = 0.0, to_s = 0.0;
  friend bool operator==(const Gap&, const Gap&) = default;
};

struct Recording {
  std::string file;   ///< unique in its data set
  std::string label;  ///< texture
  std::string group;  ///< what must not be split between training and test
  std::vector<Channel> channels;
  std::vector<std::vector<double>> samples;    ///< per channel, from the same instant on
  std::vector<Gap> gaps = {};                  ///< ascending, apart from each other
  std::vector<std::string> group_values = {};  ///< by which it can be grouped besides

  /// Of the shortest channel.
  [[nodiscard]] double duration_s() const;
};

/// Samples of one window, a span per channel.
using WindowView = std::vector<std::span<const double>>;

/// First sample of a window that begins at `start_s`, and how many `window_s` has: each to the
/// nearest, so that windows of one length have the same number wherever they begin.
std::size_t first_sample(double start_s, double rate_hz);
std::size_t samples_in(double window_s, double rate_hz);

/// Refuses a window that no channel, or not every channel, holds to its end, or of which one has no
/// sample.
Result<WindowView> window_at(const Recording& recording, double start_s, double window_s);

/// Where a window lies.
struct Place {
  double start_s = 0.0;
  std::size_t block = 0;  ///< which contiguous part of the recording it lies in
};

/// A clock that the clocks of all channels meet: 5 ms for 200 Hz and 8 kHz.
inline constexpr double window_tick_s = 0.005;

/// Up to `count` different places at random on the tick, in the order drawn: the paper's "100
/// random samples without replacement", read as windows (S7). They overlap, so a split of them puts
/// the same instants on both sides. All samples of each lie in the recording, none in a gap.
std::vector<Place> random_places(const Recording& recording, double window_s, std::size_t count,
                                 std::uint64_t seed);

/// Places every `step_s` inside each of `blocks` equal parts of the recording, which begin at a
/// sample of each channel: windows of two blocks never share a sample. Behind a gap they begin
/// anew.
std::vector<Place> block_places(const Recording& recording, double window_s, std::size_t blocks,
                                double step_s);

}  // namespace weft::classifier::vibro
