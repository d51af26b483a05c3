#pragma once
// Texts about the requested accuracy and speed of a simulated campaign.

#include <string>

#include "daemon/campaign/simulation.hpp"

namespace weft::daemon {

/// "MISSED: asked 120 mN, measured 512 mN (nylon, M1, phase E at 31.2 s); next setting L2 adaptive
/// 0.096 ms promises 7 mN, add --accuracy-strict", "MISSED: asked 120 mN, not checked: 1 of 2 pairs
/// of fabric and exploration, measured ...", or that it was kept. Before the run: the promised
/// accuracy. Empty without a requested accuracy.
std::string format_promise(const SimulationNote& note);
/// "asked 1000x, forecast 1500x, achieved 930x: missed"; empty without a requested speed.
std::string format_budget(const SimulationNote& note);
/// "whole run, with export and evaluation: asked 650x, forecast 690x, achieved 640x: missed"; empty
/// without a requested speed. `wall_s`: of the whole run.
std::string format_whole_run(const SimulationNote& note, double bench_s, double wall_s);
/// "attempts that missed the accuracy: out/aside-1"; empty if there are none.
std::string format_aside(const SimulationNote& note);

}  // namespace weft::daemon
