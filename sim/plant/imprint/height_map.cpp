#include "sim/plant/imprint/height_map.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "sim/plant/bounds.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {
namespace {

constexpr std::size_t most_taxels = std::size_t{1} << 22;
constexpr double largest_height_m = 1;
constexpr double largest_force_n = 1e6;

constexpr int shrinking_passes = 12;  // 3 to 8 in use; the rest is sorted
constexpr double out_of_reach = -1e200;

/// In the coordinate m = t (linear, in L) or e^t - 1, both laws are linear in one unknown a. The
/// load of a taxel, in P, is a + m or a (1 + m) + m; that of the highest taxel is a.
struct Law {
  bool curved;

  [[nodiscard]] double coordinate(double below) const { return curved ? std::expm1(below) : below; }
  [[nodiscard]] double weight(double m) const { return curved ? 1 + m : 1; }
  [[nodiscard]] double load(double a, double m) const { return curved ? a * (1 + m) + m : a + m; }
  [[nodiscard]] double depth(double a) const { return curved ? std::log1p(a) : a; }
};

/// The unknown if exactly the taxels `from` to `to` touched.
double balance(const Law& law, double load, const double* from, const double* to) {
  double sum = 0;
  for (const double* m = from; m != to; ++m) sum += *m;
  const auto count = static_cast<double>(to - from);
  return (load - sum) / (law.curved ? count + sum : count);
}

/// Adds taxels from the highest down, until a spring cannot reach the next one.
double balance_by_sorting(const Law& law, double load, std::vector<double>& touching) {
  std::sort(touching.begin(), touching.end(), std::greater<>());
  double a = load, sum = 0, weight = 0;
  for (const double m : touching) {
    if (weight > 0 && law.load(a, m) <= 0) break;
    sum += m;
    weight += law.weight(m);
    a = (load - sum) / weight;
  }
  return a;
}

/// The unknown for a total load, in P. A taxel that is counted without touching makes the result
/// too deep, because its load would be negative. A taxel beyond reach therefore stays beyond reach.
/// Removing such taxels and solving again ends at the true set of contacts.
double solve(const Law& law, double load, std::vector<double>& touching) {
  for (int pass = 0; pass < shrinking_passes; ++pass) {
    const double a = balance(law, load, touching.data(), touching.data() + touching.size());
    const auto retained = std::remove_if(touching.begin(), touching.end(),
                                         [&](double m) { return law.load(a, m) <= 0; });
    if (retained == touching.end()) return a;
    touching.erase(retained, touching.end());
  }
  return balance_by_sorting(law, load, touching);
}

Status check(const SpringLaw& law) {
  return check_limits({{"pressure_pa", "pressure of the spring bed out of range", law.pressure_pa,
                        1e-6, 1e12, "1e-6 to 1e12 Pa"},
                       {"length_m", "length of the spring bed out of range", law.length_m, 1e-9, 1,
                        "1e-9 to 1 m"}});
}

constexpr double largest_pressure_pa = 1e30;

Status check_pressures(const Imprint& imprint, const CoverState& cover) {
  const std::size_t n = imprint.pressure_pa.size();
  if (n != imprint.rows * imprint.cols || (!cover.felt_pa.empty() && cover.felt_pa.size() != n))
    return fail({.code = Errc::range,
                 .where = "pressure_pa",
                 .what = "sizes of imprint and cover differ",
                 .expected = std::to_string(cover.felt_pa.empty() ? imprint.rows * imprint.cols
                                                                  : cover.felt_pa.size()),
                 .got = std::to_string(n)});
  for (const auto& [values, name] :
       {std::pair{&imprint.pressure_pa, "pressure_pa["}, std::pair{&cover.felt_pa, "felt_pa["}})
    for (std::size_t i = 0; i < values->size(); ++i)
      if (!inside((*values)[i], 0, largest_pressure_pa))
        return fail({.code = Errc::range,
                     .where = name + std::to_string(i) + "]",
                     .what = "pressure out of range",
                     .expected = "0 to 1e30 Pa",
                     .got = std::to_string((*values)[i])});
  return {};
}

}  // namespace

Status check_grid(std::size_t rows, std::size_t cols, double spacing_m) {
  if (rows == 0 || cols == 0 || rows > most_taxels || cols > most_taxels / rows)
    return fail({.code = Errc::range,
                 .where = "rows x cols",
                 .what = "size of the array out of range",
                 .expected = "1 to 2^22 taxels",
                 .got = std::to_string(rows) + " x " + std::to_string(cols)});
  return check_limits(
      {{"spacing_m", "spacing out of range", spacing_m, 1e-6, 0.1, "1e-6 to 0.1 m"}});
}

Status check(const HeightMap& map) {
  if (auto ok = check_grid(map.rows, map.cols, map.spacing_m); !ok) return ok;
  if (map.height_m.size() != map.rows * map.cols)
    return fail({.code = Errc::range,
                 .where = "height_m",
                 .what = "number of heights wrong",
                 .expected = std::to_string(map.rows * map.cols) + ", rows x cols",
                 .got = std::to_string(map.height_m.size())});
  const auto bad = std::find_if(map.height_m.begin(), map.height_m.end(),
                                [](double h) { return !(std::abs(h) <= largest_height_m); });
  if (bad != map.height_m.end())
    return fail({.code = Errc::range,
                 .where = "height_m[" + std::to_string(bad - map.height_m.begin()) + "]",
                 .what = "height out of range",
                 .expected = "-1 to 1 m",
                 .got = std::to_string(*bad)});
  return {};
}

Status check_press(double force_n) {
  return check_limits(
      {{"force_n", "force out of range", force_n, 0, largest_force_n, "0 to 1e6 N"}});
}

double highest_m(const HeightMap& map) {
  return *std::max_element(map.height_m.begin(), map.height_m.end());
}

double loaded_fraction(const std::vector<double>& pressure_pa) {
  const auto loaded =
      std::count_if(pressure_pa.begin(), pressure_pa.end(), [](double p) { return p > 0; });
  return static_cast<double>(loaded) / static_cast<double>(pressure_pa.size());
}

Result<Imprint> extract_part(const Imprint& whole, std::size_t row, std::size_t col,
                             std::size_t rows, std::size_t cols) {
  const bool inside = rows > 0 && cols > 0 && rows <= whole.rows && cols <= whole.cols &&
                      row <= whole.rows - rows && col <= whole.cols - cols;
  if (!inside)
    return fail(
        {.code = Errc::range,
         .where = "part",
         .what = "part outside the imprint",
         .expected = "within " + std::to_string(whole.rows) + " x " + std::to_string(whole.cols),
         .got = std::to_string(rows) + " x " + std::to_string(cols) + " from " +
                std::to_string(row) + ", " + std::to_string(col)});
  Imprint part{rows, cols, {}, whole.indentation_m, 0};
  part.pressure_pa.reserve(rows * cols);
  for (std::size_t r = row; r < row + rows; ++r) {
    const double* from = whole.pressure_pa.data() + r * whole.cols + col;
    part.pressure_pa.insert(part.pressure_pa.end(), from, from + cols);
  }
  part.contact_fraction = loaded_fraction(part.pressure_pa);
  return part;
}

Result<Imprint> press_winkler(const HeightMap& map, const SpringLaw& spring, double force_n) {
  if (auto ok = check(map); !ok) return pass(ok.error());
  if (auto ok = check_press(force_n); !ok) return pass(ok.error());
  if (auto ok = check(spring); !ok) return pass(ok.error());
  Imprint imprint{map.rows, map.cols, std::vector<double>(map.height_m.size(), 0.0), 0, 0};
  const double load = force_n / (map.cell_m2() * spring.pressure_pa);
  if (!(load > 0)) return imprint;

  const Law law{spring.kind == SpringLaw::Kind::exponential};
  const double top_m = highest_m(map);
  const double reach = law.depth(load);  // depth of the highest taxel if it carried the whole load
  std::vector<double>& m = imprint.pressure_pa;
  std::vector<double> touching;
  touching.reserve(m.size());
  for (std::size_t i = 0; i < m.size(); ++i) {
    const double below = (map.height_m[i] - top_m) / spring.length_m;
    m[i] = below + reach > 0 ? law.coordinate(below) : out_of_reach;
    if (below + reach > 0) touching.push_back(m[i]);
  }
  const double a = solve(law, load, touching);
  for (double& value : m) value = std::max(0.0, spring.pressure_pa * law.load(a, value));
  imprint.indentation_m = spring.length_m * law.depth(a);
  imprint.contact_fraction = loaded_fraction(m);
  return imprint;
}

Status check(const TaxelParams& params) {
  return check_limits(
      {{"full_scale_pa", "full scale out of range", params.full_scale_pa, 1, 1e9, "1 to 1e9 Pa"},
       {"bits", "number of bits out of range", static_cast<double>(params.bits), 1, 12, "1 to 12",
        true},
       {"hysteresis", "hysteresis out of range", params.hysteresis, 0, 4, "0 to 4"},
       {"noise_counts", "noise out of range", params.noise_counts, 0, 100, "0 to 100"}});
}

Result<TaxelFrame> read_taxels(const TaxelParams& params, const Imprint& imprint, CoverState& cover,
                               std::uint64_t noise_seed) {
  if (auto ok = check(params); !ok) return pass(ok.error());
  if (auto ok = check_pressures(imprint, cover); !ok) return pass(ok.error());
  const std::size_t n = imprint.pressure_pa.size();
  cover.felt_pa.resize(n, 0.0);
  TaxelFrame frame{imprint.rows, imprint.cols, std::vector<std::uint16_t>(n), 0};
  const double highest = std::exp2(params.bits) - 1;
  Random noise(noise_seed);
  std::size_t saturated = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double pressure = imprint.pressure_pa[i];
    double& felt = cover.felt_pa[i];
    felt = std::clamp(felt, pressure, (1 + params.hysteresis) * pressure);
    const double jitter = params.noise_counts > 0 ? params.noise_counts * noise.gaussian() : 0;
    const double counts = std::round(highest * felt / params.full_scale_pa + jitter);
    frame.counts[i] = static_cast<std::uint16_t>(std::clamp(counts, 0.0, highest));
    saturated += counts >= highest ? 1 : 0;
  }
  frame.saturated_fraction = static_cast<double>(saturated) / static_cast<double>(n);
  return frame;
}

}  // namespace weft::sim
