#include "sim/plant/texture_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sim/plant/near.hpp"

namespace weft::sim {
namespace {

constexpr double cells_per_m = 1 / TextureMap::cell_m;
constexpr double largest_cell = 2e6;  // 100 m: still exact in int and double

/// Half lengths of the disc's chords in cells, and the number of cells of the disc.
struct Disc {
  std::array<std::size_t, 2 * TextureMap::disc_cells + 1> half{};
  float cells = 0;
};

constexpr Disc make_disc() {
  Disc disc;
  constexpr int radius = TextureMap::disc_cells;
  for (int dy = -radius; dy <= radius; ++dy) {
    int half = 0;
    while ((half + 1) * (half + 1) + dy * dy <= radius * radius) ++half;
    const int row = dy + radius;
    disc.half[static_cast<std::size_t>(row)] = static_cast<std::size_t>(half);
    disc.cells += static_cast<float>(2 * half + 1);
  }
  return disc;
}

constexpr Disc disc = make_disc();

/// The numbers of four cells.
using Cells = std::int32_t __attribute__((vector_size(simd::width * sizeof(std::int32_t))));

constexpr int tile_bits = 5;
static_assert(TextureMap::tile_cells == 1 << tile_bits);

/// Floor of a number within int; std::floor is a call before SSE4.1.
int floor_of(double x) {
  const int towards_zero = static_cast<int>(x);
  return towards_zero - (x < towards_zero ? 1 : 0);
}

std::uint64_t key(int column, int row) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(column)) << 32 |
         static_cast<std::uint32_t>(row);
}

constexpr auto offsets_x_m = [] {
  PadBed::Values offsets{};
  for (std::size_t pad = 0; pad < pad_count; ++pad) offsets[pad] = pad_dx_m(pad);
  return offsets;
}();
constexpr auto offsets_y_m = [] {
  PadBed::Values offsets{};
  for (std::size_t pad = 0; pad < pad_count; ++pad) offsets[pad] = pad_dy_m(pad);
  return offsets;
}();

}  // namespace

TextureMap::TextureMap(HeightField field, double lambda_m)
    : field_(std::move(field)),
      lambda_m_(lambda_m),
      log_mean_(static_cast<float>(field_.log_mean_response(lambda_m))),
      raw_(static_cast<std::size_t>(window) * padded),
      prefix_(static_cast<std::size_t>(window + 1) * padded) {}

double TextureMap::response(double u_m, double v_m, Cursor& cursor) {
  if (field_.terms().empty()) return 1;
  const double u = std::clamp(u_m * cells_per_m, -largest_cell, largest_cell);
  const double v = std::clamp(v_m * cells_per_m, -largest_cell, largest_cell);
  const int i = floor_of(u), j = floor_of(v);
  const int column = i >> tile_bits, row = j >> tile_bits;
  if (column != cursor.column || row != cursor.row || cursor.tile == nullptr)
    cursor = {column, row, tile(column, row)};
  const float* at =
      cursor.tile + std::ptrdiff_t{j & (tile_cells - 1)} * outputs + (i & (tile_cells - 1));
  const double a = u - i, b = v - j;
  const auto f = [](float x) { return static_cast<double>(x); };
  return (1 - b) * ((1 - a) * f(at[0]) + a * f(at[1])) +
         b * ((1 - a) * f(at[outputs]) + a * f(at[outputs + 1]));
}

WEFT_SIM_CLONES void TextureMap::responses_of_four(const double* u_m, const double* v_m,
                                                   const bool* sampled, Cursor* cursors,
                                                   double* out) {
  using simd::Lanes, simd::load, simd::store;
  if (field_.terms().empty()) return store(out, Lanes{1, 1, 1, 1});
  const auto cells = [](const double* at_m, Cells& whole) {
    const Lanes largest = Lanes{} + largest_cell;
    Lanes at = load(at_m) * cells_per_m;
    at = at > -largest ? at : -largest;
    at = at < largest ? at : largest;
    whole = __builtin_convertvector(at, Cells);
    const Lanes towards_zero = __builtin_convertvector(whole, Lanes);
    const Lanes floor = at < towards_zero ? towards_zero - 1.0 : towards_zero;
    whole = __builtin_convertvector(floor, Cells);
    return at - floor;
  };
  Cells i, j;
  const Lanes a = cells(u_m, i), b = cells(v_m, j);
  Lanes corners[4];
  for (std::size_t k = 0; k < simd::width; ++k) {
    Cursor& cursor = cursors[k];
    if (!sampled[k]) {
      for (Lanes& corner : corners) corner[k] = 1;
      continue;
    }
    const int column = i[k] >> tile_bits, row = j[k] >> tile_bits;
    if (column != cursor.column || row != cursor.row || cursor.tile == nullptr)
      cursor = {column, row, tile(column, row)};
    const float* at =
        cursor.tile + std::ptrdiff_t{j[k] & (tile_cells - 1)} * outputs + (i[k] & (tile_cells - 1));
    corners[0][k] = at[0];
    corners[1][k] = at[1];
    corners[2][k] = at[outputs];
    corners[3][k] = at[outputs + 1];
  }
  store(out, (1.0 - b) * ((1.0 - a) * corners[0] + a * corners[1]) +
                 b * ((1.0 - a) * corners[2] + a * corners[3]));
}

const float* TextureMap::tile(int column, int row) {
  std::shared_ptr<float[]>& slot = tiles_[key(column, row)];
  if (!slot) {
    slot = std::make_shared<float[]>(static_cast<std::size_t>(outputs) * outputs);
    synthesise(strip(HeightField::Axis::u, column), strip(HeightField::Axis::v, row));
    average(slot.get());
  }
  return slot.get();
}

const TextureMap::Strip& TextureMap::strip(HeightField::Axis axis, int index) {
  Strip& strip = (axis == HeightField::Axis::u ? strips_u_ : strips_v_)[index];
  if (strip.cosine.empty()) fill_strip(strip, axis, index);
  return strip;
}

void TextureMap::fill_strip(Strip& strip, HeightField::Axis axis, int index) const {
  const auto& terms = field_.terms();
  const std::size_t even = terms.size() + terms.size() % 2;  // one term of zeros makes pairs
  strip.cosine.resize(even * padded);
  strip.sine.resize(even * padded);
  const double origin_m = (static_cast<double>(index) * tile_cells - disc_cells) * cell_m;
  std::array<double, padded> wander;
  for (int i = 0; i < padded; ++i)
    wander[static_cast<std::size_t>(i)] = field_.wander(axis, origin_m + i * cell_m);
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const bool along_u = axis == HeightField::Axis::u;
    float* cosine = &strip.cosine[k * padded];
    float* sine = &strip.sine[k * padded];
    if ((along_u ? terms[k].jitter_u : terms[k].jitter_v) == 0)
      fill_straight(terms[k], axis, origin_m, cosine, sine);
    else
      fill_wandering(terms[k], axis, origin_m, wander.data(), cosine, sine);
    const double scale = along_u ? 1 : terms[k].amplitude_m / lambda_m_;
    for (int i = 0; i < padded; ++i) {
      cosine[i] *= static_cast<float>(scale);
      sine[i] *= static_cast<float>(scale);
    }
  }
}

/// Each point is the last one rotated: no trigonometry.
void TextureMap::fill_straight(const HeightField::Term& term, HeightField::Axis axis,
                               double origin_m, float* cosine, float* sine) const {
  const double turn = (axis == HeightField::Axis::u ? term.ku : term.kv) * cell_m;
  const double turn_c = std::cos(turn), turn_s = std::sin(turn);
  const double phase = field_.phase(term, axis, origin_m, 0);
  double c = std::cos(phase), s = std::sin(phase);
  for (int i = 0; i < padded; ++i) {
    cosine[i] = static_cast<float>(c);
    sine[i] = static_cast<float>(s);
    const double turned = c * turn_c - s * turn_s;
    s = s * turn_c + c * turn_s;
    c = turned;
  }
}

void TextureMap::fill_wandering(const HeightField::Term& term, HeightField::Axis axis,
                                double origin_m, const double* wander, float* cosine,
                                float* sine) const {
  for (int i = 0; i < padded; ++i) {
    const double phase = field_.phase(term, axis, origin_m + i * cell_m, wander[i]);
    cosine[i] = static_cast<float>(std::cos(phase));
    sine[i] = static_cast<float>(std::sin(phase));
  }
}

void TextureMap::synthesise(const Strip& u, const Strip& v) {
  const std::size_t terms = u.cosine.size() / padded;
  for (std::size_t j = 0; j < window; ++j) {
    float* out = &raw_[j * padded];
    std::fill_n(out, padded, -log_mean_);
    // Two terms per pass halve the memory traffic of the row of sums; the number of terms is even.
    for (std::size_t k = 0; k < terms; k += 2) {
      const std::size_t first = k * padded, second = first + padded;
      const float c1 = v.cosine[first + j], s1 = v.sine[first + j];
      const float c2 = v.cosine[second + j], s2 = v.sine[second + j];
      const float *uc1 = &u.cosine[first], *us1 = &u.sine[first];
      const float *uc2 = &u.cosine[second], *us2 = &u.sine[second];
      for (std::size_t i = 0; i < padded; ++i)
        out[i] += (c1 * uc1[i] - s1 * us1[i]) + (c2 * uc2[i] - s2 * us2[i]);
    }
    fast_exp<padded>(out);
  }
}

/// Sums along v first, so that every inner loop runs along the rows of memory.
void TextureMap::average(float* out) {
  std::fill_n(prefix_.begin(), padded, 0.0F);
  for (std::size_t j = 0; j < window; ++j)
    for (std::size_t i = 0; i < padded; ++i)
      prefix_[(j + 1) * padded + i] = prefix_[j * padded + i] + raw_[j * padded + i];
  constexpr std::size_t lane = padded - 2 * disc_cells;  // outputs and padding of the last vector
  static_assert(lane >= outputs);
  for (std::size_t j = 0; j < outputs; ++j) {
    float sum[lane] = {};
    for (std::size_t dx = 0; dx <= std::size_t{2} * disc_cells; ++dx) {
      const std::size_t half = disc.half[dx];
      const float* below = &prefix_[(j + disc_cells + half + 1) * padded + dx];
      const float* above = &prefix_[(j + disc_cells - half) * padded + dx];
      for (std::size_t i = 0; i < lane; ++i) sum[i] += below[i] - above[i];
    }
    for (std::size_t i = 0; i < outputs; ++i) out[j * outputs + i] = sum[i] / disc.cells;
  }
}

PadBed::PadBed(const ContactMaterial& material, HeightField field, double skew_rad,
               double offset_x_m, double offset_y_m)
    : law_{material.waviness,  1 / material.law.lambda_m, material.law.pressure_pa,
           std::cos(skew_rad), std::sin(skew_rad),        offset_x_m,
           offset_y_m},
      texture_(std::move(field), material.law.lambda_m) {}

void PadBed::move(const Waviness& waviness, double offset_x_m, double offset_y_m) {
  law_.waviness = waviness;
  law_.offset_x_m = offset_x_m;
  law_.offset_y_m = offset_y_m;
  faces_ = {};
}

void PadBed::remember(int stage, const ContactState& contact) {
  const auto first = static_cast<std::size_t>(stage);
  for (const std::size_t pad : {first, first + std::size_t{pad_timing::stages}}) {
    faces_.x_m[pad] = contact.face_x_m();
    faces_.y_m[pad] = contact.face_y_m();
    faces_.indentation_m[pad] = contact.indentation_m;
    faces_.slope_x[pad] = contact.slope_x;
    faces_.slope_y[pad] = contact.slope_y;
    faces_.load_ratio[pad] = contact.normal_n > 0 ? contact.load_ratio : 0;
  }
}

void PadBed::remember(int stage, const Pose& pose, const ContactState& before,
                      const ContactState& after, double share) {
  const auto on_way = [share](double from, double to) { return from + share * (to - from); };
  const auto first = static_cast<std::size_t>(stage);
  for (const std::size_t pad : {first, first + std::size_t{pad_timing::stages}}) {
    faces_.x_m[pad] = pose.x_m;
    faces_.y_m[pad] = pose.y_m;
    faces_.indentation_m[pad] = on_way(before.indentation_m, after.indentation_m);
    faces_.slope_x[pad] = after.slope_x;
    faces_.slope_y[pad] = after.slope_y;
    faces_.load_ratio[pad] = on_way(before.load_ratio, after.load_ratio);
  }
}

void PadBed::press(int first, int last, Values& pressure_pa) {
  const auto sampled = [&](std::size_t pad) {
    const int stage = static_cast<int>(pad) % pad_timing::stages;
    return stage >= first && stage < last && faces_.load_ratio[pad] > 0;
  };
  std::array<bool, pad_count> touching;
  std::size_t any = pad_count;
  for (std::size_t pad = 0; pad < pad_count; ++pad) {
    touching[pad] = sampled(pad);
    if (touching[pad]) any = pad;
    const int stage = static_cast<int>(pad) % pad_timing::stages;
    if (stage >= first && stage < last) pressure_pa[pad] = 0;
  }
  if (any == pad_count) return;
  Values u_m, v_m, texture, pressed_pa;
  place(law_, faces_, u_m, v_m);
  texture_.responses(u_m, v_m, touching, cursors_, texture);
  if (unworn_ < 1) flatten(unworn_, texture);
  compute(law_, faces_, heights_m_, texture, pressed_pa);
  for (std::size_t pad = 0; pad < pad_count; ++pad)
    if (touching[pad]) pressure_pa[pad] = pressed_pa[pad];
}

/// From the face's centre to each pad, and into the frame of the yarns.
WEFT_SIM_CLONES void PadBed::place(const Law& law, Faces& faces, Values& u_m, Values& v_m) {
  using simd::Lanes, simd::load, simd::store;
  for (std::size_t i = 0; i < pad_count; i += simd::width) {
    const Lanes x = load(&faces.x_m[i]) + load(&offsets_x_m[i]) + law.offset_x_m;
    const Lanes y = load(&faces.y_m[i]) + load(&offsets_y_m[i]) + law.offset_y_m;
    store(&u_m[i], law.skew_cos * x + law.skew_sin * y);
    store(&v_m[i], law.skew_cos * y - law.skew_sin * x);
  }
}

/// A disc's average of e^{(1 - w) h/lambda} is nearly that of e^{h/lambda} to the power 1 - w. The
/// difference is w (1 - w) of half the variance within the disc.
WEFT_SIM_CLONES void PadBed::flatten(double kept, Values& texture) {
  using simd::load, simd::store;
  for (std::size_t i = 0; i < pad_count; i += simd::width)
    store(&texture[i], simd::exp(kept * simd::log(load(&texture[i]))));
}

WEFT_SIM_CLONES void PadBed::compute(const Law& law, const Faces& faces, const Values& heights_m,
                                     const Values& texture, Values& out_pa) {
  using simd::Lanes, simd::load, simd::store;
  for (std::size_t i = 0; i < pad_count; i += simd::width) {
    const Lanes dx = load(&offsets_x_m[i]), dy = load(&offsets_y_m[i]);
    const Lanes local = load(&faces.indentation_m[i]) + load(&faces.slope_x[i]) * dx +
                        load(&faces.slope_y[i]) * dy +
                        law.waviness.heights_m(load(&faces.x_m[i]) + dx, load(&faces.y_m[i]) + dy) +
                        load(&heights_m[i]);
    const Lanes scale = load(&faces.load_ratio[i]) * law.pressure_pa;
    const Lanes pressure = scale * (simd::exp(local * law.per_lambda) * load(&texture[i]) - 1.0);
    const Lanes above = pressure > 0 ? pressure : Lanes{};
    store(&out_pa[i], above < largest_pad_pressure_pa ? above : simd::all(largest_pad_pressure_pa));
  }
}

}  // namespace weft::sim
