#include "daemon/analysis/report/simulation_text.hpp"

#include <array>
#include <cstdio>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

std::string text(const char* format, double a, double b) {
  std::array<char, 128> out{};
  std::snprintf(out.data(), out.size(), format, a, b);
  return out.data();
}

std::string against(const SimulationError& error) {
  return "error against " + error.worst.reference +
         text(": max %.3g mN, rms %.3g mN", error.worst.force_max_n * 1e3,
              error.worst.force_rms_n * 1e3);
}

}  // namespace

std::string sentence(const SimulationNote& note) {
  if (note.empty()) return {};
  std::string out = "Simulated at level " + note.setting + " because " + note.because;
  if (!note.errors.empty()) out += "; " + against(note.errors.back());
  return out;
}

std::vector<std::string> error_lines(const SimulationNote& note) {
  std::vector<std::string> lines;
  for (const SimulationError& error : note.errors) {
    const sim::RunError& e = error.worst;
    const std::string pads =
        e.pads ? text("; taxels max %.0f, rms %.2g counts", e.counts_max, e.counts_rms) : "";
    lines.push_back(against(error) + pads + " (" + std::to_string(error.trials) +
                    (error.trials == 1 ? " trial" : " trials") + " played again, worst on " +
                    error.worst_fabric +
                    text("). Touch-down and ramps, which are not recorded: max %.3g mN; without a "
                         "force loop rms %.3g mN",
                         e.anywhere_max_n * 1e3, e.unled_rms_n * 1e3));
  }
  return lines;
}

std::string simulation_text(const SimulationNote& note) {
  if (note.empty()) return {};
  std::string out = wrapped(sentence(note), "  ");
  for (const std::string& line : error_lines(note)) out += wrapped(line, "    ");
  return out;
}

}  // namespace weft::daemon
