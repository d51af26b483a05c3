#pragma once
// What is said of an accuracy and of a speed that a simulated campaign was asked for.

#include <string>

#include "daemon/campaign/simulation.hpp"

namespace weft::daemon {

/// "MISSED: asked 120 mN, measured 512 mN (nylon, M1, phase E at 31.2 s); next setting L2 adaptive
/// 0.096 ms promises 7 mN, add --accuracy-strict", "MISSED: asked 120 mN, not checked: 1 of 2 pairs
/// of fabric and exploration, measured ...", or that it was kept; before the run what is promised.
/// Empty where no accuracy was asked for.
std::string format_promise(const SimulationNote& note);
/// "asked 1000x, forecast 1500x, achieved 930x: missed"; empty where no speed was asked for.
std::string format_budget(const SimulationNote& note);
/// "whole run, with export and evaluation: asked 650x, forecast 690x, achieved 640x: missed";
/// nothing where no speed was asked for. `wall_s`: of the whole run.
std::string format_whole_run(const SimulationNote& note, double bench_s, double wall_s);
/// "attempts that missed the accuracy: out/aside-1"; empty where there are none.
std::string format_aside(const SimulationNote& note);

}  // namespace weft::daemon
