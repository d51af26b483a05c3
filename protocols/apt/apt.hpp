#pragma once
// Thorlabs APT / Kinesis protocol: frames, bodies, status bits, scales. Pure: no I/O, no clock.

#include "protocols/apt/bodies.hpp"       // IWYU pragma: export
#include "protocols/apt/message.hpp"      // IWYU pragma: export
#include "protocols/apt/splitter.hpp"     // IWYU pragma: export
#include "protocols/apt/stage_scale.hpp"  // IWYU pragma: export
#include "protocols/apt/status_bits.hpp"  // IWYU pragma: export
