#pragma once
// An emulator that serves one connection of many to the same device.

#include "sim/devices/emulator.hpp"

namespace weft::sim {

class ClientEmulator : public Emulator {
 public:
  /// The client asked for the connection to end, or sent what the port does not serve.
  [[nodiscard]] virtual bool finished() const = 0;
};

}  // namespace weft::sim
