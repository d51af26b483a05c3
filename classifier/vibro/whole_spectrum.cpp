#include "classifier/vibro/whole_spectrum.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

namespace weft::classifier::vibro {
namespace {

bool smooth(std::size_t n) {
  for (const std::size_t factor : {2U, 3U, 5U})
    while (n % factor == 0) n /= factor;
  return n == 1;
}

}  // namespace

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
  constexpr std::size_t signals = 2;  // of one transform; the second one is silent
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
