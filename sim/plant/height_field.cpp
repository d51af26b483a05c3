#include "sim/plant/height_field.hpp"

#include <cmath>
#include <numbers>

#include "sim/plant/random.hpp"

namespace weft::sim {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;
constexpr int isotropic_waves = 16;
constexpr int streak_waves = 6;
constexpr double wander_shortest_m = 3e-3;  // [E] the yarn spacing varies slowly, over many yarns
constexpr double wander_longest_m = 25e-3;
constexpr double streak_drift = 0.02;  // [E] deviation of a streak from its yarn [rad]
constexpr int longest_repeat = 60;     // pitches after which every realistic weave repeats
constexpr int samples_per_pitch = 16;

double log_bessel_i0(double x) {
  return std::log(std::cyl_bessel_i(0.0, x));
}

double log_uniform(Random& random, double low, double high, int index, int count) {
  const double at = (index + random.uniform()) / count;
  return low * std::pow(high / low, at);
}

}  // namespace

double HeightField::Wander::at(double coordinate_m) const {
  double sum = 0;
  for (std::size_t i = 0; i < waves; ++i) sum += std::sin(number[i] * coordinate_m + phase[i]);
  return amplitude * sum;
}

void HeightField::add_lines(const SurfaceSpec& spec, double offset_u_rad, double offset_v_rad) {
  for (const Structure::Line& line : spec.structure.lines) {
    Term term;
    term.amplitude_m = spec.height_rms_m * std::sqrt(2 * line.share);
    term.ku = two_pi * line.warp / spec.warp_pitch_m;
    term.kv = two_pi * line.weft / spec.weft_pitch_m;
    term.phase_rad = line.phase_rad + line.warp * offset_u_rad + line.weft * offset_v_rad;
    term.jitter_u = line.warp;
    term.jitter_v = line.weft;
    terms_.push_back(term);
  }
  lattice_terms_ = terms_.size();
}

HeightField::HeightField(const SurfaceSpec& spec, std::uint64_t seed) {
  if (!(spec.height_rms_m > 0)) return;
  const Structure& structure = spec.structure;
  Random random(seed);
  for (Wander* wander : {&wander_u_, &wander_v_}) {
    wander->amplitude = structure.jitter_rad * std::sqrt(2.0 / Wander::waves);
    for (std::size_t i = 0; i < Wander::waves; ++i) {
      wander->number[i] = two_pi / log_uniform(random, wander_shortest_m, wander_longest_m,
                                               static_cast<int>(i), Wander::waves);
      wander->phase[i] = random.angle();
    }
  }
  if (spec.warp_pitch_m > 0 && spec.weft_pitch_m > 0) {
    const double offset_v_rad = longest_repeat * random.angle();
    const double offset_u_rad = longest_repeat * random.angle();
    add_lines(spec, offset_u_rad, offset_v_rad);
  }
  const auto add_wave = [&](double share, double number_per_m, double direction) {
    terms_.push_back({.amplitude_m = spec.height_rms_m * std::sqrt(2 * share),
                      .ku = two_pi * number_per_m * std::cos(direction),
                      .kv = two_pi * number_per_m * std::sin(direction),
                      .phase_rad = random.angle()});
  };
  for (int i = 0; i < isotropic_waves && structure.isotropic_share > 0; ++i) {
    const double number =
        log_uniform(random, structure.low_per_m, structure.high_per_m, i, isotropic_waves);
    add_wave(structure.isotropic_share / isotropic_waves, number, random.angle());
  }
  for (int i = 0; i < streak_waves && structure.streak_share > 0; ++i) {
    const double number =
        log_uniform(random, structure.low_per_m, structure.high_per_m, i / 2, streak_waves / 2);
    const double along = i % 2 == 0 ? 0 : std::numbers::pi / 2;
    add_wave(structure.streak_share / streak_waves, number,
             along + streak_drift * random.gaussian());
  }
}

HeightField HeightField::shifted(double u_m, double v_m) const {
  HeightField out = *this;
  for (Term& term : out.terms_) term.phase_rad += term.ku * u_m + term.kv * v_m;
  for (std::size_t i = 0; i < Wander::waves; ++i) {
    out.wander_u_.phase[i] += wander_u_.number[i] * u_m;
    out.wander_v_.phase[i] += wander_v_.number[i] * v_m;
  }
  return out;
}

double HeightField::wander(Axis axis, double at_m) const {
  return axis == Axis::u ? wander_u_.at(at_m) : wander_v_.at(at_m);
}

double HeightField::phase(const Term& term, Axis axis, double at_m, double wander) {
  if (axis == Axis::u) return term.ku * at_m + term.jitter_u * wander + term.phase_rad;
  return term.kv * at_m + term.jitter_v * wander;
}

int HeightField::lattice_repeat() const {
  const auto whole = [](double cycles) { return std::abs(cycles - std::round(cycles)) < 1e-9; };
  for (int repeat = 1; repeat < longest_repeat; ++repeat) {
    bool fits = true;
    for (std::size_t k = 0; k < lattice_terms_; ++k)
      fits = fits && whole(repeat * terms_[k].jitter_u) && whole(repeat * terms_[k].jitter_v);
    if (fits) return repeat;
  }
  return longest_repeat;
}

/// Height of the lattice alone, in steps of 1/samples_per_pitch of a pitch.
double HeightField::lattice_height_m(int i, int j) const {
  double height = 0;
  for (std::size_t k = 0; k < lattice_terms_; ++k) {
    const Term& term = terms_[k];
    const double cycles = (term.jitter_u * i + term.jitter_v * j) / samples_per_pitch;
    height += term.amplitude_m * std::cos(two_pi * cycles + term.phase_rad);
  }
  return height;
}

double HeightField::log_mean_response(double lambda_m) const {
  double log_mean = 0;
  for (std::size_t k = lattice_terms_; k < terms_.size(); ++k)
    log_mean += log_bessel_i0(terms_[k].amplitude_m / lambda_m);
  if (lattice_terms_ == 0) return log_mean;
  // The phases of its lines do not average out independently (their sums are commensurate), so
  // whole repeats are summed.
  const int points = samples_per_pitch * lattice_repeat();
  double sum = 0;
  for (int i = 0; i < points; ++i)
    for (int j = 0; j < points; ++j) sum += std::exp(lattice_height_m(i, j) / lambda_m);
  return log_mean + std::log(sum / (static_cast<double>(points) * points));
}

Waviness::Waviness(const WavinessSpec& spec, std::uint64_t seed) : flat_(!(spec.rms_m > 0)) {
  Random random(seed);
  for (std::size_t i = 0; i < waves; ++i) {
    const double direction = random.angle();
    const double turns = 1 / random.uniform(spec.shortest_wave_m, spec.longest_wave_m);
    amplitude_m_[i] = spec.rms_m * std::sqrt(2.0 / waves);
    turns_x_[i] = turns * std::cos(direction);
    turns_y_[i] = turns * std::sin(direction);
    phase_turns_[i] = random.uniform();
  }
}

Waviness Waviness::shifted(double x_m, double y_m) const {
  Waviness out = *this;
  for (std::size_t i = 0; i < waves; ++i)
    out.phase_turns_[i] += turns_x_[i] * x_m + turns_y_[i] * y_m;
  return out;
}

Waviness::Tangent Waviness::tangent(double x_m, double y_m) const {
  if (flat_) return {};
  const simd::Lanes x = simd::load(turns_x_.data()), y = simd::load(turns_y_.data());
  const simd::Lanes turns = x * x_m + y * y_m + simd::load(phase_turns_.data());
  const simd::Lanes amplitude = simd::load(amplitude_m_.data());
  const simd::Turned angle = simd::turned(turns);
  const simd::Lanes fall = (-2 * std::numbers::pi) * amplitude * angle.sine;
  return {simd::sum(amplitude * angle.cosine), simd::sum(x * fall), simd::sum(y * fall)};
}

}  // namespace weft::sim
