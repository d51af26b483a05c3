#include "classifier/features/feature_stream.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>

namespace weft::classifier {
namespace {

std::vector<TaxelBlock> blocks_of(std::size_t taxels) {
  std::vector<TaxelBlock> out;
  for (std::size_t first = 0; first < taxels; first += TaxelBlock::taxels)
    out.emplace_back(std::min(taxels - first, TaxelBlock::taxels));
  return out;
}

// Adds `v` to `sum`; returns the rounding error of the sum (Knuth's two-sum).
double add_exactly(double v, double& sum) {
  const double next = sum + v, part = next - sum;
  const double lost = (sum - (next - part)) + (v - part);
  sum = next;
  return lost;
}

// Checks the exponents of all values in one pass, as usually all are finite.
WEFT_CLONES("arch=x86-64-v4", "avx2")
bool all_finite(const double* values, std::size_t count) {
  constexpr std::uint64_t exponent = 0x7ffULL << 52;
  std::uint64_t bad = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t bits = std::bit_cast<std::uint64_t>(values[i]);
    bad |= (bits & exponent) == exponent ? 1U : 0U;
  }
  return bad == 0;
}

// Whole blocks are the usual case; they are copied without a call.
void copy_some(const TaxelBlock::PerTaxel& from, std::size_t count, double* to) {
  if (count == from.size()) {
    std::copy_n(from.begin(), from.size(), to);
  } else {
    std::copy_n(from.begin(), count, to);
  }
}

}  // namespace

std::size_t first_not_finite(std::span<const double> values) {
  if (all_finite(values.data(), values.size())) return values.size();
  const auto bad =
      std::find_if_not(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  return static_cast<std::size_t>(bad - values.begin());
}

tl::unexpected<Error> not_finite(std::string where, const std::string& what, double got) {
  return fail({.code = Errc::invalid_argument,
               .where = std::move(where),
               .what = what + " not finite",
               .expected = "a finite number",
               .got = std::to_string(got)});
}

Status check_motion_frames(std::size_t frames, std::size_t taxels) {
  const std::size_t most = FeatureStream::most_motion_frames(taxels);
  if (frames <= most) return {};
  return fail({.code = Errc::range,
               .what = "phase M too long",
               .expected = "at most " + std::to_string(most) + " samples",
               .got = std::to_string(frames),
               .hint = "Cut the trial into windows"});
}

FeatureStream::FeatureStream(std::size_t taxels, FeatureOptions options)
    : taxels_(taxels), options_(options), blocks_(blocks_of(taxels)) {
  WEFT_ASSERT(taxels > 0);
  restart();
}

void FeatureStream::PadSum::restart(std::size_t taxels) {
  if (frames > 0 || sum.size() != taxels) {
    sum.assign(taxels, 0.0);
    lost.assign(taxels, 0.0);
  }
  frames = 0;
}

void FeatureStream::PadSum::add(const double* counts, std::size_t more) {
  const std::size_t taxels = sum.size();
  double* const __restrict sums = sum.data();
  double* const __restrict rest = lost.data();
  for (const double* const end = counts + more * taxels; counts != end; counts += taxels)
    for (std::size_t k = 0; k < taxels; ++k) rest[k] += add_exactly(counts[k], sums[k]);
  frames += more;
}

void FeatureStream::restart() {
  for (PadSum* phase : {&rest_, &press_, &end_}) phase->restart(taxels_);
  for (TaxelBlock& block : blocks_) block.clear();
}

Status FeatureStream::add(Phase phase, std::span<const double> counts) {
  if (counts.size() % taxels_ != 0) {
    return fail({.code = Errc::invalid_argument,
                 .where = "feature stream",
                 .what = "incomplete frame",
                 .expected = "a multiple of " + std::to_string(taxels_) + " counts",
                 .got = std::to_string(counts.size())});
  }
  const std::size_t bad = first_not_finite(counts);
  if (bad < counts.size()) {
    return fail({.code = Errc::invalid_argument,
                 .where = "frame " + std::to_string(bad / taxels_) + ", taxel " +
                          std::to_string(bad % taxels_ + 1),
                 .what = "sample not finite",
                 .expected = "a finite number",
                 .got = std::to_string(counts[bad])});
  }
  if (phase == Phase::motion) {
    if (auto ok = check_motion_frames(motion_frames() + counts.size() / taxels_, taxels_); !ok)
      return ok;
  }
  add_checked(phase, counts);
  return {};
}

void FeatureStream::add_checked(Phase phase, std::span<const double> counts) {
  const std::size_t frames = counts.size() / taxels_;
  if (phase == Phase::motion) {
    for (std::size_t b = 0; b < blocks_.size(); ++b)
      blocks_[b].add(counts.data() + b * TaxelBlock::taxels, taxels_, frames);
    return;
  }
  if (phase == Phase::none) return;
  PadSum& sums = phase == Phase::rest ? rest_ : phase == Phase::press ? press_ : end_;
  sums.add(counts.data(), frames);
}

PhaseSet FeatureStream::phases() const {
  return {rest_.frames > 0, press_.frames > 0, end_.frames > 0};
}

// Mean over all taxels and all frames; none if the phase is absent.
std::optional<double> FeatureStream::compute_mean(const PadSum& phase) const {
  if (phase.frames == 0) return std::nullopt;
  double sum = 0.0, lost = 0.0;
  for (const double v : phase.sum) lost += add_exactly(v, sum);
  for (const double v : phase.lost) lost += v;
  return (sum + lost) / static_cast<double>(phase.frames * taxels_);
}

FeatureStream::Lead FeatureStream::lead() const {
  Lead out;
  const auto press = compute_mean(press_);
  if (!press) return out;
  out.value[out.count++] = *press;
  if (const auto rest = compute_mean(rest_)) out.value[out.count++] = *rest - *press;
  if (const auto end = compute_mean(end_)) out.value[out.count++] = *press - *end;
  return out;
}

Status FeatureStream::check_finite() const {
  const std::size_t bad = first_not_finite(features_);
  if (bad == features_.size()) return {};
  const FeatureLayout layout(taxels_, phases());
  return fail({.code = Errc::range,
               .what = "feature " + layout.columns()[bad].name + " overflows",
               .expected = "raw counts of a sensor",
               .hint = "Check that the values are raw counts"});
}

Result<std::span<const double>> FeatureStream::features(BlockSet wanted) {
  if (motion_frames() == 0) {
    return fail({.code = Errc::invalid_argument,
                 .what = "phase M empty",
                 .expected = "at least one sample",
                 .got = "0",
                 .hint = "Record each trial with its motion"});
  }
  if (!(options_.mode_bin_counts > 0.0 && std::isfinite(options_.mode_bin_counts))) {
    return fail({.code = Errc::invalid_argument,
                 .where = "mode_bin_counts",
                 .what = "bin width of the mode out of range",
                 .expected = "above 0",
                 .got = std::to_string(options_.mode_bin_counts)});
  }
  const Lead first_ones = lead();
  features_.assign(first_ones.count + taxel_blocks.size() * taxels_, 0.0);
  std::copy_n(first_ones.value.begin(), first_ones.count, features_.begin());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::size_t first = b * TaxelBlock::taxels;
    const TaxelBlock::Features of_block = blocks_[b].features(options_, tools_, wanted);
    for (std::size_t f = 0; f < of_block.size(); ++f)
      if (wanted.has(taxel_blocks[f]))
        copy_some(of_block[f], blocks_[b].used(),
                  features_.data() + first_ones.count + f * taxels_ + first);
  }
  if (Status ok = check_finite(); !ok) return pass(ok.error());
  return std::span<const double>(features_);
}

}  // namespace weft::classifier
