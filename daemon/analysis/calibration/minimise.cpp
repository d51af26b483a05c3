#include "daemon/analysis/calibration/minimise.hpp"

#include <array>
#include <cstdint>

#ifdef WEFT_WITH_NLOPT
#include <nlopt.h>

#include <memory>
#endif

namespace weft::daemon::calibration {
namespace {

constexpr std::size_t most_sobol = 8;
constexpr int sobol_bits = 32;

/// Degree and coefficients of the primitive polynomial, and the first direction numbers.
struct SobolRow {
  unsigned degree, coefficients;
  std::array<std::uint32_t, 5> first;
};
// new-joe-kuo-6, dimensions 2 to 8.
constexpr std::array<SobolRow, most_sobol - 1> sobol_rows{{{1, 0, {1}},
                                                           {2, 1, {1, 3}},
                                                           {3, 1, {1, 3, 1}},
                                                           {3, 2, {1, 1, 1}},
                                                           {4, 1, {1, 1, 3, 3}},
                                                           {4, 4, {1, 3, 5, 13}},
                                                           {5, 2, {1, 1, 5, 5, 17}}}};

using Directions = std::array<std::uint32_t, sobol_bits>;

Directions directions_of(std::size_t dimension) {
  Directions out{};
  for (unsigned i = 0; i < sobol_bits; ++i) out[i] = std::uint32_t{1} << (sobol_bits - 1 - i);
  if (dimension == 0) return out;
  const SobolRow& row = sobol_rows[dimension - 1];
  for (unsigned i = 0; i < row.degree; ++i) out[i] = row.first[i] << (sobol_bits - 1 - i);
  for (unsigned i = row.degree; i < sobol_bits; ++i) {
    out[i] = out[i - row.degree] ^ (out[i - row.degree] >> row.degree);
    for (unsigned k = 1; k < row.degree; ++k)
      if (((row.coefficients >> (row.degree - 1 - k)) & 1U) != 0) out[i] ^= out[i - k];
  }
  return out;
}

}  // namespace

std::vector<double> sobol_point(std::size_t index, std::size_t dimensions) {
  std::vector<double> out;
  for (std::size_t d = 0; d < dimensions; ++d) {
    const Directions directions = directions_of(d);
    const std::size_t gray = index ^ (index >> 1U);
    std::uint32_t bits = 0;
    for (unsigned i = 0; i < sobol_bits; ++i)
      if (((gray >> i) & 1U) != 0) bits ^= directions[i];
    out.push_back(static_cast<double>(bits) * 0x1.0p-32);
  }
  return out;
}

#ifdef WEFT_WITH_NLOPT

namespace {

constexpr double first_step = 0.15;  // as a share of the cube
constexpr double last_step = 1e-3;   // a tenth of a per cent of the bounds

/// Data for the library's callback, and the best point so far: the library may end on another one.
struct Search {
  const Cost* cost;
  Minimum best;
};

double evaluate(unsigned n, const double* x, double*, void* data) {
  Search& search = *static_cast<Search*>(data);
  const std::span<const double> at(x, n);
  const double value = (*search.cost)(at);
  ++search.best.evaluations;
  if (search.best.evaluations == 1 || value < search.best.value) {
    search.best.at.assign(at.begin(), at.end());
    search.best.value = value;
  }
  return value;
}

struct Destroy {
  void operator()(nlopt_opt search) const { nlopt_destroy(search); }
};

}  // namespace

bool has_nlopt() {
  return true;
}

std::string nlopt_version() {
  int major = 0, minor = 0, fix = 0;
  ::nlopt_version(&major, &minor, &fix);
  return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(fix);
}

Result<Minimum> minimise(const Cost& cost, std::span<const double> start, std::size_t evaluations) {
  Search search{&cost, {{start.begin(), start.end()}, 0, 0}};
  const auto n = static_cast<unsigned>(start.size());
  // BOBYQA's models need two dimensions.
  const std::unique_ptr<std::remove_pointer_t<nlopt_opt>, Destroy> method(
      nlopt_create(n < 2 ? NLOPT_LN_COBYLA : NLOPT_LN_BOBYQA, n));
  nlopt_set_lower_bounds1(method.get(), 0);
  nlopt_set_upper_bounds1(method.get(), 1);
  nlopt_set_initial_step1(method.get(), first_step);
  nlopt_set_xtol_abs1(method.get(), last_step);
  // No limit on the gain: it would end searches in curved valleys, where each step gains little.
  nlopt_set_maxeval(method.get(), static_cast<int>(evaluations));
  nlopt_set_min_objective(method.get(), evaluate, &search);
  std::vector<double> x(start.begin(), start.end());
  double value = 0;
  // `search` has the best point, even if NLopt stops at a limit or at steps below rounding.
  nlopt_optimize(method.get(), x.data(), &value);
  if (search.best.evaluations > 0) return search.best;
  return fail({.code = Errc::invalid_argument,
               .where = "calibration",
               .what = "search rejected by NLopt",
               .expected = "a start in the unit cube and at least one evaluation"});
}

#else

bool has_nlopt() {
  return false;
}

std::string nlopt_version() {
  return {};
}

Result<Minimum> minimise(const Cost&, std::span<const double>, std::size_t) {
  return fail({.code = Errc::unsupported,
               .where = "sim calibrate",
               .what = "Weft built without NLopt",
               .expected = "NLopt 2.7 or later",
               .hint = "Install libnlopt-dev and rebuild Weft"});
}

#endif

Result<Minimum> minimise_from_many(const Cost& cost, std::span<const double> start,
                                   std::size_t starts, std::size_t evaluations) {
  auto best = minimise(cost, start, evaluations);
  if (!best) return best;
  std::size_t used = best->evaluations;
  const auto take = [&](std::span<const double> from) -> Status {
    auto found = minimise(cost, from, evaluations);
    if (!found) return pass(found.error());
    used += found->evaluations;
    if (found->value < best->value) best = std::move(found);
    return {};
  };
  const bool many = start.size() <= most_sobol && starts > 1;
  for (std::size_t i = 1; many && i < starts; ++i)
    if (Status ok = take(sobol_point(i, start.size())); !ok) return pass(ok.error());
  if (many)
    if (Status ok = take(std::vector<double>(best->at)); !ok) return pass(ok.error());
  best->evaluations = used;
  return best;
}

}  // namespace weft::daemon::calibration
