#pragma once

/// The slide that the scenes of `weft trade sim` are about: what Khan and others press and how fast
/// they go (000, section III-B), and where the plate lies on the simulated bench.
namespace weft::daemon::paper_slide {

constexpr double set_n = 5;
constexpr double slide_mps = 2e-3;
constexpr double plate_z_m = 0.06;

}  // namespace weft::daemon::paper_slide
