#include "sim/plant/imprint/winkler.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

namespace weft::sim {

namespace {

constexpr int shrinking_passes = 12;  // in use 3 to 8 do; what then remains is sorted
constexpr double out_of_reach = -1e200;

/// In the coordinate m = t (linear, in L) or e^t - 1, both laws are linear in one unknown a:
/// the load of a taxel, in P, is a + m or a (1 + m) + m, and the highest taxel's is a itself.
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

/// Taxels below the first that a spring cannot reach are left out one by one, from the top down.
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

/// The unknown for a total load, in P. Counting a taxel that does not touch makes the answer too
/// deep (its load would be negative), so that what is out of reach then is out of reach for good:
/// dropping it and solving again ends at the true set of contacts.
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
  if (!(law.pressure_pa >= 1e-6 && law.pressure_pa <= 1e12))
    return fail({.code = Errc::range,
                 .where = "pressure_pa",
                 .what = "no spring bed has this pressure",
                 .expected = "1e-6 to 1e12 Pa",
                 .got = std::to_string(law.pressure_pa)});
  if (!(law.length_m >= 1e-9 && law.length_m <= 1))
    return fail({.code = Errc::range,
                 .where = "length_m",
                 .what = "no spring bed has this length",
                 .expected = "1e-9 to 1 m",
                 .got = std::to_string(law.length_m)});
  return {};
}

}  // namespace

Result<Imprint> press_winkler(const HeightMap& map, const SpringLaw& spring, double force_n) {
  if (auto ok = check(map); !ok) return pass(ok.error());
  if (auto ok = check_press(force_n); !ok) return pass(ok.error());
  if (auto ok = check(spring); !ok) return pass(ok.error());
  Imprint imprint{map.rows, map.cols, std::vector<double>(map.height_m.size(), 0.0), 0, 0};
  const double load = force_n / (map.cell_m2() * spring.pressure_pa);
  if (!(load > 0)) return imprint;

  const Law law{spring.kind == SpringLaw::Kind::exponential};
  const double top_m = highest_m(map);
  const double reach = law.depth(load);  // of the highest taxel if it carried everything
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

}  // namespace weft::sim
