#include "tests/bench/peers/scenes.hpp"

#include <algorithm>

#include "tests/bench/figures.hpp"

namespace weft::bench::peers {
namespace {

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

Run measure(std::string setting, double step_s, double duration_s,
            const std::function<void(Track&)>& simulate,
            const std::function<double(const Track&)>& error_of) {
  constexpr std::size_t least_runs = 3, most_runs = 15;
  constexpr double enough_s = 0.3;
  std::vector<double> cpu;
  Track track;
  double spent = 0;
  while (cpu.size() < least_runs || (spent < enough_s && cpu.size() < most_runs)) {
    track.clear();
    const double start = cpu_seconds();
    simulate(track);
    cpu.push_back(cpu_seconds() - start);
    spent += cpu.back();
  }
  if (cpu.size() % 2 == 0) cpu.pop_back();
  Run out{std::move(setting), step_s, error_of(track), median(cpu) / duration_s, true, false};
  out.failed = !(out.error < 10.0);
  return out;
}

double press_error(const Press& scene, const Track& track) {
  double worst = track.empty() ? NAN : 0.0;
  for (const auto& [t, x] : track) {
    const double error = std::abs(x - scene.indentation_m(t)) / scene.static_m();
    if (!(error <= worst)) worst = error;  // keeps a NaN
  }
  return worst;
}

// Mean over the last tenth of a second, so that chatter about the right force counts as right.
double slide_error(const Slide& scene, const Track& track) {
  double sum = 0;
  std::size_t count = 0;
  for (const auto& [t, force] : track) {
    if (t < scene.duration_s - 0.1) continue;
    sum += force;
    ++count;
  }
  return std::abs(sum / static_cast<double>(count) / scene.friction_n() - 1);
}

}  // namespace weft::bench::peers
