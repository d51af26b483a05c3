#include "sim/plant/modal/rubbing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "sim/plant/bounds.hpp"
#include "sim/plant/lanes.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

namespace {

using simd::Lanes;
constexpr double two_pi = 2 * std::numbers::pi;
constexpr double farthest_m = 1e3;
constexpr double longest_step_m = 1;
constexpr double largest_n = 1e6;
constexpr double largest_stiffness_n_m = 1e12;

double sinc(double x) {
  return std::abs(x) < 1e-8 ? 1 : std::sin(x) / x;
}

/// cos(2 pi turns) by its Taylor polynomial about the quarter turn: error below 1e-11.
WEFT_SIM_INLINE Lanes cosine_of_turns(const Lanes& turns) {
  constexpr double shifter = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
  const Lanes whole = (turns + shifter) - shifter;
  const Lanes rest = turns - whole;
  const Lanes y = two_pi * (0.25 - (rest < 0 ? -rest : rest));
  const Lanes z = y * y;
  Lanes p = z * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0;
  p = p * z - 1.0 / 39916800.0;
  p = p * z + 1.0 / 362880.0;
  p = p * z - 1.0 / 5040.0;
  p = p * z + 1.0 / 120.0;
  p = p * z - 1.0 / 6.0;
  return y + y * z * p;
}

WEFT_SIM_CLONES double sum_of_waves(const double* amplitude, const double* turns_x,
                                    const double* turns_y, const double* phase, std::size_t count,
                                    double x_m, double y_m) {
  Lanes sum{};
  for (std::size_t i = 0; i < count; i += simd::width) {
    const Lanes turns =
        simd::load(turns_x + i) * x_m + simd::load(turns_y + i) * y_m + simd::load(phase + i);
    sum += simd::load(amplitude + i) * cosine_of_turns(turns);
  }
  return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

double limited(double value, double largest) {
  return std::isnan(value) ? 0 : std::clamp(value, -largest, largest);
}
Vector2 limited(const Vector2& value, double largest) {
  return {limited(value[0], largest), limited(value[1], largest)};
}

}  // namespace

RubbingParams with_grain(RubbingParams params, double grain_m) {
  if (!(grain_m > 0)) return params;
  params.asperity_share = std::min(1.0, grain_m / (2 * params.face_half_width_m));
  params.coarsest_m = grain_m;
  return params;
}

FaceWaves::FaceWaves(std::span<const HeightField::Term> terms, double skew_rad,
                     double face_half_width_m, std::size_t most) {
  struct Retained {
    double mean_m, kx, ky, phase_rad;
  };
  std::vector<Retained> retained;
  const double c = std::cos(skew_rad), s = std::sin(skew_rad);
  for (const HeightField::Term& term : terms) {
    const double kx = c * term.ku - s * term.kv, ky = s * term.ku + c * term.kv;
    retained.push_back(
        {term.amplitude_m * sinc(kx * face_half_width_m) * sinc(ky * face_half_width_m), kx, ky,
         term.phase_rad});
  }
  std::stable_sort(retained.begin(), retained.end(), [](const Retained& a, const Retained& b) {
    return std::abs(a.mean_m) > std::abs(b.mean_m);
  });
  if (retained.size() > most) retained.resize(most);
  count_ = (retained.size() + simd::width - 1) / simd::width * simd::width;
  for (std::vector<double>* all : {&amplitude_m_, &turns_x_, &turns_y_, &phase_turns_})
    all->assign(count_, 0.0);
  for (std::size_t i = 0; i < retained.size(); ++i) {
    amplitude_m_[i] = retained[i].mean_m;
    turns_x_[i] = retained[i].kx / two_pi;
    turns_y_[i] = retained[i].ky / two_pi;
    phase_turns_[i] = retained[i].phase_rad / two_pi;
  }
}

double FaceWaves::height_m(const Vector2& place_m) const {
  return sum_of_waves(amplitude_m_.data(), turns_x_.data(), turns_y_.data(), phase_turns_.data(),
                      count_, place_m[0], place_m[1]);
}

Asperities::Asperities(double coarsest_m, double finest_share, std::uint64_t seed) {
  double cell_m = coarsest_m, amplitude = 1, squares = 0;
  for (std::size_t i = 0; i < octaves; ++i) {
    octaves_[i] = {1 / cell_m, amplitude, mix(seed, i), -2, 0, 0};  // no cell is -2 or next to it
    squares += amplitude * amplitude;
    cell_m /= 2;
    amplitude *= finest_share;
  }
  // Uniform in +-1 has variance 1/3; linear interpolation of such values has 2/3 of that.
  for (Octave& octave : octaves_) octave.amplitude *= std::sqrt(4.5 / squares);
}

double Asperities::at(double path_m) {
  double sum = 0;
  for (Octave& o : octaves_) {
    const double position = path_m * o.cells_per_m;
    const auto cell = static_cast<std::int64_t>(position);
    if (cell != o.cell) {
      const auto drawn = [&](std::int64_t i) {
        return Random(mix(o.seed, static_cast<std::uint64_t>(i))).uniform(-1, 1);
      };
      o.left = cell == o.cell + 1 ? o.right : drawn(cell);
      o.right = drawn(cell + 1);
      o.cell = cell;
    }
    sum += o.amplitude * (o.left + (position - static_cast<double>(cell)) * (o.right - o.left));
  }
  return sum;
}

Rubbing::Rubbing(const RubbingParams& params, const HeightField& field, std::uint64_t seed,
                 double skew_rad)
    : params_(params),
      waves_(field.terms(), skew_rad, params.face_half_width_m, params.waves),
      normal_(params.coarsest_m, params.finest_share, mix(seed, "asperities, normal")),
      tangential_(params.coarsest_m, params.finest_share, mix(seed, "asperities, tangential")) {}

Result<Rubbing> Rubbing::make(const RubbingParams& params, const HeightField& field,
                              std::uint64_t seed, double skew_rad) {
  constexpr std::string_view what = "parameter of the face out of range";
  if (auto ok =
          check_limits({{"face_half_width_m", what, params.face_half_width_m, 0, 1, "0 to 1"},
                        {"waves", what, static_cast<double>(params.waves), 0, 4096, "at most 4096"},
                        {"asperity_share", what, params.asperity_share, 0, 10, "0 to 10"},
                        {"coarsest_m", what, params.coarsest_m, 1e-6, 1, "1e-6 to 1"},
                        {"finest_share", what, params.finest_share, 0, 1, "0 to 1"},
                        {"skew_rad", what, skew_rad, -10, 10, "-10 to 10"}});
      !ok)
    return pass(ok.error());
  return Rubbing(params, field, seed, skew_rad);
}

Force Rubbing::advance(const SlidingContact& contact) {
  const Vector2 place = limited(contact.place_m, farthest_m);
  const Vector2 friction = limited(contact.friction_n, largest_n);
  const double normal = std::max(0.0, limited(contact.normal_n, largest_n));
  const double stiffness = std::max(0.0, limited(contact.stiffness_n_m, largest_stiffness_n_m));
  const Vector2 moved =
      started_ ? Vector2{place[0] - place_m_[0], place[1] - place_m_[1]} : Vector2{};
  const double all = size(moved);
  const double distance = all <= longest_step_m ? all : 0;
  if (distance > 0) direction_ = {moved[0] / distance, moved[1] / distance};
  path_m_ += distance;
  place_m_ = place;
  started_ = true;
  if (!(normal > 0)) return {};

  const double scratch = params_.asperity_share;
  // Waves and asperities can unload the face but not pull it; without load there is no scratching.
  const double pressed = std::max(
      -normal, stiffness * waves_.height_m(place) + scratch * normal * normal_.at(path_m_));
  const double scratched =
      normal + pressed > 0 ? scratch * size(friction) * tangential_.at(path_m_) : 0;
  const double more = 1 + pressed / normal;  // friction follows the load
  return {friction[0] * more + direction_[0] * scratched,
          friction[1] * more + direction_[1] * scratched, normal + pressed};
}

}  // namespace weft::sim
