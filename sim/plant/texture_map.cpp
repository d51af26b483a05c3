#include "sim/plant/texture_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/plant/fast_exp.hpp"

namespace weft::sim {

namespace {

constexpr double largest_cell = 2e6;  // 100 m: still exact in int and double
constexpr int lane = 16;              // floats summed at a time; fits the registers of SSE

/// Half lengths of the disc's chords in cells, and the number of cells of the disc.
struct Disc {
  std::array<int, 2 * TextureMap::disc_cells + 1> half{};
  float cells = 0;
};

constexpr Disc make_disc() {
  Disc disc;
  constexpr int radius = TextureMap::disc_cells;
  for (int dy = -radius; dy <= radius; ++dy) {
    int half = 0;
    while ((half + 1) * (half + 1) + dy * dy <= radius * radius) ++half;
    disc.half[static_cast<std::size_t>(dy + radius)] = half;
    disc.cells += static_cast<float>(2 * half + 1);
  }
  return disc;
}

constexpr Disc disc = make_disc();

std::uint64_t key(int column, int row) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(column)) << 32 |
         static_cast<std::uint32_t>(row);
}

}  // namespace

TextureMap::TextureMap(HeightField field, double lambda_m)
    : field_(std::move(field)),
      lambda_m_(lambda_m),
      log_mean_(static_cast<float>(field_.log_mean_response(lambda_m))),
      raw_(static_cast<std::size_t>(window) * padded),
      prefix_(static_cast<std::size_t>(window) * (window + 1)) {}

double TextureMap::response(double u_m, double v_m, Cursor& cursor) {
  if (field_.terms().empty()) return 1;
  const double u = std::clamp(u_m / cell_m, -largest_cell, largest_cell);
  const double v = std::clamp(v_m / cell_m, -largest_cell, largest_cell);
  const double u_cell = std::floor(u), v_cell = std::floor(v);
  const int column = static_cast<int>(std::floor(u_cell / tile_cells));
  const int row = static_cast<int>(std::floor(v_cell / tile_cells));
  if (column != cursor.column || row != cursor.row || cursor.tile == nullptr)
    cursor = {column, row, tile(column, row)};
  const auto i = static_cast<std::ptrdiff_t>(u_cell) - std::ptrdiff_t{column} * tile_cells;
  const auto j = static_cast<std::ptrdiff_t>(v_cell) - std::ptrdiff_t{row} * tile_cells;
  const float* at = cursor.tile + j * outputs + i;
  const double a = u - u_cell, b = v - v_cell;
  const auto f = [](float x) { return static_cast<double>(x); };
  return (1 - b) * ((1 - a) * f(at[0]) + a * f(at[1])) +
         b * ((1 - a) * f(at[outputs]) + a * f(at[outputs + 1]));
}

const float* TextureMap::tile(int column, int row) {
  std::unique_ptr<float[]>& slot = tiles_[key(column, row)];
  if (!slot) {
    slot = std::make_unique<float[]>(static_cast<std::size_t>(outputs) * outputs);
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
  strip.cosine.resize(terms.size() * padded);
  strip.sine.resize(terms.size() * padded);
  const double origin_m = (static_cast<double>(index) * tile_cells - disc_cells) * cell_m;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const bool along_u = axis == HeightField::Axis::u;
    const double scale = along_u ? 1 : terms[k].amplitude_m / lambda_m_;
    const bool straight = (along_u ? terms[k].jitter_u : terms[k].jitter_v) == 0;
    const double number = along_u ? terms[k].ku : terms[k].kv;
    double phase = field_.phase(terms[k], axis, origin_m);
    double c = std::cos(phase), s = std::sin(phase);
    const double turn_c = std::cos(number * cell_m), turn_s = std::sin(number * cell_m);
    for (std::size_t i = 0; i < padded; ++i) {
      strip.cosine[k * padded + i] = static_cast<float>(scale * c);
      strip.sine[k * padded + i] = static_cast<float>(scale * s);
      if (straight) {  // the next point by a rotation: no trigonometry
        const double turned = c * turn_c - s * turn_s;
        s = s * turn_c + c * turn_s;
        c = turned;
      } else {
        phase = field_.phase(terms[k], axis, origin_m + static_cast<double>(i + 1) * cell_m);
        c = std::cos(phase);
        s = std::sin(phase);
      }
    }
  }
}

void TextureMap::synthesise(const Strip& u, const Strip& v) {
  const std::size_t terms = field_.terms().size();
  for (std::size_t j = 0; j < window; ++j)
    for (std::size_t i = 0; i < padded; i += lane) {
      float sum[lane];
      std::fill(std::begin(sum), std::end(sum), -log_mean_);
      for (std::size_t k = 0; k < terms; ++k) {
        const float cv = v.cosine[k * padded + j], sv = v.sine[k * padded + j];
        const float* cu = &u.cosine[k * padded + i];
        const float* su = &u.sine[k * padded + i];
        for (int n = 0; n < lane; ++n) sum[n] += cv * cu[n] - sv * su[n];
      }
      float* out = &raw_[j * padded + i];
      for (int n = 0; n < lane; ++n) out[n] = fast_exp(sum[n]);
    }
}

void TextureMap::average(float* out) {
  for (std::size_t j = 0; j < window; ++j) {
    float* row = &prefix_[j * (window + 1)];
    row[0] = 0;
    for (std::size_t i = 0; i < window; ++i) row[i + 1] = row[i] + raw_[j * padded + i];
  }
  for (int j = 0; j < outputs; ++j) {
    float sum[outputs] = {};
    for (int dy = 0; dy <= 2 * disc_cells; ++dy) {
      const int half = disc.half[static_cast<std::size_t>(dy)];
      const float* row = &prefix_[static_cast<std::size_t>(j + dy) * (window + 1)];
      const float* right = row + disc_cells + half + 1;
      const float* left = row + disc_cells - half;
      for (int i = 0; i < outputs; ++i) sum[i] += right[i] - left[i];
    }
    for (int i = 0; i < outputs; ++i) out[j * outputs + i] = sum[i] / disc.cells;
  }
}

}  // namespace weft::sim
