#include "classifier/features/extract.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "classifier/features/signal.hpp"
#include "classifier/features/spectrum.hpp"

namespace weft::classifier {
namespace {

// The twelve numbers of one taxel, in the order of taxel_blocks.
constexpr std::size_t blocks = taxel_blocks.size();
constexpr std::size_t time_blocks = blocks - 2;

Status check(const Trial& trial, const FeatureOptions& options) {
  if (trial.taxels == 0) return fail(Errc::invalid_argument, "trial without taxels", trial.file);
  if (trial.counts.size() != trial.samples() * trial.taxels) {
    return fail(Errc::invalid_argument, "samples and phases disagree", trial.file,
                std::to_string(trial.samples() * trial.taxels) + " values",
                std::to_string(trial.counts.size()));
  }
  const auto bad = std::find_if_not(trial.counts.begin(), trial.counts.end(),
                                    [](double v) { return std::isfinite(v); });
  if (bad != trial.counts.end()) {
    const auto at = static_cast<std::size_t>(bad - trial.counts.begin());
    return fail(Errc::invalid_argument, "sample is not finite",
                trial.file + ": sample " + std::to_string(at / trial.taxels) + ", taxel " +
                    std::to_string(at % trial.taxels + 1),
                "a finite count", std::to_string(*bad), "Repair or drop the recording");
  }
  if (!(options.mode_bin_counts > 0.0 && std::isfinite(options.mode_bin_counts))) {
    return fail(Errc::invalid_argument, "unusable bin of the mode", "mode_bin_counts",
                "a positive number", std::to_string(options.mode_bin_counts));
  }
  return {};
}

// Mean over all taxels and all samples of one phase; absent when the phase is.
std::optional<double> pad_mean(const Trial& trial, Phase phase) {
  double sum = 0.0;
  std::size_t samples = 0;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] != phase) continue;
    const auto row = trial.row(i);
    sum = std::accumulate(row.begin(), row.end(), sum);
    ++samples;
  }
  if (samples == 0) return std::nullopt;
  return sum / static_cast<double>(samples * trial.taxels);
}

void append_lead(const Trial& trial, std::vector<double>& out) {
  const auto press = pad_mean(trial, Phase::press);
  if (!press) return;
  out.push_back(*press);
  if (const auto rest = pad_mean(trial, Phase::rest)) out.push_back(*rest - *press);
  if (const auto end = pad_mean(trial, Phase::end)) out.push_back(*press - *end);
}

double norm_of(std::span<const double> signal, Norm kind) {
  double sum = 0.0;
  for (const double v : signal) sum += v * v;
  return std::sqrt(kind == Norm::rms ? sum / static_cast<double>(signal.size()) : sum);
}

Status check_finite(const std::vector<double>& features, const Trial& trial) {
  const auto bad =
      std::find_if_not(features.begin(), features.end(), [](double v) { return std::isfinite(v); });
  if (bad == features.end()) return {};
  const FeatureLayout layout(trial.taxels, phases_of(trial));
  const auto& column = layout.columns()[static_cast<std::size_t>(bad - features.begin())];
  return fail(Errc::range, "feature " + column.name + " overflows", trial.file,
              "counts of a sensor", {}, "Are these raw counts?");
}

}  // namespace

struct FeatureExtractor::Workspace {
  std::vector<std::vector<double>> signal;  // [taxels][samples of phase M]
  std::vector<double> peaks;
  std::optional<Spectrum> spectrum;
  std::vector<double> bins_a, bins_b;

  void gather(const Trial& trial) {
    signal.resize(trial.taxels);
    for (auto& s : signal) s.clear();
    for (std::size_t i = 0; i < trial.samples(); ++i) {
      if (trial.phase[i] != Phase::motion) continue;
      const auto row = trial.row(i);
      for (std::size_t k = 0; k < row.size(); ++k) signal[k].push_back(row[k]);
    }
  }

  void time_features(std::span<const double> s, const FeatureOptions& options, double* out,
                     std::size_t stride);
  void spectral_features(const FeatureOptions& options, double* out, std::size_t stride);
};

void FeatureExtractor::Workspace::time_features(std::span<const double> s,
                                                const FeatureOptions& options, double* out,
                                                std::size_t stride) {
  const auto n = static_cast<double>(s.size());
  const Moments m = moments_of(s);
  const auto [low, high] = std::minmax_element(s.begin(), s.end());
  local_maxima(s, peaks);
  const double values[time_blocks] = {
      *high,
      *low,
      m.mean,
      s.size() > 1 ? m.m2 * n / (n - 1.0) : 0.0,
      norm_of(s, options.norm),
      m.constant || s.size() < 4 ? 3.0 : m.m4 / (m.m2 * m.m2),
      skewness_of(options.skew == SkewOf::peaks ? std::span<const double>(peaks) : s),
      *high - *low,
      mode_of(s, options.mode_bin_counts),
      m.m5};
  for (std::size_t b = 0; b < time_blocks; ++b) out[b * stride] = values[b];
}

// The last two blocks of all taxels, two signals per transform. The mean is removed (otherwise the
// largest bin is DC), no window, the exact length.
void FeatureExtractor::Workspace::spectral_features(const FeatureOptions& options, double* out,
                                                    std::size_t stride) {
  const std::size_t length = signal.front().size();
  if (!spectrum || spectrum->length() != length) spectrum.emplace(length);
  const std::size_t top = length / 2;
  bins_a.resize(top + 1);
  bins_b.resize(top + 1);
  const double scale =
      options.spectrum == SpectrumScale::amplitude ? 2.0 / static_cast<double>(length) : 1.0;
  const auto store = [&](const std::vector<double>& bins, std::size_t taxel) {
    const auto from = bins.begin() + 1;
    const auto upper = bins.begin() + static_cast<std::ptrdiff_t>(top / 2 + 1);
    out[taxel] = top < 1 ? 0.0 : scale * *std::max_element(from, bins.end());
    out[stride + taxel] = top < 1 ? 0.0 : scale * std::accumulate(upper, bins.end(), 0.0);
  };
  for (auto& s : signal) {
    const Moments m = moments_of(s);
    for (double& v : s) v = m.constant ? 0.0 : v - m.mean;
  }
  for (std::size_t k = 0; k < signal.size(); k += 2) {
    const std::size_t partner = std::min(k + 1, signal.size() - 1);
    spectrum->magnitudes(signal[k], signal[partner], bins_a, bins_b);
    store(bins_a, k);
    if (partner != k) store(bins_b, partner);
  }
}

FeatureExtractor::FeatureExtractor(FeatureOptions options)
    : options_(options), work_(std::make_unique<Workspace>()) {}
FeatureExtractor::~FeatureExtractor() = default;
FeatureExtractor::FeatureExtractor(FeatureExtractor&&) noexcept = default;
FeatureExtractor& FeatureExtractor::operator=(FeatureExtractor&&) noexcept = default;

Result<std::vector<double>> FeatureExtractor::extract(const Trial& trial) {
  if (auto ok = check(trial, options_); !ok) return pass(ok.error());
  work_->gather(trial);
  if (work_->signal.front().empty()) {
    return fail(Errc::invalid_argument, "phase M is empty", trial.file, "at least one sample", "0",
                "Every trial needs its motion");
  }
  std::vector<double> out;
  append_lead(trial, out);
  const std::size_t lead = out.size();
  const std::size_t stride = trial.taxels;
  out.resize(lead + blocks * stride);
  for (std::size_t k = 0; k < stride; ++k) {
    work_->time_features(work_->signal[k], options_, out.data() + lead + k, stride);
  }
  work_->spectral_features(options_, out.data() + lead + time_blocks * stride, stride);
  if (auto ok = check_finite(out, trial); !ok) return pass(ok.error());
  return out;
}

Result<std::vector<double>> extract(const Trial& trial, const FeatureOptions& options) {
  return FeatureExtractor(options).extract(trial);
}

}  // namespace weft::classifier
