#include "recipes/engine/sweep.hpp"

#include <array>
#include <charconv>

#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

struct KindNames {
  std::string_view name, plain, unit, file_unit;
  double per_si;
};

/// In the order of the enumeration.
constexpr std::array kinds{
    KindNames{"force_n", "force", " N", "N", 1},
    KindNames{"speed_mps", "speed", " mm/s", "mm_s", 1e3},
    KindNames{"press_s", "press", " s", "s", 1}, KindNames{"stroke_m", "stroke", " mm", "mm", 1e3},
    KindNames{"direction_rad", "direction", " deg", "deg", quantities::deg_per_rad}};

const KindNames& names_of(FactorKind kind) {
  return kinds.at(static_cast<std::size_t>(kind));
}

/// Six digits are finer than any stage or sensor, and hide the rounding of mm in metres.
std::string number(FactorKind kind, double si) {
  std::array<char, 32> digits{};
  const auto [end, error] =
      std::to_chars(digits.data(), digits.data() + digits.size(), si * names_of(kind).per_si,
                    std::chars_format::general, 6);
  return {digits.data(), end};
}

std::string factor_text(const Factor& factor) {
  std::string out(names_of(factor.kind).plain);
  for (std::size_t i = 0; i < factor.values.size(); ++i)
    out += (i == 0 ? " " : ", ") + number(factor.kind, factor.values[i]);
  return out + std::string(names_of(factor.kind).unit);
}

}  // namespace

std::string_view factor_name(FactorKind kind) {
  return names_of(kind).name;
}

std::string format_factor(FactorKind kind, double si) {
  return number(kind, si) + std::string(names_of(kind).file_unit);
}

std::uint64_t Sweep::full_cells() const {
  std::uint64_t product = 1;
  for (const Factor& factor : factors)
    if (__builtin_mul_overflow(product, std::uint64_t{factor.values.size()}, &product))
      return UINT64_MAX;
  return product;
}

std::vector<double> Sweep::values(const std::vector<std::size_t>& cell) const {
  std::vector<double> out;
  for (std::size_t i = 0; i < factors.size(); ++i) out.push_back(factors[i].values[cell[i]]);
  return out;
}

std::string_view to_string(BlockBy block_by) {
  constexpr std::array<std::string_view, 3> words{"fabric", "replicate", "none"};
  return words.at(static_cast<std::size_t>(block_by));
}

std::string_view to_string(SweepModel model) {
  return model == SweepModel::linear ? "linear" : "quadratic";
}

std::string sweep_text(const Sweep& sweep) {
  std::string out;
  for (const Factor& factor : sweep.factors)
    out += (out.empty() ? "" : " x ") + factor_text(factor);
  const std::string cells = std::to_string(sweep.cells.size());
  if (sweep.fraction) {
    std::array<char, 32> digits{};
    const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(),
                                            sweep.d_efficiency, std::chars_format::fixed, 3);
    out += ": " + cells + " of " + std::to_string(sweep.full_cells()) + " cells, D-optimal for a " +
           std::string(to_string(sweep.fraction->model)) + " model (D-efficiency " +
           std::string(digits.data(), end) + ")";
  } else {
    out += ": all " + cells + " cells";
  }
  out += sweep.replicates == 1 ? ", 1 replicate"
                               : ", " + std::to_string(sweep.replicates) + " replicates";
  if (sweep.block_by == BlockBy::none)
    out += ", not blocked";
  else
    out += ", blocked by " + std::string(to_string(sweep.block_by));
  return out + (sweep.randomised ? ", order randomised by seed " + std::to_string(sweep.seed)
                                 : ", order as listed");
}

}  // namespace weft::recipes
