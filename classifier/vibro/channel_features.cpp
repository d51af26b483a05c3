#include "classifier/vibro/channel_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <string>
#include <unsupported/Eigen/FFT>

#include "classifier/features/feature_stream.hpp"
#include "classifier/vibro/bin_tables.hpp"
#include "classifier/vibro/short_time.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier::vibro {
namespace {

constexpr double least_power = 1e-10;   // librosa's amin
constexpr double deepest_share = 1e-8;  // 80 dB below the loudest bin: librosa's top_db

constexpr std::array<std::string_view, figure_count> figure_names = {
    "MEAN",     "STD",       "MAD",     "RMSE",       "CHROMA",
    "CENTROID", "BANDWIDTH", "ROLLOFF", "PERCEPTUAL", "ZCR"};

double& at(ChannelFeatures& figures, FrameFeature which) {
  return figures[static_cast<std::size_t>(which)];
}

Status check_size(std::span<const double> samples) {
  if (!samples.empty() && samples.size() <= ChannelExtractor::most_samples) return {};
  return fail({.code = Errc::range,
               .what = "number of samples in a window out of range",
               .expected = "1 to " + std::to_string(ChannelExtractor::most_samples),
               .got = std::to_string(samples.size())});
}

Status check_samples(std::span<const double> samples) {
  if (auto ok = check_size(samples); !ok) return ok;
  if (const std::size_t bad = first_not_finite(samples); bad < samples.size())
    return not_finite("sample " + std::to_string(bad), "sample", samples[bad]);
  return {};
}

tl::unexpected<Error> overflowed(std::string_view feature, std::span<const double> samples) {
  double largest = 0.0;
  for (const double v : samples) largest = std::max(largest, std::abs(v));
  return fail({.code = Errc::range,
               .where = std::string(feature),
               .what = "samples too large for a finite feature",
               .got = "magnitude " + format_number(largest)});
}

// Range of hops of one frame; each frame has `hops` hops, and the first is centred on sample 0.
// Hops beyond the ends are empty.
struct FrameHops {
  std::ptrdiff_t first, end;  // the existing hops of one frame
  FrameHops(std::size_t frame, FrameSize size, std::size_t existing)
      : first(static_cast<std::ptrdiff_t>(frame) - static_cast<std::ptrdiff_t>(size.hops() / 2)),
        end(std::min(first + static_cast<std::ptrdiff_t>(size.hops()),
                     static_cast<std::ptrdiff_t>(existing))) {}
};

double mean_rms(FrameSize size, std::size_t samples, const std::vector<double>& hop_squares) {
  double sum = 0.0;
  for (std::size_t f = 0; f < size.count(samples); ++f) {
    const FrameHops hops(f, size, hop_squares.size());
    double squares = 0.0;
    for (std::ptrdiff_t h = std::max<std::ptrdiff_t>(hops.first, 0); h < hops.end; ++h)
      squares += hop_squares[static_cast<std::size_t>(h)];
    sum += std::sqrt(squares / static_cast<double>(size.length));
  }
  return sum / static_cast<double>(size.count(samples));
}

// A change of sign counts at its second sample; the first sample of a frame has no sample before
// it.
double mean_crossing_rate(FrameSize size, std::span<const double> samples,
                          const std::vector<std::size_t>& hop_crossings) {
  std::size_t sum = 0;
  const std::size_t frames = size.count(samples.size());
  for (std::size_t f = 0; f < frames; ++f) {
    const FrameHops hops(f, size, hop_crossings.size());
    for (std::ptrdiff_t h = std::max<std::ptrdiff_t>(hops.first, 0); h < hops.end; ++h)
      sum += hop_crossings[static_cast<std::size_t>(h)];
    const std::size_t start =
        hops.first > 0 ? static_cast<std::size_t>(hops.first) * size.hop : samples.size();
    if (start < samples.size()) sum -= changes_of_sign(samples.subspan(start - 1, 2));
  }
  return static_cast<double>(sum) / static_cast<double>(size.length) / static_cast<double>(frames);
}

constexpr std::size_t first_bin = 2;  // lower bins have the level, spread by the window
constexpr double least_band_power = 1e-10;

bool smooth(std::size_t n) {
  for (const std::size_t factor : {2U, 3U, 5U})
    while (n % factor == 0) n /= factor;
  return n == 1;
}

}  // namespace

std::string_view to_string(FrameFeature figure) {
  return figure_names[static_cast<std::size_t>(figure)];
}

ChannelExtractor::Tools& ChannelExtractor::tools_for(FrameSize size) {
  return tools_.try_emplace(size.length, rate_hz_, size).first->second;
}

void ChannelExtractor::moments(std::span<const double> samples, ChannelFeatures& out) {
  const Level level = level_of(samples);
  at(out, FrameFeature::mean) = level.mean;
  at(out, FrameFeature::std) = level.deviation;
  deviation_.resize(samples.size());
  deviations(samples, median_.median(samples), deviation_.data());
  at(out, FrameFeature::mad) = median_.median(deviation_);

  const FrameSize size = FrameSize::of(samples.size());
  hop_squares_.clear();
  hop_crossings_.clear();
  for (std::size_t from = 0; from < samples.size(); from += size.hop) {
    const std::size_t to = std::min(from + size.hop, samples.size()), before = from > 0 ? 1 : 0;
    hop_squares_.push_back(sum_of_squares(samples.subspan(from, to - from)));
    hop_crossings_.push_back(changes_of_sign(samples.subspan(from - before, to - from + before)));
  }
  at(out, FrameFeature::rmse) = mean_rms(size, samples.size(), hop_squares_);
  at(out, FrameFeature::zcr) = mean_crossing_rate(size, samples, hop_crossings_);
}

/// Fills `spectra_`, `sums_` and, if given, `bands`; returns the power of the loudest bin.
double ChannelExtractor::transform(std::span<const double> samples, Tools& tools, bool chroma,
                                   BandFeatures* bands) {
  constexpr std::size_t lanes = ShortTimeSpectrum::lanes;
  const std::size_t frames = tools.frames.size().count(samples.size());
  const std::size_t block = tools.frames.bins() * lanes;
  spectra_.resize((frames + lanes - 1) / lanes * block);
  sums_.clear();
  tools.frames.start(samples);
  double loudest = 0.0;
  BandSums in_bands(tools.frames.bins());
  for (std::size_t first = 0; first < frames; first += lanes) {
    double* const bins = spectra_.data() + first / lanes * block;
    sums_.push_back(tools.frames.magnitudes(first, tools.bins, chroma, bins));
    if (bands != nullptr) in_bands.add(bins, frames - first);
    for (const double magnitude : sums_.back().loudest)
      loudest = std::max(loudest, magnitude * magnitude);
  }
  if (bands != nullptr) *bands = in_bands.figures();
  return loudest;
}

void ChannelExtractor::spectral(std::span<const double> samples, bool chroma, ChannelFeatures& out,
                                BandFeatures* bands) {
  constexpr std::size_t lanes = ShortTimeSpectrum::lanes;
  Tools& tools = tools_for(FrameSize::of(samples.size()));
  const double loudest = transform(samples, tools, chroma, bands);
  const std::size_t frames = tools.frames.size().count(samples.size());
  const std::size_t block = tools.frames.bins() * lanes;
  double decibels = 0.0;
  std::size_t frame_count = 0;
  const double floor = std::max(least_power, loudest * deepest_share);
  for (std::size_t first = 0; first < frames; first += lanes) {
    const FrameFeatures f = frame_features(spectra_.data() + first / lanes * block,
                                           sums_[first / lanes], tools.bins, floor);
    for (std::size_t i = 0; i < std::min(lanes, frames - first); ++i) {
      frame_count += f.silent[i] ? 0 : 1;
      at(out, FrameFeature::centroid) += f.centroid_hz[i];
      at(out, FrameFeature::bandwidth) += f.bandwidth_hz[i];
      at(out, FrameFeature::rolloff) += f.rolloff_hz[i];
      at(out, FrameFeature::chroma) += f.chroma[i];
      decibels += f.decibels[i];
    }
  }
  const auto count = static_cast<double>(frames);
  const auto audible = static_cast<double>(std::max<std::size_t>(frame_count, 1));
  at(out, FrameFeature::centroid) /= audible;
  at(out, FrameFeature::bandwidth) /= audible;
  at(out, FrameFeature::rolloff) /= count;
  at(out, FrameFeature::chroma) /= count;
  at(out, FrameFeature::perceptual) =
      tools.bins.mean_a_weighting_db + decibels / (count * static_cast<double>(tools.bins.bins));
}

Result<ChannelFeatures> ChannelExtractor::figures(std::span<const double> samples, bool chroma,
                                                  BandFeatures* bands) {
  if (auto ok = check_samples(samples); !ok) return pass(ok.error());
  ChannelFeatures out{};
  moments(samples, out);
  spectral(samples, chroma, out, bands);
  for (std::size_t k = 0; k < out.size(); ++k)
    if (!std::isfinite(out[k])) return overflowed(figure_names[k], samples);
  if (bands != nullptr && first_not_finite(*bands) < bands->size())
    return overflowed("BAND", samples);
  return out;
}

Result<double> ChannelExtractor::mean_amplitude(std::span<const double> samples) {
  if (auto ok = check_size(samples); !ok) return pass(ok.error());
  const double out =
      whole_.mean_amplitude(samples, sum_of(samples) / static_cast<double>(samples.size()));
  if (std::isfinite(out)) return out;  // then all samples are finite
  if (auto ok = check_samples(samples); !ok) return pass(ok.error());
  return overflowed("FFT", samples);
}

std::array<std::size_t, band_count + 1> band_edges(std::size_t bins) {
  std::array<std::size_t, band_count + 1> out{};
  const double octaves = std::log2(std::max(static_cast<double>(bins) / first_bin, 1.0));
  for (std::size_t b = 0; b < out.size(); ++b) {
    const double share = static_cast<double>(b) / static_cast<double>(band_count);
    const auto edge = static_cast<std::size_t>(
        std::llround(static_cast<double>(first_bin) * std::exp2(octaves * share)));
    out[b] = b == 0 ? std::min(edge, bins) : std::min(std::max(edge, out[b - 1] + 1), bins);
  }
  return out;
}

void BandSums::add(const double* magnitudes, std::size_t frames) {
  constexpr std::size_t lanes = ShortTimeSpectrum::lanes;
  for (std::size_t b = 0; b < band_count; ++b) {
    PerFrame power{};
    for (std::size_t k = edges_[b]; k < edges_[b + 1]; ++k)
      for (std::size_t f = 0; f < lanes; ++f)
        power[f] += magnitudes[k * lanes + f] * magnitudes[k * lanes + f];
    for (std::size_t f = 0; f < std::min(frames, lanes); ++f)
      level_db_[b].push_back(10.0 * std::log10(std::max(power[f], least_band_power)));
  }
}

BandFeatures BandSums::figures() const {
  BandFeatures out{};
  for (std::size_t b = 0; b < band_count; ++b) {
    const auto n = static_cast<double>(level_db_[b].size());
    double mean = 0.0, squares = 0.0;
    for (const double level : level_db_[b]) mean += level / n;
    for (const double level : level_db_[b]) squares += (level - mean) * (level - mean);
    out[b] = mean;
    out[band_count + b] = std::sqrt(squares / n);
  }
  return out;
}

struct WholeSpectrum::MixedRadix {
  MixedRadix() { fft.SetFlag(Eigen::FFT<double>::HalfSpectrum); }
  Eigen::FFT<double> fft;
  std::vector<double> centred;
  std::vector<std::complex<double>> bins;
};

WholeSpectrum::WholeSpectrum() : mixed_radix_(std::make_unique<MixedRadix>()) {}
WholeSpectrum::~WholeSpectrum() = default;
WholeSpectrum::WholeSpectrum(WholeSpectrum&&) noexcept = default;
WholeSpectrum& WholeSpectrum::operator=(WholeSpectrum&&) noexcept = default;

double WholeSpectrum::mean_amplitude(std::span<const double> samples, double mean) {
  if (samples.size() < 2) return 0.0;
  const double sum = RealTransform::fits(samples.size()) ? by_lanes(samples, mean)
                     : smooth(samples.size())            ? by_mixed_radix(samples, mean)
                                                         : by_convolution(samples, mean);
  return sum * 2.0 / static_cast<double>(samples.size()) / static_cast<double>(samples.size() / 2);
}

double WholeSpectrum::by_lanes(std::span<const double> samples, double mean) {
  if (!round_ || round_->length() != samples.size()) round_.emplace(samples.size());
  return round_->sum_of_magnitudes(samples, mean);
}

double WholeSpectrum::by_mixed_radix(std::span<const double> samples, double mean) {
  MixedRadix& m = *mixed_radix_;
  m.centred.resize(samples.size());
  std::transform(samples.begin(), samples.end(), m.centred.begin(),
                 [=](double v) { return v - mean; });
  m.fft.fwd(m.bins, m.centred);
  double sum = 0.0;
  for (std::size_t k = 1; k <= samples.size() / 2; ++k) sum += std::sqrt(std::norm(m.bins[k]));
  return sum;
}

double WholeSpectrum::by_convolution(std::span<const double> samples, double mean) {
  constexpr std::size_t signals = 2;  // of one transform; the second one is zero
  rows_.assign(signals * samples.size(), 0.0);
  std::array<double, signals> offset{}, largest{};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    rows_[signals * i] = samples[i] - mean;
    largest[0] = std::max(largest[0], std::abs(rows_[signals * i]));
  }
  const Spectrum& spectrum = convolution_.of(samples.size());
  const double* const bins =
      spectrum.magnitudes<double>(rows_.data(), offset.data(), largest.data(), scratch_);
  double sum = 0.0;
  for (std::size_t k = 1; k < spectrum.bins(); ++k) sum += bins[signals * k];
  return sum;
}

}  // namespace weft::classifier::vibro
