#include "daemon/analysis/calibration/signal.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "sim/plant/imprint/fft.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double third_difference_gain = 20;  // 1 + 9 + 9 + 1
constexpr double iqr_of_one_sd = 1.349;       // for a normal distribution
constexpr double jump_sds = 5;
constexpr int noise_law_rounds = 20;   // rounds of weights that follow the law
constexpr double small_misfit = 0.05;  // smaller misfits count by their square
constexpr double noise_quantile = 0.25;
constexpr double least_law_share = 1e-6;  // as a share of its largest value, so that weights are
                                          // finite

std::vector<double> difference(Samples values) {
  std::vector<double> out;
  for (std::size_t i = 1; i < values.size(); ++i) out.push_back(values[i] - values[i - 1]);
  return out;
}

/// Index of sample i relative to the middle.
double centred(std::size_t i, std::size_t samples) {
  return static_cast<double>(i) - (static_cast<double>(samples) - 1) / 2;
}

std::vector<double> hann(std::size_t samples) {
  std::vector<double> out(samples);
  for (std::size_t i = 0; i < samples; ++i)
    out[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) /
                                  static_cast<double>(samples));
  return out;
}

bool holds(std::size_t band, double length_mm, double pitch_mm) {
  return band_edges_per_mm[band] * length_mm >= 1 && band_edges_per_mm[band + 1] * pitch_mm <= 0.5;
}

/// Mean squares by band for up to ColumnFft::lanes channels, starting at `first`.
class BandPower {
 public:
  BandPower(std::size_t samples, double pitch_mm)
      : pitch_mm_(pitch_mm), window_(hann(samples)), fft_(std::bit_ceil(samples)) {
    double square = 0;
    for (const double w : window_) square += w * w;
    scale_ = 2 / (square * static_cast<double>(fft_.length()));
  }

  void transform(const std::vector<std::vector<double>>& channels, std::size_t first) {
    re_.assign(fft_.length() * lanes, 0);
    im_.assign(fft_.length() * lanes, 0);
    for (std::size_t k = 0; k < lanes && first + k < channels.size(); ++k)
      for (std::size_t i = 0; i < window_.size(); ++i)
        re_[i * lanes + k] = window_[i] * channels[first + k][i];
    fft_.forward(re_.data(), im_.data());
  }

  [[nodiscard]] double mean_square(std::size_t lane, std::size_t band) const {
    double sum = 0;
    for (std::size_t k = 1; k < fft_.length() / 2; ++k) {
      const double wave_per_mm =
          static_cast<double>(k) / (static_cast<double>(fft_.length()) * pitch_mm_);
      if (wave_per_mm < band_edges_per_mm[band] || wave_per_mm >= band_edges_per_mm[band + 1])
        continue;
      const std::size_t at = fft_.reversed(k) * lanes + lane;
      sum += re_[at] * re_[at] + im_[at] * im_[at];
    }
    return sum * scale_;
  }

  static constexpr std::size_t lanes = sim::ColumnFft::lanes;

 private:
  double pitch_mm_, scale_ = 0;
  std::vector<double> window_;
  sim::ColumnFft fft_;
  std::vector<double> re_, im_;
};

/// Solves for the columns of `design` in `subset` (one bit each), with the others 0; nothing if a
/// coefficient is negative.
std::optional<Eigen::Vector3d> solve_subset(const Eigen::MatrixX3d& design,
                                            const Eigen::VectorXd& target, unsigned subset) {
  std::vector<Eigen::Index> columns;
  for (unsigned k = 0; k < 3; ++k)
    if ((subset >> k & 1U) != 0) columns.push_back(k);
  const Eigen::MatrixXd chosen = design(Eigen::all, columns);
  const Eigen::VectorXd found = chosen.colPivHouseholderQr().solve(target);
  if (!found.allFinite() || (found.array() < 0).any()) return std::nullopt;
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < columns.size(); ++k)
    out[columns[k]] = found[static_cast<Eigen::Index>(k)];
  return out;
}

/// With three columns, tries all subsets and takes the least residual.
Eigen::Vector3d solve_nonnegative(const Eigen::MatrixX3d& design, const Eigen::VectorXd& target) {
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double least = target.squaredNorm();
  for (unsigned subset = 1; subset < 8; ++subset) {
    const auto found = solve_subset(design, target, subset);
    if (!found) continue;
    const double residual = (design * *found - target).squaredNorm();
    if (residual < least) {
      least = residual;
      best = *found;
    }
  }
  return best;
}

}  // namespace

double mean(Samples values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double variance(Samples values) {
  const double middle = mean(values);
  double sum = 0;
  for (const double v : values) sum += (v - middle) * (v - middle);
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

std::optional<double> sample_sd(Samples values) {
  if (values.size() < 2) return std::nullopt;
  const auto n = static_cast<double>(values.size());
  return std::sqrt(variance(values) * n / (n - 1));
}

std::optional<double> quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nullopt;
  std::ranges::sort(values);
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

std::optional<double> median(std::vector<double> values) {
  return quantile(std::move(values), 0.5);
}

double slope(Samples values) {
  double product = 0, square = 0;
  const double middle = mean(values);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double t = centred(i, values.size());
    product += t * (values[i] - middle);
    square += t * t;
  }
  return square > 0 ? product / square : 0;
}

std::vector<double> without_line(Samples values) {
  const double middle = mean(values), rise = slope(values);
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    out[i] = values[i] - middle - rise * centred(i, values.size());
  return out;
}

double correlation(Samples a, Samples b) {
  const double mean_a = mean(a), mean_b = mean(b);
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
    ab += (a[i] - mean_a) * (b[i] - mean_b);
  }
  return aa > 0 && bb > 0 ? std::clamp(ab / std::sqrt(aa) / std::sqrt(bb), -1.0, 1.0) : 0;
}

double noise_sd(Samples values) {
  const std::vector<double> third = difference(difference(difference(values)));
  double sum = 0;
  for (const double d : third) sum += d * d;
  return third.empty() ? 0
                       : std::sqrt(sum / static_cast<double>(third.size()) / third_difference_gain);
}

double jump_share(Samples values) {
  const std::vector<double> steps = difference(values);
  if (steps.empty()) return 0;
  const double sd = (*quantile(steps, 0.75) - *quantile(steps, 0.25)) / iqr_of_one_sd;
  if (!(sd > 0)) return 0;
  const double middle = *median(steps);
  const auto jumps = std::ranges::count_if(
      steps, [&](double step) { return std::abs(step - middle) > jump_sds * sd; });
  return static_cast<double>(jumps) / static_cast<double>(steps.size());
}

std::vector<std::array<std::optional<double>, bands>> band_rms(
    const std::vector<std::vector<double>>& channels, double pitch_mm) {
  std::vector<std::array<std::optional<double>, bands>> out(channels.size());
  if (channels.empty() || channels[0].size() < 2) return out;
  const std::size_t samples = channels[0].size();
  BandPower power(samples, pitch_mm);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const std::size_t lane = c % BandPower::lanes;
    if (lane == 0) power.transform(channels, c);
    for (std::size_t band = 0; band < bands; ++band)
      if (holds(band, static_cast<double>(samples) * pitch_mm, pitch_mm))
        out[c][band] = std::sqrt(power.mean_square(lane, band));
  }
  return out;
}

std::optional<NoiseLaw> fit_noise_law(Samples level, Samples noise) {
  const auto points = static_cast<Eigen::Index>(level.size());
  if (points < 3 || !(variance(level) > 0)) return std::nullopt;
  const double scale = std::ranges::max(level);  // makes the columns similar in size
  if (!(scale > 0)) return std::nullopt;
  Eigen::MatrixX3d design(points, 3);
  Eigen::VectorXd target(points);
  for (Eigen::Index i = 0; i < points; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double l = level[at] / scale;
    design.row(i) << 1, l, l * l;
    target[i] = noise[at] * noise[at];
  }
  // Texture only adds to the noise, so the law follows the quietest quarter of the points. It is a
  // quantile of the relative misfits, computed with weights that follow them.
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(points);
  Eigen::Vector3d found;
  for (int round = 0; round < noise_law_rounds; ++round) {
    found = solve_nonnegative(weight.asDiagonal() * design, weight.cwiseProduct(target));
    const Eigen::VectorXd law = design * found;
    const Eigen::ArrayXd held = law.array().max(least_law_share * law.maxCoeff());
    const Eigen::ArrayXd off = ((target - law).array() / held).abs().max(small_misfit);
    const Eigen::ArrayXd side =
        (target.array() < law.array())
            .select(Eigen::ArrayXd::Constant(points, 1 - noise_quantile), noise_quantile);
    weight = ((side / off).sqrt() / held).matrix();
    if (!weight.allFinite()) break;
  }
  return NoiseLaw{std::sqrt(found[0]), found[1] / scale, found[2] / (scale * scale)};
}

std::optional<double> fit_exponent(Samples level, Samples noise) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < level.size(); ++i) {
    if (!(level[i] > 0) || !(noise[i] > 0)) continue;
    x.push_back(std::log(level[i]));
    y.push_back(std::log(noise[i]));
  }
  const double spread = variance(x);
  if (x.size() < 3 || !(spread > 0)) return std::nullopt;
  return correlation(x, y) * std::sqrt(variance(y) / spread);
}

}  // namespace weft::daemon::calibration
